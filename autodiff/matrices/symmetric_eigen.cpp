// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/matrices/symmetric_eigen.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/matrices/matrix_callees.h>

// The loop is written once, as C that is C++: compiled here, and as the text of the kernel.  It reads in[] and writes
// out[]; the vector of column p begins at v[p * n].
#define DYNTAPE_JACOBI                                                                                   \
  double* const v = out + n;                                                                             \
  double* const a = v + n * n;                                                                           \
  int sweep, turned = 1, p, q, k;                                                                        \
  for (p = 0; p < n; ++p) {                                                                              \
    for (q = 0; q <= p; ++q) {                                                                           \
      a[p * n + q] = a[q * n + p] = in[p * (p + 1) / 2 + q];                                             \
      v[p * n + q] = v[q * n + p] = p == q ? 1.0 : 0.0;                                                  \
    }                                                                                                    \
  }                                                                                                      \
  for (sweep = 0; sweep < 60 && turned; ++sweep) {                                                       \
    turned = 0;                                                                                          \
    for (p = 0; p < n; ++p) {                                                                            \
      for (q = p + 1; q < n; ++q) {                                                                      \
        const double app = a[p * n + p], aqq = a[q * n + q], apq = a[p * n + q], more = 100 * fabs(apq); \
        const double theta = (aqq - app) / (2 * apq);                                                    \
        const double size = 1 / (fabs(theta) + sqrt(1 + theta * theta)), t = theta < 0 ? -size : size;   \
        const double c = 1 / sqrt(1 + t * t), s = t * c;                                                 \
        if (fabs(app) + more == fabs(app) && fabs(aqq) + more == fabs(aqq)) {                            \
          a[p * n + q] = a[q * n + p] = 0;                                                               \
        }                                                                                                \
        if (a[p * n + q] == 0) continue;                                                                 \
        turned = 1;                                                                                      \
        for (k = 0; k < n; ++k) {                                                                        \
          const double x = a[p * n + k], y = a[q * n + k], f = v[p * n + k], g = v[q * n + k];           \
          a[p * n + k] = a[k * n + p] = c * x - s * y;                                                   \
          a[q * n + k] = a[k * n + q] = s * x + c * y;                                                   \
          v[p * n + k] = c * f - s * g;                                                                  \
          v[q * n + k] = s * f + c * g;                                                                  \
        }                                                                                                \
        a[p * n + p] = app - t * apq;                                                                    \
        a[q * n + q] = aqq + t * apq;                                                                    \
        a[p * n + q] = a[q * n + p] = 0;                                                                 \
      }                                                                                                  \
    }                                                                                                    \
  }                                                                                                      \
  for (p = 0; p < n; ++p) {                                                                              \
    int least = p;                                                                                       \
    double top = 0, value;                                                                               \
    for (q = p + 1; q < n; ++q) least = a[q * n + q] < a[least * n + least] ? q : least;                 \
    value = a[least * n + least];                                                                        \
    a[least * n + least] = a[p * n + p];                                                                 \
    a[p * n + p] = out[p] = value;                                                                       \
    for (k = 0; k < n; ++k) {                                                                            \
      const double kept = v[p * n + k];                                                                  \
      v[p * n + k] = v[least * n + k];                                                                   \
      v[least * n + k] = kept;                                                                           \
      top = fabs(v[p * n + k]) > fabs(top) ? v[p * n + k] : top;                                         \
    }                                                                                                    \
    for (k = 0; k < n; ++k) v[p * n + k] = top < 0 ? -v[p * n + k] : v[p * n + k];                       \
  }
#define DYNTAPE_TEXT(...) DYNTAPE_TEXT_OF(__VA_ARGS__)
#define DYNTAPE_TEXT_OF(...) #__VA_ARGS__

namespace dyntape::detail {

void symmetric_eigen(int n, const double* in, double* out) {
  using std::fabs;
  using std::sqrt;
  DYNTAPE_JACOBI
}

AD gap(const VectorXad& l, Eigen::Index i, Eigen::Index j) {
  const AD largest = max(abs(l[0]), abs(l[l.size() - 1])), difference = l[i] - l[j];
  const double resolution = 16.0 * static_cast<double>(l.size()) * std::numeric_limits<double>::epsilon();
  return select(abs(difference) > resolution * largest, difference, AD(0));
}

AD unless_repeated(const VectorXad& l, Eigen::Index i, const AD& x) {
  AD is_single = 1;
  if (i > 0) is_single = select(gap(l, i, i - 1) != 0.0, is_single, AD(0));
  if (i + 1 < l.size()) is_single = select(gap(l, i + 1, i) != 0.0, is_single, AD(0));
  return x / is_single;
}

namespace {

// A line a statement.
std::string jacobi_text(Eigen::Index n) {
  std::string text = "  enum { n = " + std::to_string(n) + " };\n  ";
  int depth = 0;
  for (const char c : std::string_view(DYNTAPE_TEXT(DYNTAPE_JACOBI))) {
    depth += (c == '(') - (c == ')');
    text += c;
    if (depth == 0 && (c == ';' || c == '{' || c == '}')) text += "\n ";
  }
  return text + "\n";
}

std::shared_ptr<const Callee> eigen_callee(Eigen::Index n);

// of the lower triangle, row by row
SymmetricEigen<AD> eigen_of_lower(const VectorXad& lower, Eigen::Index n) {
  const VectorXad out = call(eigen_callee(n), lower);
  return {out.head(n), out.segment(n, n * n).reshaped(n, n)};
}

// (A, dA) -> (dl, dV)
VectorXad eigen_tangents(const VectorXad& in, Eigen::Index n) {
  const Eigen::Index size = in.size() / 2;
  const auto [l, V] = eigen_of_lower(in.head(size), n);
  MatrixXad dA(n, n);
  for (Eigen::Index i = 0, k = size; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) dA(i, j) = dA(j, i) = in[k++];
  }
  const MatrixXad M = V.transpose() * dA * V;
  MatrixXad turn = MatrixXad::Zero(n, n);
  VectorXad dl(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    dl[i] = unless_repeated(l, i, M(i, i));
    for (Eigen::Index j = 0; j < n; ++j) {
      if (i != j) turn(j, i) = M(j, i) / gap(l, i, j);
    }
  }
  return flat({dl, V * turn, MatrixXad::Zero(n, n)});
}

// (A, l', V', of the working memory) -> A'
VectorXad eigen_adjoints(const VectorXad& in, Eigen::Index n) {
  const Eigen::Index size = n * (n + 1) / 2;
  const auto [l, V] = eigen_of_lower(in.head(size), n);
  MatrixXad M = V.transpose() * in.segment(size + n, n * n).reshaped(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      M(j, i) = i == j ? unless_repeated(l, i, in[size + i]) : AD(M(j, i) / gap(l, i, j));
    }
  }
  const MatrixXad full = V * M * V.transpose();
  VectorXad lower(size);
  for (Eigen::Index i = 0, k = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) lower[k++] = i == j ? full(i, i) : AD(full(i, j) + full(j, i));
  }
  return lower;
}

std::shared_ptr<const Callee> eigen_callee(Eigen::Index n) {
  const std::string name = "symmetric_eigen_" + std::to_string(n);
  return made_once(name, [&]() -> std::shared_ptr<const Callee> {
    const auto n_in = static_cast<std::size_t>(n * (n + 1) / 2),
               n_out = static_cast<std::size_t>(n + 2 * n * n);
    Kernel jacobi;
    jacobi.evaluate = [n](const double* in, double* out) { symmetric_eigen(static_cast<int>(n), in, out); };
    jacobi.c_body = jacobi_text(n);
    const auto per_sweep = static_cast<std::size_t>(4 * n * n * n);
    jacobi.operations = {{Op::Mul, 8 * per_sweep}, {Op::Add, 4 * per_sweep}};  // eight sweeps
    auto callee = std::make_shared<Callee>(name, n_in, n_out, jacobi);
    callee->jvp = [=] {
      return dissolving_callee(
          record(name + "_jvp", 2 * n_in, [n](const VectorXad& in) { return eigen_tangents(in, n); }));
    };
    callee->vjp = [=] {
      return dissolving_callee(
          record(name + "_vjp", n_in + n_out, [n](const VectorXad& in) { return eigen_adjoints(in, n); }));
    };
    return callee;
  });
}

template <class T>
Eigen::Matrix<T, Eigen::Dynamic, 1> lower_rows(const Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>& A) {
  Eigen::Matrix<T, Eigen::Dynamic, 1> lower(A.rows() * (A.rows() + 1) / 2);
  for (Eigen::Index i = 0, k = 0; i < A.rows(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) lower[k++] = A(i, j);
  }
  return lower;
}

}  // namespace

SymmetricEigen<double> symmetric_eigen(const Eigen::MatrixXd& A) {
  const Eigen::Index n = A.rows();
  Eigen::VectorXd out(n + 2 * n * n);
  symmetric_eigen(static_cast<int>(n), lower_rows(A).data(), out.data());
  return {out.head(n), out.segment(n, n * n).reshaped(n, n)};
}

SymmetricEigen<AD> symmetric_eigen(const MatrixXad& A) {
  if (A.rows() == 0) return {VectorXad(), MatrixXad()};
  return eigen_of_lower(lower_rows(A), A.rows());
}

}  // namespace dyntape::detail
