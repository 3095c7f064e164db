// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/identification/staircase.h>

#include <Eigen/Householder>
#include <algorithm>

namespace dyntape::detail {

Eigen::MatrixXd staircase_by_reflections(Eigen::MatrixXd A, double tolerance) {
  const Eigen::Index m = A.rows(), n = A.cols();
  Eigen::VectorXd work(n);
  Eigen::Index step = 0;
  for (Eigen::Index j = 0; j < n && step < m; ++j) {
    auto below = A.col(j).tail(m - step);
    const bool is_dependent = below.norm() <= tolerance;
    if (!is_dependent) {
      Eigen::VectorXd essential(m - step - 1);
      double tau = 0, beta = 0;
      below.makeHouseholder(essential, tau, beta);
      A.bottomRightCorner(m - step, n - j - 1).applyHouseholderOnTheLeft(essential, tau, work.data());
      below.setZero();
      below[0] = beta;
      ++step;
    } else {
      below.setZero();
    }
  }
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(n, n);
  R.topRows(std::min(m, n)) = A.topRows(std::min(m, n));
  return R;
}

}  // namespace dyntape::detail
