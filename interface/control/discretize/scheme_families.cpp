// SPDX-License-Identifier: BSD-3-Clause
//
// Schemes of any number of points: points and weights of Lobatto's and Radau's quadrature, and what integrates and
// derives the polynomials through them.
#include <cmath>
#include <numbers>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/scheme.h>

namespace dyntape {

namespace {

constexpr int kMostPoints = 128;
constexpr int kNewtonSteps = 100;  // five or six do

// Legendre's polynomials of degree n and n - 1 at x.
struct LegendrePair {
  double last, before;
};
LegendrePair legendre(int n, double x) {
  LegendrePair p{1, 0};
  for (int k = 1; k <= n; ++k) p = {((2 * k - 1) * x * p.last - (k - 1) * p.before) / k, p.last};
  return p;
}

// The root of a function near x, by Newton's steps, which the function gives.
template <class Step>
double root_near(double x, const Step& step) {
  for (int i = 0; i < kNewtonSteps; ++i) {
    const double by = step(x);
    x -= by;
    if (std::abs(by) < 1e-16) break;
  }
  return x;
}

// On [0, 1], in their order.
struct FamilyQuadrature {
  Eigen::VectorXd points, weights;
};

// Both ends and the roots of P'_n, n = points - 1; w = 2 / (n (n + 1) P_n^2) on [-1, 1].  Newton's steps are those of
// (1 - x^2) P'_n / n = P_{n-1} - x P_n, whose slope is - (n + 1) P_n; x = -cos(pi i / n) is near enough.
FamilyQuadrature lobatto_quadrature(int points) {
  const int n = points - 1;
  FamilyQuadrature q{Eigen::VectorXd(points), Eigen::VectorXd(points)};
  for (int i = 0; i < points; ++i) {
    double x = i == 0 ? -1 : i == n ? 1 : -std::cos(std::numbers::pi * i / n);
    if (i > 0 && i < n) {
      x = root_near(x, [n](double at) {
        const LegendrePair p = legendre(n, at);
        return (p.before - at * p.last) / (-(n + 1) * p.last);
      });
    }
    q.points[i] = (1 + x) / 2;
    q.weights[i] = 1 / (n * (n + 1) * std::pow(legendre(n, x).last, 2));
  }
  return q;
}

// Roots of P_s - P_{s-1}, 1 among them; w = (1 + x) / (s P_{s-1})^2 on [-1, 1].  (1 - x^2) P'_k = k (P_{k-1} - x P_k).
FamilyQuadrature radau_quadrature(int s) {
  FamilyQuadrature q{Eigen::VectorXd(s), Eigen::VectorXd(s)};
  for (int i = 0; i < s; ++i) {
    double x = 1;
    if (i + 1 < s) {
      x = root_near(std::cos(2 * std::numbers::pi * (s - 1 - i) / (2 * s - 1)), [s](double at) {
        const LegendrePair p = legendre(s, at), before = legendre(s - 1, at);
        const double slope =
            (s * (p.before - at * p.last) - (s - 1) * (before.before - at * before.last)) / (1 - at * at);
        return (p.last - p.before) / slope;
      });
    }
    q.points[i] = (1 + x) / 2;
    q.weights[i] = (1 + x) / (2 * std::pow(s * legendre(s - 1, x).last, 2));
  }
  return q;
}

// Entry (i, j): the integral of point j's Lagrange polynomial from 0 to c_i.  The quadrature is exact for it.
Eigen::MatrixXd integrals(const FamilyQuadrature& q) {
  const Eigen::Index n = q.points.size();
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index m = 0; m < n; ++m)
      a.row(i) +=
          q.points[i] * q.weights[m] * lagrange_weights(q.points, q.points[i] * q.points[m]).transpose();
  }
  return a;
}

// Entry (i, j): the slope of point j's Lagrange polynomial at c_i.  At Lobatto's inner points their own have none; there what a
// row is off by, of constants, is the neighbour's.
Eigen::MatrixXd lobatto_slopes(const Eigen::VectorXd& points) {
  const Eigen::Index n = points.size();
  Eigen::VectorXd products = Eigen::VectorXd::Ones(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      if (j != i) products[i] *= 4 * (points[i] - points[j]);  // 4: neither vanishes nor overflows
    }
  }
  Eigen::MatrixXd d = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      if (j != i) d(i, j) = products[i] / products[j] / (points[i] - points[j]);
    }
    d(i, i == 0 || i == n - 1 ? i : i + 1) -= d.row(i).sum();
  }
  return d;
}

std::string checked_name(const char* family, int points, int least) {
  const std::string name = family + ("-" + std::to_string(points));
  if (points >= least && points <= kMostPoints) return name;
  throw ArgumentError("there is no scheme \"" + name + "\": expected " + std::to_string(least) + " to " +
                      std::to_string(kMostPoints) + " points");
}

}  // namespace

Scheme lobatto(int points) {
  const std::string name = checked_name("lobatto", points, 2);
  const FamilyQuadrature q = lobatto_quadrature(points);
  const int rows = points - 1;
  Eigen::MatrixXd alpha(rows, points);
  alpha << Eigen::VectorXd::Constant(rows, -1), Eigen::MatrixXd::Identity(rows, rows);
  return {name, q.points, alpha, -integrals(q).bottomRows(rows), q.weights, 2 * points - 2};
}

Scheme radau(int collocated) {
  const std::string name = checked_name("radau", collocated, 1);
  const FamilyQuadrature q = radau_quadrature(collocated);
  Scheme scheme{name,
                Eigen::VectorXd::Zero(collocated + 1),
                Eigen::MatrixXd::Zero(collocated, collocated + 1),
                Eigen::MatrixXd::Zero(collocated, collocated + 1),
                Eigen::VectorXd::Zero(collocated + 1),
                2 * collocated - 1};
  scheme.c.tail(collocated) = q.points;
  scheme.alpha << Eigen::VectorXd::Constant(collocated, -1),
      Eigen::MatrixXd::Identity(collocated, collocated);
  scheme.beta.rightCols(collocated) = -integrals(q);
  scheme.gamma.tail(collocated) = q.weights;
  return scheme;
}

Scheme pseudospectral(int points) {
  const std::string name = checked_name("pseudospectral", points, 3);
  const FamilyQuadrature q = lobatto_quadrature(points);
  Scheme scheme{name,
                q.points,
                q.weights.asDiagonal() * lobatto_slopes(q.points),
                -Eigen::MatrixXd(q.weights.asDiagonal()),
                q.weights,
                2 * points - 2};
  scheme.spans_all = true;
  return scheme;
}

}  // namespace dyntape
