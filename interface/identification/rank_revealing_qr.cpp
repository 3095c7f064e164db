// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/identification/rank_revealing_qr.h>

#include <algorithm>
#include <limits>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/identification/staircase.h>

namespace dyntape {

using Eigen::MatrixXd;
using Eigen::VectorXd;

ColumnSpace column_space(const MatrixXd& A, double tolerance) {
  if (!A.allFinite()) throw ArgumentError("column_space: an entry of the matrix is not finite");
  const Eigen::Index n = A.cols();
  VectorXd length = A.colwise().norm();
  // What is zero by structure may carry rounding, which unit length would turn into a direction.
  const double longest = n ? length.maxCoeff() : 0;
  for (double& x : length) x = x > 1e-13 * longest ? x : 0;
  const MatrixXd scaled = A * length.unaryExpr([](double x) { return x > 0 ? 1 / x : 0; }).asDiagonal();
  const MatrixXd R = detail::staircase(scaled, tolerance);

  ColumnSpace space;
  space.least_kept = std::numeric_limits<double>::infinity();
  for (Eigen::Index j = 0; j < n; ++j) {
    const Eigen::Index step = space.rank();
    const double left = R.col(j).tail(n - step).norm();
    if (left > 0) {
      space.independent.push_back(static_cast<int>(j));
      space.least_kept = std::min(space.least_kept, left);
    } else {
      space.dependent.push_back(static_cast<int>(j));
    }
  }
  const Eigen::Index rank = space.rank();
  const MatrixXd R1 = R(Eigen::seqN(0, rank), space.independent),
                 R2 = R(Eigen::seqN(0, rank), space.dependent);
  space.combination = R1.triangularView<Eigen::Upper>().solve(R2);
  if (!space.dependent.empty()) {
    const MatrixXd left =
        scaled(Eigen::all, space.dependent) - scaled(Eigen::all, space.independent) * space.combination;
    space.most_dropped = left.colwise().norm().maxCoeff();
  }
  // Back from unit lengths; a column of zeros combines nothing.
  for (Eigen::Index i = 0; i < rank; ++i) {
    for (Eigen::Index j = 0; j < space.combination.cols(); ++j) {
      space.combination(i, j) *=
          length[space.dependent[static_cast<size_t>(j)]] / length[space.independent[static_cast<size_t>(i)]];
    }
  }
  return space;
}

}  // namespace dyntape
