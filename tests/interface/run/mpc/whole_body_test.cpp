// SPDX-License-Identifier: BSD-3-Clause
//
// Legged robots steered with their whole body: schedules of contacts, steps that are one linear system, the simulated robot as plant.
#include <gtest/gtest.h>

#include <filesystem>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/algorithms/centroidal.h>
#include <dyntape/interface/control/mpc/receding_horizon.h>
#include <dyntape/interface/control/problem/penalties.h>
#include <dyntape/interface/motion/centroidal_problem.h>
#include <dyntape/interface/run/mpc/mpc_task.h>
#include <dyntape/interface/run/simulate/scene_plant.h>
#include "interface/control/ocp_problems.h"
#include "interface/files/task/task_text.h"
#include "interface/message_of.h"
#include "source_folder.h"

namespace dyntape::whole_body_test {
namespace {

namespace fs = std::filesystem;
using Eigen::VectorXd;

class WholeBody : public test::TaskText {
 protected:
  WholeBody() : TaskText("whole_body") { load_control("solo12_whole_body"); }

  void load_control(const std::string& name) {
    const fs::path folder = fs::path(test::source_folder()) / "config" / "control";
    text_ = read_file((folder / (name + ".info")).string());
    replace("../robots", (folder / "../robots").string());
    replace("../scenes", (folder / "../scenes").string());
  }
  Task task() const {
    const std::string path = (folder_ / "whole_body.info").string();
    write_file_atomically(path, text_);
    Task task = read_task(path);
    task.optimise.mesh.evaluation.route = Route::kInterpreter;
    return task;
  }
};

TEST(Gaits, FeetStandAndAreLiftedInTurn) {
  const Gait trot{.period = 0.4, .duty = 0.6, .phases = {0, 0.5}, .lift = 0.05};
  EXPECT_TRUE(trot.stands(0, 0) && trot.stands(0, 0.239));
  EXPECT_FALSE(trot.stands(0, 0.24) || trot.stands(0, 0.399));  // at a change: what follows
  EXPECT_TRUE(trot.stands(1, 0.2) && trot.stands(1, 0.039) && !trot.stands(1, 0.04));
  EXPECT_EQ(trot.height(0, 0.1), 0);
  EXPECT_NEAR(trot.height(0, 0.32), 0.05, 1e-9);  // half way
  EXPECT_NEAR(trot.height(0, 0.399999), 0, 1e-9);
  EXPECT_NEAR((trot.height(0, 0.2401) - trot.height(0, 0.24)) / 1e-4, 0, 0.01);  // lifted from rest
}

// Linear dynamics, quadratic costs: the step is the optimum, as an interior point finds it.
TEST(EqualityQps, AStepWithoutLimitsIsTheOptimum) {
  Problem free = test::follower(2);
  free.u.lower.setConstant(-HUGE_VAL), free.u.upper.setConstant(HUGE_VAL);
  free.x.lower.setConstant(-HUGE_VAL), free.x.upper.setConstant(HUGE_VAL);
  MpcOptions options;
  options.mesh.intervals = 20, options.mesh.evaluation = test::kInterpreted;
  options.solver.tolerance = 1e-10, options.gains = true;
  RecedingHorizon solved(free, options);
  options.iterations = 1;
  RecedingHorizon stepped(free, options);
  VectorXd x = Eigen::Vector2d(0.3, 0);
  for (int k = 0; k < 4; ++k) {
    const double t = 0.05 * k;
    const MpcStep &a = solved.step(t, x), &b = stepped.step(t, x);
    ASSERT_TRUE(a.usable && b.usable) << k;
    EXPECT_LE((a.plan.motion.x - b.plan.motion.x).cwiseAbs().maxCoeff(), 1e-7) << k;
    EXPECT_LE((a.plan.gain - b.plan.gain).norm(), 1e-6 * a.plan.gain.norm()) << k;
    x = a.plan.state(t + 0.05) + 0.1 * Eigen::Vector2d(1, k);  // pushed far
  }
}

// Semi-implicit Euler of the inverse form: the new velocities move the positions, accelerations hold.
TEST_F(WholeBody, PlansKeepTheirDynamics) {
  const Task task = this->task();
  ASSERT_EQ(task.optimise.mesh.scheme.name, "semi-implicit-euler");
  MpcOptions options;
  options.mesh = task.optimise.mesh;
  options.mesh.intervals = 6;
  options.solver = task.optimise.solver, options.iterations = 1;
  Problem problem = tracking_problem(task);
  problem.duration = 0.12;
  RecedingHorizon mpc(problem, options);
  ASSERT_TRUE(mpc.step(0, problem.start).usable);
  VectorXd x = problem.start;
  x[19] += 0.1;  // m/s, forwards
  const MpcStep& s = mpc.step(0.01, x);
  EXPECT_LE(s.violation, 1e-2);
  EXPECT_LE((s.plan.motion.x.col(0) - x).norm(), 1e-12);
  const Trajectory& m = s.plan.motion;
  const double h = m.t[1] - m.t[0];
  EXPECT_LE((m.x.col(1).tail(18) - m.x.col(0).tail(18) - h * m.a.col(0)).norm(), 1e-9);
  EXPECT_NEAR(m.x(0, 1), m.x(0, 0) + h * m.x(19, 1), 1e-3);
  // The feet, which stand, do not run away with it, and the floor carries the robot.
  double up = 0;
  for (int foot = 0; foot < 4; ++foot) up += m.u(12 + 3 * foot + 2, 0);
  EXPECT_NEAR(up, weight_of(task.scene), 0.5 * weight_of(task.scene));
}

// A foot in the air has no force, one that stands no acceleration but what damps it: the same program.
TEST_F(WholeBody, SchedulesSwitchBetweenForceAndHold) {
  load_control("solo12_whole_body_trots");
  Task task = this->task();
  const Problem& p = task.problem;
  const auto row = std::find_if(p.terms.begin(), p.terms.end(),
                                [](const Term& term) { return term.name == "FL_FOOT holds"; });
  ASSERT_NE(row, p.terms.end());
  Stage<double> s = p.stage(0, p.start, VectorXd::Zero(18), VectorXd::Random(24));
  const Parameter load = p.parameters.find("FL_FOOT load");
  s.p[load.first()] = 0;
  const VectorXd in_air = row->function(s);
  EXPECT_LE((in_air - s.u.segment<3>(12) / weight_of(task.scene)).norm(), 1e-12);
  s.p[load.first()] = 1;
  EXPECT_LE(row->function(s).norm(), 1e-12);  // at rest, not accelerated
  s.a[0] = 1;                                 // the base forwards, and the foot with it
  EXPECT_NEAR(row->function(s).norm(), 1, 1e-9);
}

// The same of a foot with corners: in the air the wrench of all its forces is none, and its corners are drawn to one height.
TEST_F(WholeBody, FeetSwitchBetweenWrenchAndHold) {
  load_control("g1_steps");
  Task task = this->task();
  const Problem& p = task.problem;
  const auto term = [&](const std::string& name) {
    const auto found =
        std::find_if(p.terms.begin(), p.terms.end(), [&](const Term& t) { return t.name == name; });
    EXPECT_NE(found, p.terms.end()) << name;
    return found->function;
  };
  const int nv = task.scene.model.nv, nq = task.scene.model.nq, first = nv - 6;
  Stage<double> s = p.stage(0, p.start, VectorXd::Zero(nv), VectorXd::Random(first + 24));
  s.x.segment<4>(3) =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, -2, 3).normalized())).coeffs();
  dynamics::Data<double> data(task.scene.model);
  dynamics::forward_kinematics<double>(task.scene.model, data, s.x.head(nq), VectorXd::Zero(nv));
  const auto foot = dynamics::frame_placement<double>(task.scene.model, data,
                                                      task.scene.model.frame_index("left_ankle_roll_link"));
  Eigen::Matrix<double, 6, 1> wrench = Eigen::Matrix<double, 6, 1>::Zero();
  const std::vector<Eigen::Vector3d>& corners = task.robot.contacts[0].corners;
  ASSERT_EQ(corners.size(), 4u);
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d f = s.u.segment<3>(first + 3 * i), at = foot.R * corners[std::size_t(i)];
    wrench.head<3>() += f, wrench.tail<3>() += at.cross(f);
  }
  const Parameter load = p.parameters.find("left_ankle_roll_link load"),
                  height = p.parameters.find("left_ankle_roll_link height");
  const StageFunction holds = term("left_ankle_roll_link holds"), swing = term("left_ankle_roll_link swing");
  s.p[load.first()] = 0;
  EXPECT_LE((holds(s) - wrench / weight_of(task.scene)).norm(), 1e-12);
  EXPECT_GT(swing(s).norm(), 1);  // it is turned
  s.p[load.first()] = 1;
  EXPECT_LE(holds(s).norm(), 1e-12);  // at rest, not accelerated, wherever it stands
  EXPECT_EQ(swing(s).norm(), 0);
  s.a[3] = 1;  // the base turns, and the foot with it
  EXPECT_NEAR(holds(s).tail<3>().norm(), 1, 1e-9);

  s.x = p.start, s.p[load.first()] = 0;
  s.p[height.first()] = task.robot.contacts[0].place->z() + 0.05;
  const VectorXd below = swing(s);
  ASSERT_EQ(below.size(), 4);
  EXPECT_LE((below.array() + 0.05 * std::sqrt(1e4 / 4)).matrix().norm(), 1e-9);
}

// The robot is given the momentum, whatever the mass of the link that is hit.
TEST_F(WholeBody, ImpulsesGiveTheirMomentum) {
  const Task task = this->task();
  const Eigen::Vector3d impulse(0.5, -0.3, 0.2);
  const VectorXd q = task.problem.start.head(19);
  const VectorXd v = struck(task.scene, q, "base_link", impulse);
  auto plain = task.scene;
  plain.effects = {};  // reflected inertias carry momentum of their own
  const VectorXd of_links = struck(plain, q, "base_link", impulse);
  const double mass = weight_of(task.scene) / task.scene.model.gravity.norm();
  EXPECT_LE((centroidal_state(task.scene, q, of_links).segment<3>(3) - impulse / mass).norm(), 1e-9);
  EXPECT_GT(v.norm(), 0);
}

// 0.3 s of the loop on compliant feet, without compiled plans: pushed a little, it stays up; a fall is told.
TEST_F(WholeBody, StandsOnTheSimulatedFloorAndTellsAFall) {
  replace("intervals 25", "intervals 8");
  replace("duration  0.5", "duration  0.24");
  replace("duration   3", "duration   0.2");
  replace("at      0.5", "at      0.05");
  replace("\"3.119 0 0\"", "\"0.5 0 0\"");
  Task task = this->task();
  task.control.late = 1;
  const ControlReport stood = control_task(task);
  EXPECT_TRUE(stood.success()) << stood.text();
  const Trajectory& m = stood.loop.motion;
  EXPECT_NEAR(m.x(2, m.points() - 1), 0.24, 0.02);
  EXPECT_GT(m.x.row(19).maxCoeff(), 0.1);  // it was pushed
  task.control.fallen = 0.2399;
  const ControlReport fallen = control_task(task);
  EXPECT_FALSE(fallen.success());
  EXPECT_NE(fallen.loop.trouble.find("the robot fell: at "), std::string::npos) << fallen.loop.trouble;
}

// The loop has a point and no steps, so nothing lies between points.
TEST_F(WholeBody, AStopBeforeTheFirstPlanHasAReport) {
  std::stop_source stop;
  stop.request_stop();
  ControlReport report = control_task(task(), stop.get_token(), {});
  EXPECT_EQ(report.loop.motion.points(), 1);
  EXPECT_TRUE(report.loop.steps.empty());
  EXPECT_FALSE(report.text().empty());
}

TEST_F(WholeBody, SaysWhatIsWrongWithItsFile) {
  const auto refusal = [&](const std::string& old, const std::string& with) {
    load_control("solo12_whole_body");
    replace(old, with);
    return message_of<Error>([&] { task(); });
  };
  EXPECT_NE(refusal("solo12_compliant_floor.info", "pendulum.info").find("expected the same robot"),
            std::string::npos);
  EXPECT_NE(refusal("frame   base_link", "frame   base_lnk").find("base_link"), std::string::npos);
}

}  // namespace
}  // namespace dyntape::whole_body_test
