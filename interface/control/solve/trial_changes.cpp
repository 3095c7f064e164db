// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/trial_changes.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dyntape {

std::vector<TrialChange> falling_changes(const Problem& problem, ShootingSteps& steps, EndCost& end,
                                         const Eigen::VectorXd& parameters_at_end, const Eigen::MatrixXd& u,
                                         double cost) {
  constexpr int kShapes = 4;
  constexpr double kLength = 1e-2, kRounding = 1e-10;
  const Eigen::Index N = u.cols(), m = u.rows(), count = 2 * kShapes * m;
  const auto shape = [N](Eigen::Index trial, Eigen::Index k) {
    return std::sin(std::numbers::pi * double(trial % kShapes + 1) * (double(k) + 0.5) / double(N));
  };
  const Eigen::VectorXd sizes = kLength * u.cwiseAbs().rowwise().maxCoeff().cwiseMax(1.0);
  // Columns: up, then down, of each shape of each control.
  Eigen::MatrixXd x = problem.start.replicate(1, count);
  Eigen::VectorXd costs = steps.run_side_by_side(x, [&](int k, Eigen::MatrixXd& changed) {
    changed = u.col(k).replicate(1, count);
    for (Eigen::Index trial = 0; trial < kShapes * m; ++trial) {
      const double by = sizes[trial / kShapes] * shape(trial, k);
      changed(trial / kShapes, 2 * trial) += by, changed(trial / kShapes, 2 * trial + 1) -= by;
    }
    for (auto one : changed.colwise()) one = one.cwiseMax(problem.u.lower).cwiseMin(problem.u.upper);
  });
  for (Eigen::Index i = 0; i < count; ++i) costs[i] += end.value(x.col(i), parameters_at_end);
  std::vector<TrialChange> falling;
  for (Eigen::Index trial = 0; trial < kShapes * m; ++trial) {
    const double up = costs[2 * trial], down = costs[2 * trial + 1];
    if (!std::isfinite(up + down) || !(up + down - 2 * cost < -kRounding * (1 + std::abs(cost)))) continue;
    const Eigen::Index control = trial / kShapes;
    falling.push_back({int(control), Eigen::VectorXd(N), up < down ? sizes[control] : -sizes[control]});
    for (Eigen::Index k = 0; k < N; ++k) falling.back().shape[k] = shape(trial, k);
  }
  return falling;
}

}  // namespace dyntape
