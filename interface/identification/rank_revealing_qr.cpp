// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/identification/rank_revealing_qr.h>

#include <SuiteSparseQR.hpp>
#include <algorithm>
#include <limits>

#include <dyntape/autodiff/error.h>

namespace dyntape {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Index = SuiteSparse_long;

// SPQR's workspace; what it gives is freed with it.
class Session {
 public:
  Session() { cholmod_l_start(&common); }
  ~Session() { cholmod_l_finish(&common); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  cholmod_common common;
};

// R of A = Q R with no exchange of columns: a staircase, in which a dependent column starts no step.
MatrixXd staircase(const MatrixXd& A, double tolerance) {
  Session session;
  cholmod_common* cc = &session.common;
  cholmod_dense view{};
  view.nrow = static_cast<size_t>(A.rows());
  view.ncol = static_cast<size_t>(A.cols());
  view.nzmax = static_cast<size_t>(A.size());
  view.d = view.nrow;
  view.x = const_cast<double*>(A.data());
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  cholmod_sparse* sparse = cholmod_l_dense_to_sparse(&view, 1, cc);
  cholmod_sparse* R = nullptr;
  Index* order = nullptr;
  if (sparse) SuiteSparseQR<double>(SPQR_ORDERING_FIXED, tolerance, A.cols(), sparse, &R, &order, cc);
  cholmod_l_free_sparse(&sparse, cc);
  if (!R) throw ToolError("base parameters: SuiteSparseQR failed with status " + std::to_string(cc->status));
  MatrixXd dense = MatrixXd::Zero(A.cols(), A.cols());
  const auto *start = static_cast<const Index*>(R->p), *row = static_cast<const Index*>(R->i);
  const auto* value = static_cast<const double*>(R->x);
  for (Index j = 0; j < A.cols(); ++j) {
    for (Index k = start[j]; k < start[j + 1]; ++k) dense(row[k], j) = value[k];
  }
  cholmod_l_free_sparse(&R, cc);
  if (order) cholmod_l_free(view.ncol, sizeof(Index), order, cc);
  return dense;
}

}  // namespace

ColumnSpace column_space(const MatrixXd& A, double tolerance) {
  if (!A.allFinite()) throw ArgumentError("column_space: an entry of the matrix is not finite");
  const Eigen::Index n = A.cols();
  VectorXd length = A.colwise().norm();
  // What is zero by structure may carry rounding, which unit length would turn into a direction.
  const double longest = n ? length.maxCoeff() : 0;
  for (double& x : length) x = x > 1e-13 * longest ? x : 0;
  const MatrixXd scaled = A * length.unaryExpr([](double x) { return x > 0 ? 1 / x : 0; }).asDiagonal();
  const MatrixXd R = staircase(scaled, tolerance);

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
