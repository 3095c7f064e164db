// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/matrices/matrix_callees.h>
#include <dyntape/autodiff/record/detail/householder.h>
#include <dyntape/autodiff/record/detail/recorded_matrices.h>

namespace dyntape::detail {
namespace {

MatrixXad normal_equations_solution(const MatrixXad& A, const MatrixXad& V);  // A^T A Y = V

}  // namespace

MatrixXad least_squares_solution(const MatrixXad& A, const MatrixXad& B) {
  const Eigen::Index m = A.rows(), n = A.cols(), k = B.cols();
  if (n * k == 0) return MatrixXad(n, k);
  const MatrixFunction f{
      sized_name("least_squares", m, n, k),
      m * (n + k),
      n * k,
      [=](FlatReader in) {
        const auto qr = householder(in.next(m, n));
        return flat({least_squares_of(qr, in.next(m, k))});
      },
      [=](FlatReader in) {
        const MatrixXad a = in.next(m, n), b = in.next(m, k), X = least_squares_solution(a, b),
                        da = in.next(m, n), R = b - a * X;
        return flat({least_squares_solution(a, in.next(m, k) - da * X) +
                     normal_equations_solution(a, da.transpose() * R)});
      },
      [=](FlatReader in) {
        const MatrixXad a = in.next(m, n), b = in.next(m, k), X = least_squares_solution(a, b), R = b - a * X;
        const MatrixXad L = normal_equations_solution(a, in.next(n, k)), AL = a * L;
        return flat({R * L.transpose() - AL * X.transpose(), AL});
      }};
  return call(callee_of(f), flat({A, B})).reshaped(n, k);
}

namespace {

MatrixXad normal_equations_solution(const MatrixXad& A, const MatrixXad& V) {
  const Eigen::Index m = A.rows(), n = A.cols(), k = V.cols();
  if (n * k == 0) return V;
  const MatrixFunction f{sized_name("normal_equations", m, n, k),
                         (m + k) * n,
                         n * k,
                         [=](FlatReader in) {
                           const auto qr = householder(in.next(m, n));
                           return flat({normal_equations_of(qr, in.next(n, k))});
                         },
                         [=](FlatReader in) {
                           const MatrixXad a = in.next(m, n), Y = normal_equations_solution(a, in.next(n, k)),
                                           da = in.next(m, n);
                           const MatrixXad moved = da.transpose() * (a * Y) + a.transpose() * (da * Y);
                           return flat({normal_equations_solution(a, in.next(n, k) - moved)});
                         },
                         [=](FlatReader in) {
                           const MatrixXad a = in.next(m, n), Y = normal_equations_solution(a, in.next(n, k));
                           const MatrixXad L = normal_equations_solution(a, in.next(n, k));
                           return flat({-(a * Y) * L.transpose() - (a * L) * Y.transpose(), L});
                         }};
  return call(callee_of(f), flat({A, V})).reshaped(n, k);
}

}  // namespace

}  // namespace dyntape::detail
