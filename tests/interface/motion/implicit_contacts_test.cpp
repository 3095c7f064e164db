// SPDX-License-Identifier: BSD-3-Clause
//
// Contact-implicit motions: against momentum, against the scheme's own time-stepping, written out once more, and against the simulation of
// the scene, which knows no optimal control.
#include <dyntape/interface/motion/implicit_contacts.h>

#include <gtest/gtest.h>

#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/solve/optimise.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/motion/robot_problem.h>
#include <dyntape/interface/run/mpc/mpc_task.h>
#include <dyntape/interface/run/solve/solve.h>
#include "dynamics/robot_files.h"
#include "interface/message_of.h"
#include "source_folder.h"

namespace dyntape::implicit_contacts_test {
namespace {

using Eigen::VectorXd;

Task shipped(const std::string& name) {
  Task task = read_task(test::source_folder() + "/config/tasks/" + name + ".info");
  task.optimise.mesh.evaluation.route = Route::kInterpreter;  // nothing is compiled
  return task;
}

// Row of a state or a control.
Eigen::Index row_of(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) - names.begin();
}

// No force where there is a gap, no gap below nothing, no force outside its cone.
void expect_laws(const Task& task, const SolveReport& report) {
  const Trajectory& motion = report.solution.motion;
  const auto& model = task.scene.model;
  const auto& rigid = task.scene.constraints.rigid;
  dynamics::Data<double> data(model);
  const double weight = weight_of(task.scene);
  for (int k = 1; k < motion.points(); ++k) {
    const VectorXd q = motion.x.col(k).head(model.nq), v = motion.x.col(k).tail(model.nv);
    const auto rows = dynamics::unilateral_rows<double>(model, data, rigid, q);
    const VectorXd f = motion.u.col(k).tail(rows.J.rows()), velocity = rows.J * v;
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < rigid.contacts.size(); ++i) {
      const double mu = rigid.contacts[i].friction, gap = rows.gap[Eigen::Index(i)];
      EXPECT_GE(gap, -1e-7);
      EXPECT_GE(f[row], -1e-6 * weight);
      EXPECT_LE(f[row] * gap / weight, report.meshes.back().relaxation + 1e-7);
      if (mu > 0) {
        EXPECT_LE(f.segment(row + 1, 2).norm(), mu * f[row] + 1e-5 * weight);
        EXPECT_LE(f.segment(row + 1, 2).dot(velocity.segment(row + 1, 2)), 1e-6 * weight);  // brakes
      }
      row += mu > 0 ? 3 : 1;
    }
  }
}

TEST(ImplicitContacts, FingerGivesTheBlockItsMomentum) {
  const Task task = shipped("finger_pushes_block");
  const SolveReport report = solve_task(task);
  ASSERT_TRUE(report.success()) << report.verdict();
  const Trajectory& motion = report.solution.motion;
  EXPECT_NEAR(report.solution.cost(), 6.25, 1e-4);
  const Eigen::Index force = row_of(task.problem.controls, "f.finger.n");
  expect_laws(task, report);
  int hit = 1;
  while (hit < motion.points() && motion.u(force, hit) < 1) ++hit;
  EXPECT_NEAR(motion.t[hit], std::sqrt(0.06), 2 * motion.t[1]);
  const Eigen::Index block = row_of(task.problem.states, "q.slide");
  EXPECT_NEAR(motion.x(block, motion.points() - 1), 0.47, 0.02);
  ASSERT_TRUE(report.simulated);
  EXPECT_LT(report.simulated->error, 0.03);
  EXPECT_LT(report.simulated->from_afar, 0.01);
}

// The same forces with the block half a metre away: all of them act from a distance.
TEST(ImplicitContacts, APushFromADistanceIsTold) {
  const Task task = shipped("finger_pushes_block");
  SolveReport report = solve_task(task);
  ASSERT_TRUE(report.success()) << report.verdict();
  Trajectory motion = report.solution.motion;
  const double relaxation = report.meshes.back().relaxation;
  EXPECT_LT(simulate_contacts(task, motion, relaxation).from_afar, 0.01);
  motion.x.row(row_of(task.problem.states, "q.slide")).array() += 0.5;
  report.simulated = simulate_contacts(task, motion, relaxation);
  EXPECT_EQ(report.simulated->from_afar, 1);
  report.simulated->error = 0;  // as if nothing were off
  EXPECT_FALSE(report.success());
}

// A finger at 1 m/s against the block, no costs: both go on with 0.2 m/s.  With a relaxation that stayed, finer meshes were farther off.
TEST(ImplicitContacts, FinerMeshesLandNearerToTheTruth) {
  Task task = shipped("finger_pushes_block");
  task.problem.terms.erase(std::remove_if(task.problem.terms.begin(), task.problem.terms.end(),
                                          [](const Term& t) { return t.name == "speed"; }),
                           task.problem.terms.end());
  task.problem.start[2] = 1;
  task.problem.u.lower[0] = task.problem.u.upper[0] = 0;
  task.expected.reset();
  std::vector<double> errors;
  for (const int refinements : {0, 1, 2}) {
    task.demands.refinements = refinements, task.demands.simulation = 1e-6;
    errors.push_back(solve_task(task).simulated->error);
  }
  EXPECT_LT(errors[1], 0.7 * errors[0]);
  EXPECT_LT(errors[2], 0.7 * errors[1]);
}

TEST(ImplicitContacts, NoControllerTakesItsForcesForMotors) {
  EXPECT_NE(message_of<ArgumentError>([] {
              control_task(shipped("finger_pushes_block"), {}, {});
            }).find("has rigid contacts"),
            std::string::npos);
}

// Nothing is to be chosen here: each step is one of the implicit Euler scheme with Coulomb's friction,
//   v+ = v - mu g h while it slides, and it stands still afterwards.
TEST(ImplicitContacts, BoxSlidesToRest) {
  RobotScene scene{dynamics::load_urdf(dynamics::robot_file("box"), {.base = dynamics::Base::kFloating})};
  constexpr double kMu = 0.4, kSpeed = 1, kGravity = 9.81;
  for (int corner = 1; corner <= 4; ++corner) {
    dynamics::RigidContact contact;
    contact.friction = kMu;
    dynamics::place_at_frame(scene.model, "corner_" + std::to_string(corner), contact);
    contact.name = "corner_" + std::to_string(corner);
    scene.constraints.rigid.contacts.push_back(contact);
  }
  Problem problem = robot_problem(scene, {.duration = 0.5, .form = DynamicsForm::kInverse});
  problem.add(squared_controls(1e-3));  // of forces that are not unique
  VectorXd q = dynamics::neutral<double>(scene.model), v = VectorXd::Zero(6);
  q[2] = 0.05, v[0] = kSpeed;
  start_at(problem, scene, q, v);
  problem.goal.setConstant(Problem::kFree);
  StagedNlp nlp = discretize(
      problem, {.scheme = radau(1), .intervals = 25, .evaluation = {.route = Route::kInterpreter}});
  std::vector<double> from = nlp.start();
  Solution s;
  OptimiseOptions options;
  options.solver.method = NlpMethod::kRiccati;
  // A corner that carries a quarter of the weight may hover by four times the relaxation, and the box gain or lose the speed of that.
  constexpr double kRelaxation = 1e-6, kHover = 4 * kRelaxation;
  for (const Parameters& now : contact_continuation(problem, {.last = {kRelaxation, 1e-3}, .solves = 6})) {
    nlp.set_parameters(now);
    s = optimise(nlp, from, options);
    ASSERT_TRUE(s.converged()) << describe(s.nlp.status);
    from = s.nlp.x;
  }
  double speed = kSpeed, place = 0;
  for (int k = 1; k < s.motion.points(); ++k) {
    const double h = s.motion.t[k] - s.motion.t[k - 1];
    speed = std::max(0.0, speed - kMu * kGravity * h), place += h * speed;
    EXPECT_NEAR(s.motion.x(7, k), speed, 2e-3) << k;
    EXPECT_NEAR(s.motion.x(0, k), place, 1e-3) << k;
    EXPECT_NEAR(s.motion.x(2, k), 0.05, 1.1 * kHover) << k;
  }
}

TEST(ImplicitContacts, HopperLeavesTheFloorAndLands) {
  const Task task = shipped("hopper_jumps");
  const SolveReport report = solve_task(task);
  ASSERT_TRUE(report.success()) << report.verdict();
  expect_laws(task, report);
  const Eigen::Index force = row_of(task.problem.controls, "f.foot.n");
  const VectorXd f = report.solution.motion.u.row(force);
  EXPECT_GT(f[1], 1) << "stands at first";
  EXPECT_LT(f[f.size() / 2], 0.1) << "flies at the apex";
  EXPECT_GT(f[f.size() - 1], 1) << "stands at last";
}

}  // namespace
}  // namespace dyntape::implicit_contacts_test
