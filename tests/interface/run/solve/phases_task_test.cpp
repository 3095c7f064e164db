// SPDX-License-Identifier: BSD-3-Clause
//
// Motions in phases from task files, and what becomes of them when the whole robot with its motors is simulated on a floor that
// gives way.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/algorithms/centroidal.h>
#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/files/task/task_phases.h>
#include <dyntape/interface/run/mpc/mpc_task.h>
#include <dyntape/interface/run/simulate/simulate.h>
#include <dyntape/interface/run/solve/solve.h>
#include "interface/files/task/task_text.h"
#include "source_folder.h"

namespace dyntape::phases_task_test {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

Vector3d foot_at(const RobotScene& scene, const VectorXd& q, const std::string& frame) {
  dynamics::Data<double> data(scene.model);
  dynamics::forward_kinematics<double>(scene.model, data, q);
  return dynamics::frame_placement(scene.model, data, scene.model.frame_index(frame)).p;
}

const char* const kFeet[] = {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"};

class PhasesTask : public test::TaskText {
 protected:
  PhasesTask() : TaskText("phases") {}
  SolveReport solved(const Task& task) {
    SolveReport report = solve_task(task);
    EXPECT_TRUE(report.success()) << report.verdict();
    return report;
  }
};

TEST_F(PhasesTask, AJumpIsAThrowAndHoldsOnAFloorThatGivesWay) {
  load("quadruped_jump");
  const Task task = read();
  ASSERT_EQ(task.phases.size(), 3u);
  SolveReport report = solved(task);
  const Trajectory& motion = report.solution.motion;
  EXPECT_NEAR(motion.t[motion.points() - 1], 0.85, 1e-12);
  const double floor = foot_at(task.scene, motion.x.col(0).head(19), "FL_FOOT").z();
  double most = 0, least = HUGE_VAL, rises = 0;
  const dynamics::Model<double>& model = task.scene.model;
  dynamics::Data<double> data(model);
  dynamics::Centroidal<double> whole(model);
  for (int p = 0; p < motion.points(); ++p) {
    const VectorXd q = motion.x.col(p).head(19), v = motion.x.col(p).tail(18);
    for (const char* foot : kFeet) least = std::min(least, foot_at(task.scene, q, foot).z());
    most = std::max(most, q[2]);
    if (motion.t[p] < 0.301 || motion.t[p] > 0.549) continue;
    EXPECT_EQ(motion.u.col(p).tail(12).norm(), 0) << motion.t[p];
    dynamics::center_of_mass<double>(model, data, whole, q, v, VectorXd::Zero(18));
    if (rises == 0) rises = whole.velocity.z() + 9.81 * motion.t[p];
    EXPECT_NEAR(whole.velocity.z() + 9.81 * motion.t[p], rises, 2e-3) << motion.t[p];
  }
  EXPECT_GT(least, floor - 1.1e-3);
  EXPECT_GT(most, 0.24 + 0.05);

  write_results(task, report, folder_.string());
  std::string text = R"(robot {
  urdf )" + test::source_folder() +
                     R"(/config/robots/solo12.urdf
  base floating
}
effects {
  contacts {
    offset FLOOR
    contact {
      frames      "FL_FOOT FR_FOOT HL_FOOT HR_FOOT"
      stiffness   3e4
      dissipation 1
      friction    0.8
    }
  }
}
commands {
  file      trajectory.csv
  stiffness 30
  damping   0.3
}
start {
  q "0 0.8 -1.6  0 0.8 -1.6  0 -0.8 1.6  0 -0.8 1.6"
  base { position "0 0 0.24" }
}
simulation {
  duration   1.5
  step       5e-4
  integrator implicit-velocity
}
evaluation { route interpreter }
)";
  text.replace(text.find("FLOOR"), 5, std::to_string(floor));
  const Scene scene = read_scene_text(text, (folder_ / "scene.info").string());
  const SimulatedMotion simulated = simulate(scene);
  ASSERT_TRUE(simulated.trouble.empty()) << simulated.trouble;
  double highest = 0, air = 0;
  for (int k = 0; k < simulated.samples(); ++k) {
    const VectorXd q = simulated.q.col(k);
    highest = std::max(highest, q[2]);
    double lowest = HUGE_VAL;
    for (const char* foot : kFeet) lowest = std::min(lowest, foot_at(scene.robot, q, foot).z());
    if (lowest > floor + 0.002) air += scene.sample;
  }
  const VectorXd end = simulated.q.rightCols(1);
  std::printf(
      "trunk to %.3f m (planned %.3f), %.2f s in the air; ends at (%.3f, %.3f, %.3f), turned by %.3f rad, "
      "%.2e m/s\n",
      highest, most, air, end[0], end[1], end[2], 2 * end.segment<3>(3).norm(),
      simulated.v.rightCols(1).norm());
  EXPECT_GT(highest, 0.24 + 0.8 * (most - 0.24));
  EXPECT_GT(air, 0.15);
  EXPECT_LT((end.head<3>() - Vector3d(0, 0, 0.24)).norm(), 0.04);
  EXPECT_LT(2 * end.segment<2>(3).norm(), 0.05);  // upright; it may have turned about the vertical
  EXPECT_LT(2 * std::abs(end[5]), 0.4);
  EXPECT_LT(simulated.v.rightCols(1).norm(), 0.1);
}

// What lands hits the floor: the velocities behind it are those of impulse_dynamics, feet stand, and energy is lost.
TEST_F(PhasesTask, AnImpactTakesTheSpeedOfWhatLands) {
  load("quadruped_jump");
  replace("phase landing {", "phase landing {\n    impact on");
  Task task = read();
  task.expected.reset();
  task.demands.refinements = 0, task.demands.integration_error = 1e3;  // of joints that hardly move here
  const SolveReport report = solved(task);
  const Trajectory& motion = report.solution.motion;
  int after = 1;
  while (motion.t[after] < 0.549 || motion.t[after] != motion.t[after - 1]) ++after;
  const dynamics::Model<double>& model = task.scene.model;
  dynamics::Data<double> data(model);
  std::vector<dynamics::Constraint<double>> feet;
  const VectorXd q = motion.x.col(after).head(19), before = motion.x.col(after - 1).tail(18),
                 v = motion.x.col(after).tail(18);
  for (const char* foot : kFeet)
    feet.push_back(
        dynamics::point_constraint<double>(model, model.frame_index(foot), foot_at(task.scene, q, foot)));
  dynamics::ConstraintData<double> held(model, feet);
  const VectorXd expected = dynamics::impulse_dynamics<double>(model, data, held, q, before, 0.0);
  EXPECT_LT((motion.x.col(after - 1).head(19) - q).norm(), 1e-6);
  EXPECT_LT((v - expected).norm(), 1e-5 * (1 + before.norm()));
  dynamics::constraint_kinematics<double>(model, data, held, q, v);
  EXPECT_LT(held.velocity.norm(), 1e-5);
  dynamics::constraint_kinematics<double>(model, data, held, q, before);
  std::printf("feet hit the floor with %.3f m/s\n", held.velocity.norm());
  EXPECT_GT(held.velocity.norm(), 0.05);
  const double behind = dynamics::kinetic_energy<double>(model, data, q, v),
               ahead = dynamics::kinetic_energy<double>(model, data, q, before);
  EXPECT_LT(behind, 0.99 * ahead);
}

// Feet land beside where they stood, and the trunk goes along.
TEST_F(PhasesTask, FeetLandBesideWhereTheyStood) {
  load("quadruped_jump");
  replace("phase landing {",
          "phase landing {\n    foothold_offset {\n      FL_FOOT \"0.1 0 0\"\n      FR_FOOT \"0.1 0 0\"\n"
          "      HL_FOOT \"0.1 0 0\"\n      HR_FOOT \"0.1 0 0\"\n    }");
  replace("goal {\n  q    0", "goal {\n  q    0\n");
  const std::size_t at = text_.rfind("position \"0 0 0.24\"");
  text_.replace(at, 19, "position \"0.1 0 0.24\"");
  Task task = read();
  task.expected.reset();
  const SolveReport report = solved(task);
  const Trajectory& motion = report.solution.motion;
  for (const char* foot : kFeet) {
    const Vector3d moved = foot_at(task.scene, motion.x.rightCols(1).topRows(19), foot) -
                           foot_at(task.scene, motion.x.col(0).head(19), foot);
    EXPECT_LT((moved - Vector3d(0.1, 0, 0)).norm(), 1e-3) << foot << " " << moved.transpose();
  }
}

// Feet land on a step of two centimetres: above the line between their footholds by what `clearance` says.
TEST_F(PhasesTask, FeetClearTheEdgeOfAStep) {
  load("quadruped_jump");
  replace(
      "phase landing {",
      "phase landing {\n    foothold_offset {\n      FL_FOOT \"0.1 0 0.02\"\n      FR_FOOT \"0.1 0 0.02\"\n"
      "      HL_FOOT \"0.1 0 0.02\"\n      HR_FOOT \"0.1 0 0.02\"\n    }");
  const std::size_t at = text_.rfind("position \"0 0 0.24\"");
  text_.replace(at, 19, "position \"0.1 0 0.26\"");
  // The least height above the curve, of all feet in the air.
  const auto room = [&](double clearance) {
    Task task = read();
    task.expected.reset();
    const Trajectory motion = solved(task).solution.motion;
    double least = HUGE_VAL;
    for (const char* foot : kFeet) {
      const Vector3d from = foot_at(task.scene, motion.x.col(0).head(19), foot);
      for (int p = 0; p < motion.points(); ++p) {
        const Vector3d off = foot_at(task.scene, motion.x.col(p).head(19), foot) - from;
        const double s = off.x() / 0.1;
        if (s > 0.02 && s < 0.98) least = std::min(least, off.z() - 0.02 * s - 4 * clearance * s * (1 - s));
      }
    }
    return least;
  };
  EXPECT_LT(room(0.02), -3e-3);  // without the key
  replace("contacts \"\"", "contacts \"\"\n    clearance 0.02");
  EXPECT_GT(room(0.02), -1.5e-3);
}

// Of a foot that lands where it stood, at half of the time.
TEST_F(PhasesTask, AFootThatComesBackIsHighHalfway) {
  load("quadruped_jump");
  const Task low = read();
  replace("contacts \"\"", "contacts \"\"\n    clearance 0.06");
  const Task high = read();
  const std::vector<Term>& terms = high.parts[1].problem.terms;
  EXPECT_EQ(terms.size(), low.parts[1].problem.terms.size() + 4);
  const auto found = std::find_if(terms.begin(), terms.end(),
                                  [](const Term& term) { return term.name == "HR_FOOT clears its way"; });
  ASSERT_NE(found, terms.end());
  EXPECT_EQ(found->share, 0.5);
  EXPECT_EQ(found->lower[0], 0.06);
}

TEST_F(PhasesTask, WhatIsWrongIsSaid) {
  const auto message_with = [&](const std::string& old, const std::string& with) {
    load("quadruped_jump");
    replace(old, with);
    return message();
  };
  const auto expect = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect(message_with("contacts \"\"", "contacts \"FL_FOT\""), "FL_FOOT");
  expect(message_with("phase landing", "phase flight"), "two phases are called 'flight'");
  expect(message_with("phase landing {", "phase {"), "needs a name behind the word");
  expect(message_with("phase landing {", "phase landing {\n    goal { q 0 }"), "the task's 'goal'");
  expect(message_with("phase push_off {", "phase push_off {\n    foothold_offset { FL_FOOT \"0.1 0 0\" }"),
         "'FL_FOOT' does not land at the beginning of phase 'push_off'");
  expect(message_with("phase landing {", "phase landing {\n    duration -1"), "positive");
  expect(message_with("phase push_off {", "phase push_off {\n    impact on"),
         "nothing lands at the beginning");
  expect(message_with("contacts \"\"", "contacts \"\"\n    impact on"), "nothing lands at the beginning");
  expect(message_with("phase landing {", "phase landing {\n    clearance 0.05"),
         "no contact is in the air in phase 'landing'");
  expect(message_with("contacts \"\"", "contacts \"\"\n    clearance -1"), "clearance");
  load("quadruped_jump");
  const Task jump = read();
  try {
    control_task(jump);
    FAIL() << "a controller takes phases";
  } catch (const ArgumentError& e) {
    expect(e.what(), "has phases");
  }
  load("block_move");
  replace("\ncosts", "\nphases {\n  phase all {\n    contacts \"block\"\n  }\n}\ncosts");
  expect(message(), "the file has no 'contacts'");
}

// What the horizon says holds for each phase that says nothing of its own.
TEST_F(PhasesTask, DurationsAreThoseOfTheHorizonOrOfThePhase) {
  load("block_move_free_time");
  replace("\ncosts", "\nphases {\n  phase all {\n  }\n}\ncosts");
  const Task of_horizon = read();
  ASSERT_TRUE(of_horizon.parts[0].problem.free_time.has_value());
  load("block_move_free_time");
  const SolveReport plain = solve_task(read());
  const SolveReport phased = solve_task(of_horizon);
  EXPECT_NEAR(phased.solution.cost(), plain.solution.cost(), 1e-8);
  EXPECT_NEAR(phased.duration(), plain.duration(), 1e-6);
  EXPECT_FALSE(phased.free_time.has_value());
  ASSERT_EQ(phased.solution.phases.size(), 1u);
}

// What draws to the goal draws to that of the whole motion, in every phase, and what draws at its end does so only there.
TEST_F(PhasesTask, EveryPhaseIsDrawnToTheGoalOfTheMotion) {
  const auto cost = [&](const std::string& phases) {
    load("block_move");
    replace("\ncosts\n{", phases + R"(
costs
{
  tracking {
    q 30
    v 2
    end {
      q 5
      v 1
    }
  })");
    Task task = read();
    task.expected.reset();
    return solved(task).solution.cost();
  };
  const double whole = cost(""), in_two = cost(R"(
phases {
  phase one {
    duration  0.4
    intervals 4
  }
  phase two {
    duration  0.6
    intervals 6
  }
})");
  EXPECT_GT(whole, 15);  // 12 of the force alone
  EXPECT_NEAR(in_two, whole, 1e-4 * whole);
}

// Nothing draws to the neutral configuration where the goal says nothing.
TEST_F(PhasesTask, WhatTheGoalLeavesOpenDrawsNowhere) {
  const auto drawing = [&](const char* weights) {
    load("cart_pole_swing_up");
    replace("goal\n{", "goal\n{\n  free slider");
    replace("costs\n{", std::string("costs\n{\n  tracking {\n    q {\n") + weights + "\n}\n}");
    const Problem problem = read().problem;
    return std::count_if(problem.terms.begin(), problem.terms.end(),
                         [](const Term& term) { return term.name == "tracking"; });
  };
  EXPECT_EQ(drawing("slider 7\npivot 0"), 0);
  EXPECT_EQ(drawing("slider 0\npivot 7"), 1);
}

// Soles stay flat, forces at their corners carry the robot, and it stands when its motors follow the plan on a floor that gives way
// at these corners only.
TEST_F(PhasesTask, ASquatHoldsOnAFloorThatGivesWay) {
  load("humanoid_squat");
  Task task = read();
  task.demands.refinements = 1,
  task.demands.integration_error = 0.1;  // a tenth of what it moves joints of micrometres
  SolveReport report = solved(task);
  const Trajectory& motion = report.solution.motion;
  const dynamics::Model<double>& model = task.scene.model;
  const int nq = model.nq;
  dynamics::Data<double> data(model);
  const int sole = model.frame_index("left_sole_link");
  dynamics::forward_kinematics<double>(model, data, motion.x.col(0).head(nq));
  const auto start = dynamics::frame_placement(model, data, sole);
  double lowest = HUGE_VAL, most = 0, least = HUGE_VAL;
  for (int p = 0; p < motion.points(); ++p) {
    dynamics::forward_kinematics<double>(model, data, motion.x.col(p).head(nq));
    const auto now = dynamics::frame_placement(model, data, sole);
    EXPECT_LT((now.p - start.p).norm(), 1e-4) << motion.t[p];
    EXPECT_LT((Eigen::Matrix3d(now.R) - Eigen::Matrix3d(start.R)).norm(), 1e-3) << motion.t[p];
    lowest = std::min(lowest, motion.x(2, p));
    double up = 0;
    for (int corner = 0; corner < 8; ++corner) up += motion.u(motion.u.rows() - 24 + 3 * corner + 2, p);
    most = std::max(most, up), least = std::min(least, up);
  }
  EXPECT_LT(lowest, 0.73);
  EXPECT_GT(most, 90.27 * 9.81);
  EXPECT_LT(least, 90.27 * 9.81);

  write_results(task, report, folder_.string());
  std::string text = text_.substr(0, text_.find("contacts {")) + R"(
effects {
  contacts {
    offset FLOOR
    contact {
      frames      "left_sole_link right_sole_link"
      stiffness   1e6
      dissipation 1
      friction    0.6
    }
  }
}
commands {
  file      trajectory.csv
  stiffness 3000
  damping   20
}
start {
  q "0 0 -0.4 0.8 -0.4 0  0 0 -0.4 0.8 -0.4 0  0"
  base { position "0 0 1.02" }
}
simulation {
  duration   3
  step       5e-4
  integrator implicit-velocity
}
evaluation { route interpreter }
)";
  text.replace(text.find("FLOOR"), 5, std::to_string(start.p.z()));
  Scene scene = read_scene_text(text, (folder_ / "scene.info").string());
  auto& contacts = scene.robot.effects.contacts;
  const auto soles = contacts;
  contacts.clear();
  for (const auto& at : soles) {
    for (const Vector3d& corner : task.robot.contacts.front().corners) {
      contacts.push_back(at);
      contacts.back().X_BF.p += at.X_BF.R * dynamics::Vector3<double>(corner);
    }
  }
  const SimulatedMotion simulated = simulate(scene);
  ASSERT_TRUE(simulated.trouble.empty()) << simulated.trouble;
  const VectorXd end = simulated.q.rightCols(1);
  std::printf(
      "trunk down to %.3f m (planned %.3f); ends at (%.3f, %.3f, %.3f), turned by %.3f rad, %.2e m/s\n",
      simulated.q.row(2).minCoeff(), lowest, end[0], end[1], end[2], 2 * end.segment<3>(3).norm(),
      simulated.v.rightCols(1).norm());
  EXPECT_NEAR(simulated.q.row(2).minCoeff(), lowest, 0.03);
  EXPECT_LT((end.head<3>() - Vector3d(0, 0, 1.02)).norm(), 0.03);
  EXPECT_LT(2 * end.segment<3>(3).norm(), 0.05);
  EXPECT_LT(simulated.v.rightCols(1).norm(), 0.05);
}

TEST_F(PhasesTask, AFootHasThreeCornersOrMoreThatAreApart) {
  load("humanoid_squat");
  replace("to   \"0.1 0.06 0\"", "to   \"0.1 0.06 0.01\"");
  EXPECT_NE(message().find("agree in z"), std::string::npos) << message();
}

}  // namespace
}  // namespace dyntape::phases_task_test
