// SPDX-License-Identifier: BSD-3-Clause
//
// An arm of seven joints reaches by differential dynamic programming; its gradient against differences of roll-outs.
#include <gtest/gtest.h>

#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/sensitivity/rollout.h>
#include <dyntape/interface/control/solve/ddp.h>
#include <dyntape/interface/motion/robot_problem.h>
#include <dyntape/interface/motion/robot_terms.h>

#include "interface/control/ocp_problems.h"
#include "source_folder.h"

namespace dyntape::ddp_arm_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Held against its weight at the start, drawn to a place 0.15 m away.
Problem reaching() {
  const RobotScene scene{dynamics::load_urdf(test::source_folder() + "/config/robots/iiwa14.urdf"), {}, {}};
  const auto& model = scene.model;
  VectorXd q(7);
  q << 0.2, 0.5, -0.1, -1.2, 0.3, 0.8, 0;
  dynamics::Data<double> data(model);
  const VectorXd rest = VectorXd::Zero(7), hold = dynamics::nonlinear_effects<double>(model, data, q, rest);
  const std::string frame = model.frames.back().name;
  Problem p = robot_problem(scene, {.duration = 0.5});
  p.add(running_squares("effort", [hold](const auto& s) {
    using T = typename std::decay_t<decltype(s.u)>::Scalar;
    return (0.1 * (s.u - hold.template cast<T>())).eval();
  }));
  const VectorXd at = frame_position(scene, frame, Eigen::Vector3d::Zero())(
      Stage<double>{0, (VectorXd(14) << q, rest).finished(), {}, hold});
  p.add(terminal_squares(
      "reach",
      weighted(frame_position(scene, frame, Eigen::Vector3d(at) + Eigen::Vector3d(-0.05, 0.1, -0.1)), 1e3)));
  p.add(running_squares("calm", [](const auto& s) { return s.x.tail(7).eval(); }));
  p.start << q, rest;
  p.guess = [q, rest, hold](double t) {
    return Stage<double>{t, (VectorXd(14) << q, rest).finished(), {}, hold};
  };
  return p;
}

TEST(DdpArm, BothHessiansReachTheSameOptimum) {
  const Problem p = reaching();
  DdpOptions options{.intervals = 20, .evaluation = test::kInterpreted, .verify = false};
  const DdpSolution exact = solve_with_ddp(p, options);
  options.hessian = DdpHessian::kGaussNewton;
  const DdpSolution newton = solve_with_ddp(p, options);
  ASSERT_TRUE(exact.success()) << to_string(exact.status);
  EXPECT_TRUE(newton.success() || newton.status == SolveStatus::kAcceptable) << to_string(newton.status);
  EXPECT_NEAR(newton.cost, exact.cost, 1e-7 * exact.cost);
  EXPECT_LE(exact.iterations.size(), newton.iterations.size());
  std::printf("iterations: exact %zu, Gauss-Newton %zu\n", exact.iterations.size(), newton.iterations.size());
}

// By central differences of the cost of roll-outs, at controls that are no optimum.
TEST(DdpArm, GradientsAreThoseOfDifferences) {
  const Problem p = reaching();
  const int n = 10;
  RolloutAdjoint adjoint(p, {.intervals = n, .evaluation = test::kInterpreted});
  MatrixXd u(7, n);
  for (int k = 0; k < n; ++k) u.col(k) = p.guess(0).u + VectorXd::Constant(7, 0.3 * std::sin(k));
  const RolloutGradient g = adjoint.discrete(u);
  const double h = 1e-4;
  for (const auto& [row, column] : {std::pair{0, 0}, {3, 4}, {6, 9}, {1, 5}}) {
    MatrixXd up = u, down = u;
    up(row, column) += h, down(row, column) -= h;
    const double difference = (adjoint.discrete(up).cost - adjoint.discrete(down).cost) / (2 * h);
    EXPECT_NEAR(g.controls(row, column), difference, 1e-7 * g.controls.cwiseAbs().maxCoeff());
  }
}

}  // namespace
}  // namespace dyntape::ddp_arm_test
