// SPDX-License-Identifier: BSD-3-Clause
//
// Your own constraint: the elbow and the hand of an arm stay clear of a sphere that may move.
//
//   x = q (6) joint angles (rad);  p = (centre (3), radius (1)), m
//   y_i = |point_i(q) - centre|^2 - radius^2 >= 0, one for each point (m^2)
//
// The squared distance is smooth everywhere, also at the centre, where the distance is not.
#include <cmath>
#include <cstdio>
#include <vector>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/ocs2/ad_function.h>

using namespace dyntape;

int main(int argc, char** argv) {
  const auto arm = dynamics::load_urdf(argc > 1 ? argv[1] : "config/robots/ur5.urdf");
  const auto taped = arm.cast<AD>();
  const std::vector<int> points = {arm.frame_index("forearm_link"), arm.frame_index("tool0")};

  AdFunction clearance(
      [&](const ad_vector_t& q, const ad_vector_t& p, ad_vector_t& y) {
        dynamics::Data<AD> data(taped);
        dynamics::forward_kinematics<AD>(taped, data, q);  // once, for both points
        y.resize(static_cast<Eigen::Index>(points.size()));
        for (std::size_t i = 0; i < points.size(); ++i) {
          const auto position = dynamics::frame_placement(taped, data, points[i]).p;
          y[static_cast<Eigen::Index>(i)] = (position - p.head(3)).squaredNorm() - p[3] * p[3];
        }
      },
      6, 4, "obstacle-clearance");
  clearance.createModels(AdFunction::ApproximationOrder::Second, false);

  const vector_t q = (vector_t(6) << 0.3, -1.2, 1.4, -0.6, 0.9, 0.2).finished();
  const vector_t p = (vector_t(4) << 0.3, 0.2, 0.5, 0.1).finished();
  const vector_t y = clearance.getFunctionValue(q, p);
  std::printf("clearance of elbow %.4f m^2, of hand %.4f m^2\n", y[0], y[1]);

  // Sparse: the elbow does not depend on the joints after it.
  const Pattern& pattern = clearance.jacobianPattern();
  std::printf("%zu of %zu derivatives can be non-zero\n", pattern.nnz(), pattern.rows * pattern.cols);

  // All values for an optimiser in one call, into its own memory: values, Jacobian, and the Hessian of the
  // constraints weighted with its multipliers.
  const std::vector<double> multipliers = {0.5, 2.0};
  std::vector<double> values(2), jacobian(pattern.nnz()), hessian(clearance.hessianPattern().nnz());
  clearance.evaluate(q.data(), p.data(), values.data(), jacobian.data(), multipliers.data(), hessian.data());

  // The obstacle is a parameter: it moves without another recording, and derivatives with respect to it exist.
  const matrix_t by_obstacle = clearance.getParameterJacobian(q, p);

  // Check against central differences.
  const double h = 1e-6;
  double worst = 0;
  for (Eigen::Index j = 0; j < 6; ++j) {
    const vector_t d = h * vector_t::Unit(6, j);
    const vector_t slope =
        (clearance.getFunctionValue(q + d, p) - clearance.getFunctionValue(q - d, p)) / (2 * h);
    for (std::size_t k = 0; k < pattern.nnz(); ++k) {
      if (pattern.col[k] == j) worst = std::max(worst, std::abs(jacobian[k] - slope[pattern.row[k]]));
    }
  }
  for (Eigen::Index j = 0; j < 4; ++j) {
    const vector_t d = h * vector_t::Unit(4, j);
    const vector_t slope =
        (clearance.getFunctionValue(q, p + d) - clearance.getFunctionValue(q, p - d)) / (2 * h);
    worst = std::max(worst, (by_obstacle.col(j) - slope).cwiseAbs().maxCoeff());
  }
  std::printf("largest difference to central differences: %.1e\n", worst);
  return worst < 1e-9 && pattern.nnz() < 12 && values[1] == y[1] ? 0 : 1;
}
