// SPDX-License-Identifier: BSD-3-Clause
#include <SuiteSparseQR.hpp>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/identification/staircase.h>

namespace dyntape::detail {
namespace {

using Eigen::MatrixXd;
using SparseIndex = SuiteSparse_long;

// SPQR's workspace; what it gives is freed with it.
class Session {
 public:
  Session() { cholmod_l_start(&common); }
  ~Session() { cholmod_l_finish(&common); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  cholmod_common common;
};

}  // namespace

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
  SparseIndex* order = nullptr;
  if (sparse) SuiteSparseQR<double>(SPQR_ORDERING_FIXED, tolerance, A.cols(), sparse, &R, &order, cc);
  cholmod_l_free_sparse(&sparse, cc);
  if (!R) throw ToolError("base parameters: SuiteSparseQR failed with status " + std::to_string(cc->status));
  MatrixXd dense = MatrixXd::Zero(A.cols(), A.cols());
  const auto *start = static_cast<const SparseIndex*>(R->p), *row = static_cast<const SparseIndex*>(R->i);
  const auto* value = static_cast<const double*>(R->x);
  for (SparseIndex j = 0; j < A.cols(); ++j) {
    for (SparseIndex k = start[j]; k < start[j + 1]; ++k) dense(row[k], j) = value[k];
  }
  cholmod_l_free_sparse(&R, cc);
  if (order) cholmod_l_free(view.ncol, sizeof(SparseIndex), order, cc);
  return dense;
}

}  // namespace dyntape::detail
