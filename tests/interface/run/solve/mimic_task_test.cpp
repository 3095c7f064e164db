// SPDX-License-Identifier: BSD-3-Clause
//
// Tasks of robots whose mimic joints follow their leaders: against optima that are known, and what is wrong in their files.
#include <gtest/gtest.h>

#include <numbers>

#include <dyntape/interface/files/task/task_phases.h>
#include <dyntape/interface/run/mpc/mpc_task.h>
#include <dyntape/interface/run/solve/solve.h>

#include "interface/files/task/task_text.h"
#include "interface/run/tied_robots.h"

namespace dyntape::mimic_task_test {
namespace {

using test::Pendulums;
using test::Sliders;

class MimicTasks : public test::TaskText {
 protected:
  MimicTasks() : TaskText("mimic") {}

  void put(const std::string& urdf, const std::string& rest) {
    write_file_atomically((folder_ / "tied.urdf").string(), urdf);
    text_ = "robot { urdf tied.urdf  mimic true }\n" + rest;
  }
  static std::string ends(const std::string& start, const std::string& goal) {
    return "start { q { a " + start + " } }\ngoal { q { a " + goal + " } }\n";
  }
};

void expect_tied(const Task& task, const Trajectory& motion, double ratio, double offset) {
  const int nq = task.scene.model.nq;
  for (Eigen::Index k = 0; k < motion.x.cols(); ++k) {
    EXPECT_NEAR(motion.x(1, k), ratio * motion.x(0, k) + offset, 1e-8);
    EXPECT_NEAR(motion.x(nq + 1, k), ratio * motion.x(nq, k), 1e-8);
  }
}

// Rest to rest by the least integral of u^2: 12 M^2 d^2 / T^3 with the mass of both.
TEST_F(MimicTasks, SlidersCostWhatTheMassOfBothDoes) {
  const Sliders of;
  for (const char* form : {"forward", "inverse"}) {
    for (const char* scheme : {"hermite-simpson", "radau-3"}) {
      put(of.urdf(), "effects { gravity off }\nhorizon { duration 2  intervals 10 }\ncosts { control 1 }\n" +
                         ends("0.1", "0.6") + "transcription { dynamics " + form + "  scheme " + scheme +
                         " }");
      const Task task = read();
      ASSERT_EQ(task.problem.n_u(), 1);
      const SolveReport report = solve_task(task);
      ASSERT_TRUE(report.success()) << report.text();
      EXPECT_NEAR(report.solution.cost(), 12 * of.mass() * of.mass() * 0.25 / 8, 1e-6)
          << form << " " << scheme;
      expect_tied(task, report.solution.motion, of.ratio, of.offset);
    }
  }
}

// Both forms have one optimum, which re-simulation confirms.
TEST_F(MimicTasks, PendulumsSwingToTheirGoal) {
  const Pendulums of;
  std::vector<double> costs;
  for (const char* form : {"forward", "inverse"}) {
    put(of.urdf(), "horizon { duration 1.5  intervals 30 }\ncosts { control 1 }\n" + ends("0", "2") +
                       "transcription { dynamics " + form + " }");
    const Task task = read();
    const SolveReport report = solve_task(task);
    ASSERT_TRUE(report.success()) << report.text();
    costs.push_back(report.solution.cost());
    expect_tied(task, report.solution.motion, of.ratio, of.offset);
  }
  EXPECT_NEAR(costs[0], costs[1], 1e-3 * costs[0]);
}

// The follower, which is the faster one, is at the bound of velocities.
TEST_F(MimicTasks, SolversHaveTheIndependentJointsOnly) {
  const Pendulums of;
  put(of.urdf(), "horizon { duration 1.5  intervals 30 }\ncosts { control 1 }\nbounds { velocities 3 }\n" +
                     ends("0", "2"));
  const Task task = read();
  const Phases phases = phases_of(task);
  EXPECT_EQ(phases.phases.at(0).problem.states, (std::vector<std::string>{"q.a", "v.a"}));
  const SolveReport report = solve_task(task);
  ASSERT_TRUE(report.success()) << report.text();
  expect_tied(task, report.solution.motion, of.ratio, of.offset);
  EXPECT_NEAR(report.solution.motion.x.row(3).maxCoeff(), 3, 1e-6);
  EXPECT_TRUE(report.excesses.empty());
  EXPECT_EQ(report.open_loop_unit, report.solution.verification.miss_state == "v.a" ? " rad/s" : " rad");
}

// The same closed form.
TEST_F(MimicTasks, AreSolvedByDynamicProgramming) {
  const Sliders of;
  put(of.urdf(),
      "effects { gravity off }\nhorizon { duration 2  intervals 200 }\n"
      "transcription { scheme runge-kutta-4 }\nsolver { method ddp }\n"
      "costs { control 1  tracking { end { q 1e7  v 1e7 } } }\n" +
          ends("0.1", "0.6"));
  const Task task = read();
  const SolveReport report = solve_task(task);
  ASSERT_TRUE(report.success()) << report.text();
  expect_tied(task, report.solution.motion, of.ratio, of.offset);
  EXPECT_NEAR(report.solution.cost(), 12 * of.mass() * of.mass() * 0.25 / 8, 1e-4);
}

TEST_F(MimicTasks, PhasesAreOfTheIndependentJoints) {
  const Sliders of;
  put(of.urdf(),
      "effects { gravity off }\nhorizon { duration 1  intervals 10 }\ncosts { control 1 }\n"
      "phases { phase out { duration 1  intervals 10  goal { q { a -0.3 } } }  phase back { duration 1  "
      "intervals 10 } "
      "}\n" +
          ends("0.1", "0.6"));
  const SolveReport report = solve_task(read());
  ASSERT_TRUE(report.success()) << report.text();
  for (const SolvedPhase& phase : report.solution.phases)
    expect_tied(read(), phase.motion, of.ratio, of.offset);
  const Trajectory& out = report.solution.phases[0].motion;
  EXPECT_NEAR(out.x(1, out.points() - 1), of.ratio * -0.3 + of.offset, 1e-7);
}

TEST_F(MimicTasks, WaypointsAreOfTheLeaders) {
  const Sliders of;
  put(of.urdf(),
      "effects { gravity off }\nhorizon { duration 2  intervals 10 }\ncosts { control 1 }\n"
      "waypoints { waypoint turn { at 0.5  q { a -0.3 } } }\n" +
          ends("0", "0.5"));
  const SolveReport report = solve_task(read());
  ASSERT_TRUE(report.success()) << report.text();
  const Trajectory& motion = report.solution.motion;
  EXPECT_NEAR(motion.x(1, motion.x.cols() / 2), of.ratio * -0.3 + of.offset, 1e-7);
}

// 2 a - 1 within [-1, 0.4], a within [-3, 0.5].
TEST_F(MimicTasks, LeadersKeepTheLimitsOfTheirFollowers) {
  Sliders of;
  of.ratio = 2, of.offset = -1;
  of.limit_a = "lower='-3' upper='0.5'", of.limit_b = "lower='-1' upper='0.4'";
  put(of.urdf(), "horizon { duration 2  intervals 10 }\ncosts { control 1 }\n" + ends("0.1", "0.4"));
  const Bounds x = phases_of(read()).phases.at(0).problem.x;
  EXPECT_NEAR(x.lower[0], 0, 1e-12);
  EXPECT_NEAR(x.upper[0], 0.5, 1e-12);
  EXPECT_NEAR(x.upper[1], 25, 1e-12);  // half of 50 m/s
  replace("q { a 0.1 }", "q { a -0.1 }");
  EXPECT_EQ(message(),
            (folder_ / "task.info").string() +
                ":4:15: the start of \"q.b\", which follows \"a\", is -1.2, the robot's limits are "
                "-1 and 0.4; expected a value of \"a\" that puts it within them, or 'positions "
                "none' in 'bounds'");
}

TEST_F(MimicTasks, FollowersHaveNoGoal) {
  const Sliders of;
  put(of.urdf(), "horizon { duration 2  intervals 10 }\ncosts { control 1 }\n" + ends("0", "0.4"));
  replace("q { a 0.4 }", "q { a 0.4  b 0.3 }");
  EXPECT_NE(message().find("joint 'b' follows 'a' and has no value of its own; expected one for 'a'"),
            std::string::npos)
      << message();
  replace("q { a 0.4  b 0.3 }", "q { a 0.4 }");
  TaskSpec spec = read();
  spec.goal[1] = 0.3;
  const auto refused = [&] {
    try {
      build_task(spec);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("nothing refused");
  };
  EXPECT_NE(refused().find("a position of its own for joint 'b', which follows 'a'"), std::string::npos)
      << refused();
  spec.goal[1] = Problem::kFree, spec.start[1] = 0.3;
  EXPECT_NE(refused().find("has joint 'b' elsewhere than its leader 'a' puts it"), std::string::npos)
      << refused();
}

// The same robot as one body of both masses: the same plans, since a limit of both is none here.
TEST_F(MimicTasks, AreControlled) {
  const Sliders of;
  put(of.urdf(),
      "horizon { duration 1  intervals 20 }\ntranscription { scheme runge-kutta-4  hessian gauss_newton }\n"
      "costs { control 0.01  tracking { q 1  end { q 100  v 10 } } }\n"
      "mpc { duration 2  period 0.05  iterations 2  disturbance { at 1  v { a 0.3 } } }\n" +
          ends("0", "0.4"));
  const Task task = read();
  const ControlReport report = control_task(task);
  const Trajectory& motion = report.loop.motion;
  EXPECT_NEAR(motion.x(0, motion.x.cols() - 1), 0.4, 0.02);
  expect_tied(task, motion, of.ratio, of.offset);
}

}  // namespace
}  // namespace dyntape::mimic_task_test
