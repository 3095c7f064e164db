// SPDX-License-Identifier: BSD-3-Clause
//
// A program of somebody who compiles with other flags than the library, and so with other vectors of Eigen.  The layer's headers
// hand no object of Eigen's over.  Returns the number of results that are not right.
#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <span>

#include <dyntape/interface/cppad/cg.h>
#include <dyntape/interface/cppad/library.h>

using Vector = Eigen::Matrix<CppAD::AD<double>, Eigen::Dynamic, 1>;
using Matrix4 = Eigen::Matrix<CppAD::AD<double>, 4, 4>;

static int wrong(double got, double expected, const char* what) {
  if (std::abs(got - expected) <= 1e-12 * (1 + std::abs(expected))) return 0;
  std::printf("%s: %.17g, expected %.17g\n", what, got, expected);
  return 1;
}

int main() {
  int errors = 0;
  Vector ax = Vector::LinSpaced(4, 1.0, 4.0), ay(2);
  CppAD::Independent(ax);
  Matrix4 A = Eigen::Matrix4d::Identity().cast<CppAD::AD<double>>() * 2.0;
  A.row(0) += ax.transpose();
  ay[0] = (A * ax).squaredNorm();
  ay[1] = A.determinant();
  CppAD::ADFun<double> f(ax, ay);

  const Eigen::VectorXd x = Eigen::Vector4d(0.5, -1, 2, 3);
  const Eigen::VectorXd y = f.Forward(0, x), J = f.Jacobian(x);
  Eigen::Matrix4d B = Eigen::Matrix4d::Identity() * 2;
  B.row(0) += x.transpose();
  errors += wrong(y[0], (B * x).squaredNorm(), "value");
  errors += wrong(y[1], B.determinant(), "determinant");

  const dyntape::CompiledFunction g = CppAD::to_library(f);
  const auto all = g.evaluate(dyntape::Order::kFirst, std::span(x.data(), 4));
  for (std::size_t k = 0; k < all.jacobian.size(); ++k)
    errors +=
        wrong(all.jacobian[k], J[g.jacobian_pattern().row[k] * 4 + g.jacobian_pattern().col[k]], "Jacobian");
  return errors;
}
