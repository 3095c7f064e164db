// SPDX-License-Identifier: BSD-3-Clause
//
// Your own cost: keep the hand of an arm on a moving target.  One residual gives the value, the Gauss-Newton model
// and the exact Hessian.
//
//   x = q (6) joint angles (rad);  p = (target (3), m;  weight (1), 1/m)   changes between calls
//   y = weight (hand(q) - target)                                         cost = 1/2 |y|^2
#include <cstdio>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/ocs2/ad_function.h>

using namespace dyntape;

int main(int argc, char** argv) {
  const auto arm = dynamics::load_urdf(argc > 1 ? argv[1] : "config/robots/ur5.urdf");
  const auto taped = arm.cast<AD>();  // the same robot, its constants on the tape
  const int hand = arm.frame_index("tool0");

  const auto hand_position = [&](const ad_vector_t& q) -> Eigen::Matrix<AD, 3, 1> {
    dynamics::Data<AD> data(taped);
    dynamics::forward_kinematics<AD>(taped, data, q);
    return dynamics::frame_placement(taped, data, hand).p;
  };

  // The residual, for Gauss-Newton: needs first derivatives only.
  AdFunction residual([&](const ad_vector_t& q, const ad_vector_t& p,
                          ad_vector_t& y) { y = p[3] * (hand_position(q) - p.head(3)); },
                      6, 4, "hand-tracking-residual");
  residual.createModels(AdFunction::ApproximationOrder::First, false);

  // The cost itself, for its exact Hessian.
  AdFunction cost(
      [&](const ad_vector_t& q, const ad_vector_t& p, ad_vector_t& y) {
        y.resize(1);
        y[0] = 0.5 * p[3] * p[3] * (hand_position(q) - p.head(3)).squaredNorm();
      },
      6, 4, "hand-tracking-cost");
  cost.createModels(AdFunction::ApproximationOrder::Second, false);

  // Newton's method with Gauss-Newton steps to a reachable target: the position at another configuration.
  vector_t q = (vector_t(6) << 0.3, -1.2, 1.4, -0.6, 0.9, 0.2).finished(), p(4);
  const vector_t there = (vector_t(6) << 0.5, -1.0, 1.2, -0.5, 1.1, 0.0).finished();
  p << 0, 0, 0, 1;
  p.head(3) = residual.getFunctionValue(there, p);  // with target zero the residual is the position
  p[3] = 10;
  const auto approximation = residual.getGaussNewtonApproximation(q, p);
  const matrix_t exact = cost.getHessian(0, q, p);
  std::printf("at the start: cost %.6f, Gauss-Newton and exact Hessian differ by %.3f of %.3f\n",
              approximation.f, (approximation.dfdxx - exact).norm(), exact.norm());
  const bool same_slope = approximation.dfdx.isApprox(cost.getJacobian(q, p).transpose(), 1e-12);

  double left = approximation.f;
  for (int i = 0; i < 8 && left > 1e-20; ++i) {
    const auto model = residual.getGaussNewtonApproximation(q, p);
    const matrix_t damped = model.dfdxx + 1e-9 * matrix_t::Identity(6, 6);  // six joints, three conditions
    q -= damped.ldlt().solve(model.dfdx);
    left = 0.5 * residual.getFunctionValue(q, p).squaredNorm();
    std::printf("step %d: cost %.3e\n", i + 1, left);
  }

  // At the target the residual is zero, so the Gauss-Newton Hessian is exact.
  const auto end = residual.getGaussNewtonApproximation(q, p);
  const bool exact_at_end = end.dfdxx.isApprox(cost.getHessian(0, q, p), 1e-6);
  std::printf("%s\n", same_slope && left < 1e-16 && exact_at_end ? "on target" : "NOT on target");
  return same_slope && left < 1e-16 && exact_at_end ? 0 : 1;
}
