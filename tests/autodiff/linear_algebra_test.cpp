// SPDX-License-Identifier: BSD-3-Clause
//
// General matrices on a tape: recorded at one matrix, they hold at every other, by value and by derivatives of any order.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include <dyntape/autodiff/record/linear_algebra.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/autodiff/scalars/jet_eigen.h>
#include <dyntape/autodiff/scalars/pack_eigen.h>

#include "dense.h"
#include "quad.h"
#include "random.h"

namespace dyntape::testing::linear_algebra_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A function of an (m x n) matrix and k columns beside it: recorded, and in double by Eigen.
struct MatrixCase {
  std::string name;
  Index m, n, k;  // k columns of m rows
  std::function<VectorXad(const MatrixXad& A, const MatrixXad& B)> recorded;
  std::function<VectorXd(const MatrixXd& A, const MatrixXd& B)> expected;
  bool pivots = true;

  std::size_t size() const { return static_cast<std::size_t>(m * (n + k)); }
  // Recorded at the default point, whatever it is evaluated at.
  Function function() const {
    return record(name, size(), [this](const VectorXad& x) {
      return recorded(x.head(m * n).reshaped(m, n), x.tail(m * k).reshaped(m, k));
    });
  }
  VectorXd at(const std::vector<double>& x) const {
    const VectorXd v = VectorXd::Map(x.data(), m * (n + k));
    return expected(v.head(m * n).reshaped(m, n), v.tail(m * k).reshaped(m, k));
  }
};

template <class M>
auto column(const M& m) {
  return Eigen::Matrix<typename M::Scalar, Eigen::Dynamic, 1>(m.reshaped());
}
template <class T>
Eigen::Matrix<T, Eigen::Dynamic, 1> one(const T& x) {
  return Eigen::Matrix<T, Eigen::Dynamic, 1>::Constant(1, x);
}

template <int n>
MatrixCase fixed_size() {
  return {"fixed " + std::to_string(n),
          n,
          n,
          1,
          [](const auto& A, const auto& B) {
            const Eigen::Matrix<AD, n, n> a = A;
            const Eigen::Matrix<AD, n, 1> b = B;
            VectorXad y(n * n + n + 1);
            y << a.inverse().eval().reshaped(), a.partialPivLu().solve(b), a.determinant();
            return y;
          },
          [](const auto& A, const auto& B) {
            VectorXd y(n * n + n + 1);
            y << MatrixXd(A.inverse()).reshaped(), A.partialPivLu().solve(B), A.determinant();
            return y;
          }};
}

std::vector<MatrixCase> square_cases() {
  std::vector<MatrixCase> all = {fixed_size<1>(), fixed_size<2>(), fixed_size<3>(),
                                 fixed_size<4>(), fixed_size<5>(), fixed_size<6>()};
  for (Index n = 1; n <= 6; ++n) {
    const std::string size = " " + std::to_string(n);
    all.push_back({"solve" + size, n, n, 2, [](const auto& A, const auto& B) { return column(solve(A, B)); },
                   [](const auto& A, const auto& B) { return column(MatrixXd(A.fullPivLu().solve(B))); }});
    all.push_back({"inverse" + size, n, n, 0, [](const auto& A, const auto&) { return column(inverse(A)); },
                   [](const auto& A, const auto&) { return column(MatrixXd(A.fullPivLu().inverse())); }});
    all.push_back({"parts of Eigen's inverse" + size, n, n, 0,
                   [](const auto& A, const auto&) {
                     VectorXad y(A.rows() + 2);
                     y << A.inverse().diagonal(), A.inverse().trace(), A.inverse().sum();
                     return y;
                   },
                   [](const auto& A, const auto&) {
                     const MatrixXd X = A.fullPivLu().inverse();
                     VectorXd y(A.rows() + 2);
                     y << X.diagonal(), X.trace(), X.sum();
                     return y;
                   }});
    all.push_back({"determinant" + size, n, n, 0,
                   [](const auto& A, const auto&) { return one(determinant(A)); },
                   [](const auto& A, const auto&) { return one(A.fullPivLu().determinant()); }});
    all.push_back({"Eigen's" + size, n, n, 1,
                   [](const auto& A, const auto& B) {
                     const MatrixXad X = A.inverse();
                     return column(MatrixXad(X * B + A.partialPivLu().solve(B) * A.determinant()));
                   },
                   [](const auto& A, const auto& B) {
                     return column(MatrixXd(A.inverse() * B + A.partialPivLu().solve(B) * A.determinant()));
                   }});
  }
  return all;
}

MatrixCase least_squares_case(Index m, Index n) {
  return {"least squares " + std::to_string(m) + " x " + std::to_string(n),
          m,
          n,
          2,
          [](const auto& A, const auto& B) {
            return column(MatrixXad(least_squares(A, B) + A.householderQr().solve(B)));
          },
          [](const auto& A, const auto& B) { return column(MatrixXd(2 * A.colPivHouseholderQr().solve(B))); },
          false};
}

std::vector<MatrixCase> tall_cases() {
  std::vector<MatrixCase> all;
  for (Index n = 1; n <= 6; ++n) {
    for (Index m : {n, n + 1, n + 4}) all.push_back(least_squares_case(m, n));
  }
  return all;
}

// Random entries; among square ones permutations, zeros on the diagonal and, where rows change places, rows of very
// different size.
std::vector<double> random_matrix(Random& random, const MatrixCase& c, int trial) {
  std::vector<double> x = random.vector(c.size(), -1, 1);
  if (c.m != c.n) return x;
  Eigen::Map<MatrixXd> A(x.data(), c.n, c.n);
  if (trial % 4 == 1) A.diagonal().setZero();
  if (c.n == 1) A(0, 0) = random.uniform(0.5, 1);
  if (trial % 4 == 2) {
    A = 1e-3 * A;
    for (Index i = 0; i < c.n; ++i) A(i, (i + trial) % c.n) += 1;
  }
  if (trial % 4 == 3 && c.pivots) A.row(trial % c.n) *= 1e-6;
  return x;
}

void expect_values(const MatrixCase& c, int trials = 200) {
  SCOPED_TRACE(c.name);
  const Function f = c.function();
  EXPECT_TRUE(f.guards.empty());
  Random random(21);
  for (int trial = 0; trial < trials; ++trial) {
    const std::vector<double> x = random_matrix(random, c, trial);
    const VectorXd expected = c.at(x), found = VectorXd::Map(evaluate(f, x).data(), expected.size());
    const double condition = MatrixXd::Map(x.data(), c.m, c.n).jacobiSvd().singularValues()(c.n - 1);
    if (condition < 1e-8) continue;  // nearly singular by chance
    ASSERT_LE((found - expected).norm(), 1e-10 * expected.norm()) << trial << "\n"
                                                                  << MatrixXd::Map(x.data(), c.m, c.n);
  }
}

TEST(Matrices, SquareOnesAreThoseOfEigenAtEveryMatrix) {
  for (const MatrixCase& c : square_cases()) expect_values(c);
}

TEST(Matrices, LeastSquaresAreThoseOfEigenAtEveryMatrix) {
  for (const MatrixCase& c : tall_cases()) expect_values(c);
}

// Jacobians against differences of the values in 113 bits, Hessians against differences of gradients.
void expect_slopes(const MatrixCase& c) {
  SCOPED_TRACE(c.name);
  const Function f = c.function(), gradient = vjp(f), third = jvp(vjp(jvp(f)));
  const Derivatives first = derive(f, Order::kFirst);
  const SparseFunction second = sparse_hessian(f);
  Random random(22);
  for (int trial = 0; trial < 3; ++trial) {
    const std::vector<double> x = random_matrix(random, c, trial);
    const std::vector<double> w = random.vector(f.n_y(), -1, 1);
    MatrixXd J = MatrixXd::Zero(Index(f.n_y()), Index(f.n_x())),
             H = MatrixXd::Zero(Index(f.n_x()), Index(f.n_x()));
    const std::vector<double> slopes = evaluate(first.function, x),
                              curvature = evaluate(second.function, x, {}, w);
    for (std::size_t i = 0; i < first.jacobian.nnz(); ++i)
      J(first.jacobian.row[i], first.jacobian.col[i]) = slopes[f.n_y() + i];
    for (std::size_t i = 0; i < second.pattern.nnz(); ++i)
      H(second.pattern.row[i], second.pattern.col[i]) = H(second.pattern.col[i], second.pattern.row[i]) =
          curvature[i];
    const auto near = [&](const auto& found, const std::vector<Quad>& expected, double scale) {
      for (std::size_t i = 0; i < expected.size(); ++i)
        EXPECT_NEAR(found[Index(i)], double(expected[i]), 1e-10 * (1 + scale)) << trial;
    };
    for (std::size_t j = 0; j < f.n_x(); ++j) {
      near(J.col(Index(j)), difference(f, x, j), J.norm());
      near(H.col(Index(j)), difference(gradient, x, j, {}, w), H.norm());
    }
    std::vector<double> weights = random.vector(f.n_x() + f.n_y(), -1, 1);
    const std::vector<double> direction = random.vector(third.n_w() - weights.size(), -1, 1);
    const Function to_differ = vjp(jvp(f));
    std::vector<Quad> sum(f.n_x(), 0);
    for (std::size_t j = 0; j < f.n_x(); ++j) {
      const std::vector<Quad> column = difference(to_differ, x, j, {}, weights);
      for (std::size_t i = 0; i < f.n_x(); ++i) sum[i] += direction[j] * column[i];
    }
    weights.insert(weights.end(), direction.begin(), direction.end());
    const VectorXd thirds = VectorXd::Map(evaluate(third, x, {}, weights).data(), Index(f.n_x()));
    near(thirds, sum, thirds.norm());
  }
}

TEST(Matrices, SlopesOfSquareOnesToThirdOrderAreThoseOf113Bits) {
  for (const MatrixCase& c : square_cases()) {
    if (c.n == 2 || c.n == 3 || (c.n == 5 && c.name != "fixed 5" && c.name != "Eigen's 5")) expect_slopes(c);
  }
}

TEST(Matrices, SlopesOfLeastSquaresToThirdOrderAreThoseOf113Bits) {
  expect_slopes(least_squares_case(3, 3));
  expect_slopes(least_squares_case(4, 2));
  expect_slopes(least_squares_case(3, 1));
}

// --- symmetric ones ---

MatrixXd symmetric(Random& random, Index n) {
  const MatrixXd A = MatrixXd::NullaryExpr(n, n, [&] { return random.uniform(-1, 1); });
  return A + A.transpose();
}

Function eigen_function(Index n) {
  return record("eigen", static_cast<std::size_t>(n * n), [n](const VectorXad& x) {
    const auto e = eigen_symmetric(MatrixXad(x.reshaped(n, n)));
    VectorXad y(n + n * n);
    y << e.values, e.vectors.reshaped();
    return y;
  });
}

std::vector<double> entries(const MatrixXd& A) { return {A.data(), A.data() + A.size()}; }

TEST(Matrices, EigenvaluesAndEigenvectorsAreThoseOfEigen) {
  Random random(23);
  for (Index n = 1; n <= 6; ++n) {
    const Function f = eigen_function(n);
    EXPECT_TRUE(f.guards.empty());
    for (int trial = 0; trial < 200; ++trial) {
      MatrixXd A = symmetric(random, n);
      if (trial % 4 == 1) A.diagonal().setZero();
      if (trial % 4 == 2) A *= 1e150;
      if (trial % 4 == 3) A = A.col(0) * A.col(0).transpose() * 1e-150;  // n - 1 eigenvalues are 0
      const Eigen::SelfAdjointEigenSolver<MatrixXd> expected(A);
      const std::vector<double> y = evaluate(f, entries(A));
      const VectorXd values = VectorXd::Map(y.data(), n);
      const MatrixXd V = MatrixXd::Map(y.data() + n, n, n);
      ASSERT_LE((values - expected.eigenvalues()).norm(), 1e-13 * values.norm());
      ASSERT_LE((V.transpose() * V - MatrixXd::Identity(n, n)).norm(), 1e-13);
      ASSERT_LE((A * V - V * values.asDiagonal()).norm(), 1e-13 * A.norm());
      for (Index i = 0; i < n; ++i) ASSERT_EQ(V.col(i).maxCoeff(), V.col(i).cwiseAbs().maxCoeff());
    }
  }
}

TEST(Matrices, SlopesOfEigenvaluesAndEigenvectors) {
  Random random(24);
  for (Index n = 1; n <= 5; ++n) {
    const Function f = eigen_function(n);
    const MatrixXd A = symmetric(random, n);
    const MatrixXd J = jacobian(f, entries(A));
    const std::vector<double> y = evaluate(f, entries(A));
    const MatrixXd V = MatrixXd::Map(y.data() + n, n, n);
    for (Index i = 0; i < n; ++i) {  // dl_i = v_i^T dA v_i, with both triangles in the lower one
      for (Index r = 0; r < n; ++r) {
        for (Index c = 0; c < n; ++c) {
          const double once = V(r, i) * V(c, i), expected = r == c ? once : r > c ? 2 * once : 0;
          EXPECT_NEAR(J(i, c * n + r), expected, 1e-12);
        }
      }
    }
    const double h = 1e-4;
    const std::vector<double> w = random.vector(f.n_y(), -1, 1);
    const MatrixXd H = hessian(f, entries(A), w);
    const auto difference = [&](auto g, Index j) {  // of fourth order
      const auto at = [&](double step) {
        MatrixXd moved = A;
        moved.data()[j] += step;
        return g(entries(moved));
      };
      return ((8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)).eval();
    };
    const Derivatives first = derive(f, Order::kFirst);
    const auto value = [&](const std::vector<double>& x) {
      return VectorXd::Map(evaluate(f, x).data(), n + n * n).eval();
    };
    const auto gradient = [&](const std::vector<double>& x) {
      const std::vector<double> all = evaluate(first.function, x);
      VectorXd g = VectorXd::Zero(n * n);
      for (std::size_t k = 0; k < first.jacobian.nnz(); ++k)
        g[first.jacobian.col[k]] += w[first.jacobian.row[k]] * all[f.n_y() + k];
      return g;
    };
    for (Index j = 0; j < n * n; ++j) {
      EXPECT_LE((J.col(j) - difference(value, j)).norm(), 1e-8 * (1 + J.norm()));
      EXPECT_LE((H.col(j) - difference(gradient, j)).norm(), 1e-7 * (1 + H.norm()));
    }
  }
}

TEST(Matrices, RepeatedEigenvaluesHaveNoFiniteSlopes) {
  const Function f =
      record("l", 9, [](const VectorXad& x) { return VectorXad(eigenvalues_symmetric(x.reshaped(3, 3))); });
  const MatrixXd all = jacobian(f, entries(MatrixXd::Identity(3, 3)));
  for (Index i = 0; i < 3; ++i) EXPECT_FALSE(all.row(i).allFinite());
  const MatrixXd two = jacobian(f, {1, 0, 0, 0, 1, 0, 0, 0, 3});
  EXPECT_FALSE(two.row(0).allFinite());
  EXPECT_FALSE(two.row(1).allFinite());
  EXPECT_TRUE(two.row(2).allFinite());
  EXPECT_EQ(two(2, 8), 1);
  const Function v = eigen_function(3);
  EXPECT_FALSE(jacobian(v, {1, 0, 0, 0, 1, 0, 0, 0, 3}).row(3).allFinite());
}

Function singular_function(Index m, Index n) {
  return record("s", static_cast<std::size_t>(m * n),
                [=](const VectorXad& x) { return VectorXad(singular_values(x.reshaped(m, n))); });
}

TEST(Matrices, SingularValuesAreThoseOfEigenWithTheirSlopes) {
  Random random(25);
  for (const auto& [m, n] : {std::pair<Index, Index>{1, 1}, {3, 3}, {5, 2}, {2, 5}, {1, 4}, {6, 6}, {4, 1}}) {
    const Function f = singular_function(m, n), weighted = vjp(f);
    const Derivatives first = derive(f, Order::kFirst);
    for (int trial = 0; trial < 200; ++trial) {
      const MatrixXd A = MatrixXd::NullaryExpr(m, n, [&] { return random.uniform(-1, 1); });
      const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
      const std::vector<double> all = evaluate(first.function, entries(A));
      const auto s = VectorXd::Map(all.data(), std::min(m, n));
      ASSERT_LE((s - svd.singularValues()).norm(), 1e-13 * s.norm());
      MatrixXd J = MatrixXd::Zero(s.size(), m * n);
      for (std::size_t k = 0; k < first.jacobian.nnz(); ++k)
        J(first.jacobian.row[k], first.jacobian.col[k]) = all[f.n_y() + k];
      for (Index i = 0; i < s.size(); ++i) {
        const MatrixXd expected = svd.matrixU().col(i) * svd.matrixV().col(i).transpose();
        const double gap = std::min(i ? s[i - 1] - s[i] : 1.0, i + 1 < s.size() ? s[i] - s[i + 1] : s[i]);
        ASSERT_LE((J.row(i).transpose() - expected.reshaped()).norm(), 1e-12 / gap)
            << m << " " << n << " " << i;
        std::vector<double> e(f.n_y(), 0.0);
        e[std::size_t(i)] = 1;
        const std::vector<double> reverse = evaluate(weighted, entries(A), {}, e);
        ASSERT_LE((VectorXd::Map(reverse.data(), m * n) - expected.reshaped()).norm(), 1e-12 / gap);
      }
    }
  }
}

TEST(Matrices, CurvatureOfSingularValues) {
  Random random(26);
  for (const auto& [m, n] : {std::pair<Index, Index>{3, 3}, {4, 2}}) {
    const Function f = singular_function(m, n);
    const MatrixXd A = MatrixXd::NullaryExpr(m, n, [&] { return random.uniform(-1, 1); });
    const std::vector<double> w = random.vector(f.n_y(), -1, 1);
    const MatrixXd H = hessian(f, entries(A), w);
    const double h = 1e-4;
    for (Index j = 0; j < m * n; ++j) {
      const auto at = [&, cols = n, rows = m](double step) {
        MatrixXd moved = A;
        moved.data()[j] += step;
        const VectorXd g =
            jacobian(f, entries(moved)).transpose() * VectorXd::Map(w.data(), std::min(rows, cols));
        return g;
      };
      const VectorXd expected = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
      EXPECT_LE((H.col(j) - expected).norm(), 1e-7 * (1 + H.norm()));
    }
  }
}

// --- poles and errors ---

bool all_finite(const std::vector<double>& y) {
  return std::all_of(y.begin(), y.end(), [](double t) { return std::isfinite(t); });
}

TEST(Matrices, SingularOnesGiveNothingFiniteThatIsWrong) {
  for (Index n = 1; n <= 6; ++n) {
    MatrixXd A = MatrixXd::NullaryExpr(n, n, [](Index i, Index j) { return double((i + 1) * (j + 1)); });
    if (n == 1) A(0, 0) = 0;
    const auto size = static_cast<std::size_t>(n * n);
    const Function X =
        record("X", size, [n](const VectorXad& x) { return column(inverse(MatrixXad(x.reshaped(n, n)))); });
    const Function d =
        record("d", size, [n](const VectorXad& x) { return one(determinant(x.reshaped(n, n))); });
    EXPECT_FALSE(all_finite(evaluate(X, entries(A)))) << n;
    EXPECT_FALSE(jacobian(X, entries(A)).allFinite()) << n;
    if (n <= 4) {
      EXPECT_EQ(evaluate(d, entries(A))[0], 0);
      const MatrixXd slope = jacobian(d, entries(A));  // the cofactors
      EXPECT_TRUE(slope.allFinite());
      if (n == 2) {
        EXPECT_EQ(slope, (MatrixXd(1, 4) << 4, -2, -2, 1).finished());
      }
    } else {
      EXPECT_FALSE(jacobian(d, entries(MatrixXd::Zero(n, n))).allFinite());
    }
  }
  const Function x = record(
      "x", 9, [](const VectorXad& v) { return column(least_squares(v.head(6).reshaped(3, 2), v.tail(3))); });
  EXPECT_FALSE(all_finite(evaluate(x, {0, 0, 0, 1, 2, 3, 1, 1, 1})));
  const Function s = singular_function(3, 2);
  EXPECT_NEAR(evaluate(s, {0, 0, 0, 3, 4, 0})[0], 5, 1e-15);
  EXPECT_NEAR(evaluate(s, {0, 0, 0, 3, 4, 0})[1], 0, 1e-15);
  const MatrixXd slopes = jacobian(s, {0, 0, 0, 3, 4, 0});
  EXPECT_TRUE(slopes.row(0).allFinite());
  EXPECT_FALSE(slopes.row(1).allFinite());
}

TEST(Matrices, WrongSizesAreErrors) {
  const MatrixXd tall = MatrixXd::Ones(3, 2), square = MatrixXd::Identity(2, 2);
  EXPECT_THROW(solve(tall, VectorXd::Zero(3)), ArgumentError);
  EXPECT_THROW(solve(square, VectorXd::Zero(3)), ArgumentError);
  EXPECT_THROW(inverse(tall), ArgumentError);
  EXPECT_THROW(determinant(tall), ArgumentError);
  EXPECT_THROW(least_squares(tall.transpose(), VectorXd::Zero(2)), ArgumentError);
  EXPECT_THROW(least_squares(tall, VectorXd::Zero(2)), ArgumentError);
  EXPECT_THROW(eigenvalues_symmetric(tall), ArgumentError);
  EXPECT_THROW(MatrixXad(tall).partialPivLu(), ArgumentError);
  EXPECT_THROW(MatrixXad(tall).jacobiSvd(Eigen::ComputeThinU), ArgumentError);
  EXPECT_EQ(determinant(MatrixXd(0, 0)), 1);
  EXPECT_EQ(solve(MatrixXad(0, 0), MatrixXad(0, 2)).size(), 0);
}

// --- other scalars, and Eigen's classes ---

TEST(Matrices, PacksJetsAnd113BitsTakeTheSameWay) {
  Random random(27);
  const Index n = 5;
  const MatrixXd A = MatrixXd::NullaryExpr(n, n, [&] { return random.uniform(-1, 1); });
  const VectorXd b = VectorXd::NullaryExpr(n, [&] { return random.uniform(-1, 1); });
  const VectorXd x = solve(A, b);
  EXPECT_LE((x - A.fullPivLu().solve(b)).norm(), 1e-13 * x.norm());
  EXPECT_NEAR(determinant(A), A.determinant(), 1e-14);
  using J = Jet<double, 1>;
  Eigen::Matrix<J, Eigen::Dynamic, Eigen::Dynamic> jet = A.cast<J>();
  jet(1, 2).tangent(0) = 1;
  const auto moved = solve(jet, b.cast<J>().eval());
  const VectorXd slope = -A.inverse().col(1) * x[2];
  // Lanes that pivot differently.
  using P = Pack<double, 4>;
  Eigen::Matrix<P, Eigen::Dynamic, Eigen::Dynamic> pack(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      for (int lane = 0; lane < 4; ++lane) pack(i, j).set(lane, A((i + lane) % n, j));
    }
  }
  const Eigen::Matrix<P, Eigen::Dynamic, Eigen::Dynamic> X = inverse(pack);
  for (Index i = 0; i < n; ++i) {
    EXPECT_NEAR(moved[i].tangent(0), slope[i], 1e-12 * slope.norm());
    EXPECT_EQ(moved[i].value(), x[i]);
    for (int lane = 0; lane < 4; ++lane) {
      MatrixXd turned(n, n);
      for (Index r = 0; r < n; ++r) turned.row(r) = A.row((r + lane) % n);
      for (Index j = 0; j < n; ++j) EXPECT_EQ(X(i, j)[lane], inverse(turned)(i, j));
    }
  }
}

TEST(Matrices, FactorsOfEigensClassesMultiplyBack) {
  Random random(28);
  const Index m = 5, n = 4;
  const Function f = record("factors", static_cast<std::size_t>(m * n), [=](const VectorXad& x) {
    const MatrixXad A = x.reshaped(m, n), M = A.transpose() * A;
    const auto qr = A.householderQr();
    const MatrixXad R = qr.matrixQR().triangularView<Eigen::Upper>();
    const MatrixXad L = M.llt().matrixL(), unit = M.ldlt().matrixL(), U = M.llt().matrixU();
    const MatrixXad root = Eigen::SelfAdjointEigenSolver<MatrixXad>(M).operatorSqrt();
    VectorXad y(m * n + 4 * n * n);
    y << (qr.householderQ() * R - A).reshaped(), (L * L.transpose() - M).reshaped(),
        (unit * M.ldlt().vectorD().asDiagonal() * unit.transpose() - M).reshaped(),
        (root * root - M).reshaped(), (L - U.transpose()).reshaped();
    return y;
  });
  EXPECT_TRUE(f.guards.empty());
  for (int trial = 0; trial < 100; ++trial) {
    const std::vector<double> y = evaluate(f, random.vector(f.n_x(), -1, 1));
    for (double t : y) EXPECT_NEAR(t, 0, 1e-13);
  }
}

}  // namespace
}  // namespace dyntape::testing::linear_algebra_test
