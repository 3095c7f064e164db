// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/matrices/matrix_callees.h>
#include <dyntape/autodiff/record/detail/pivoted_lu.h>
#include <dyntape/autodiff/record/detail/recorded_matrices.h>

namespace dyntape::detail {
namespace {

MatrixXad solution_of_transposed(const MatrixXad& A, const MatrixXad& B);  // A^T X = B

}  // namespace

MatrixXad solution(const MatrixXad& A, const MatrixXad& B) {
  const Eigen::Index n = A.rows(), k = B.cols();
  if (B.size() == 0) return B;
  const MatrixFunction f{sized_name("solve", n, n, k),
                         n * n + n * k,
                         n * k,
                         [=](FlatReader in) {
                           const auto lu = pivoted_lu(in.next(n, n));
                           MatrixXad X = in.next(n, k);
                           solve_in_place(lu, X);
                           return flat({X});
                         },
                         [=](FlatReader in) {
                           const MatrixXad a = in.next(n, n), X = solution(a, in.next(n, k)),
                                           da = in.next(n, n);
                           return flat({solution(a, in.next(n, k) - da * X)});
                         },
                         [=](FlatReader in) {
                           const MatrixXad a = in.next(n, n), X = solution(a, in.next(n, k));
                           const MatrixXad L = solution_of_transposed(a, in.next(n, k));
                           return flat({-L * X.transpose(), L});
                         }};
  return call(callee_of(f), flat({A, B})).reshaped(n, k);
}

namespace {

MatrixXad solution_of_transposed(const MatrixXad& A, const MatrixXad& B) {
  const Eigen::Index n = A.rows(), k = B.cols();
  if (B.size() == 0) return B;
  const MatrixFunction f{sized_name("solve_transposed", n, n, k),
                         n * n + n * k,
                         n * k,
                         [=](FlatReader in) {
                           const auto lu = pivoted_lu(in.next(n, n));
                           MatrixXad X = in.next(n, k);
                           solve_transposed_in_place(lu, X);
                           return flat({X});
                         },
                         [=](FlatReader in) {
                           const MatrixXad a = in.next(n, n), X = solution_of_transposed(a, in.next(n, k)),
                                           da = in.next(n, n);
                           return flat({solution_of_transposed(a, in.next(n, k) - da.transpose() * X)});
                         },
                         [=](FlatReader in) {
                           const MatrixXad a = in.next(n, n), X = solution_of_transposed(a, in.next(n, k));
                           const MatrixXad L = solution(a, in.next(n, k));
                           return flat({-X * L.transpose(), L});
                         }};
  return call(callee_of(f), flat({A, B})).reshaped(n, k);
}

}  // namespace

MatrixXad inverse_of(const MatrixXad& A) {
  const Eigen::Index n = A.rows();
  if (n == 0) return A;
  const MatrixFunction f{sized_name("inverse", n, n, n),
                         n * n,
                         n * n,
                         [=](FlatReader in) {
                           const auto lu = pivoted_lu(in.next(n, n));
                           MatrixXad X = MatrixXad::Identity(n, n);
                           solve_in_place(lu, X);
                           return flat({X});
                         },
                         [=](FlatReader in) {
                           const MatrixXad X = inverse_of(in.next(n, n));
                           return flat({-X * in.next(n, n) * X});
                         },
                         [=](FlatReader in) {
                           const MatrixXad X = inverse_of(in.next(n, n)).transpose();
                           return flat({-X * in.next(n, n) * X});
                         }};
  return call(callee_of(f), flat({A})).reshaped(n, n);
}

AD determinant_by_pivots(const MatrixXad& A) {
  const Eigen::Index n = A.rows();
  const MatrixFunction f{
      sized_name("determinant", n, n, 1),
      n * n,
      1,
      [=](FlatReader in) { return VectorXad::Constant(1, determinant_of<AD>(in.next(n, n))); },
      [=](FlatReader in) {
        const MatrixXad a = in.next(n, n), X = inverse_of(a).transpose();
        const AD trace = X.cwiseProduct(in.next(n, n)).sum();
        return VectorXad::Constant(1, determinant_by_pivots(a) * trace);
      },
      [=](FlatReader in) {
        const MatrixXad a = in.next(n, n), X = inverse_of(a).transpose();
        return flat({in.next(1, 1)(0, 0) * determinant_by_pivots(a) * X});
      }};
  return call(callee_of(f), flat({A}))[0];
}

}  // namespace dyntape::detail
