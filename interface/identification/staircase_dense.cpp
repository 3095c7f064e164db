// SPDX-License-Identifier: BSD-3-Clause
//
// staircase() where SuiteSparse is not used: DYNTAPE_SUITESPARSE=OFF, and always in the Python module.
#include <dyntape/interface/identification/staircase.h>

namespace dyntape::detail {

Eigen::MatrixXd staircase(const Eigen::MatrixXd& A, double tolerance) {
  return staircase_by_reflections(A, tolerance);
}

}  // namespace dyntape::detail
