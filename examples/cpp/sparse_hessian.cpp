// SPDX-License-Identifier: BSD-3-Clause
//
// A program for another solver: patterns and non-zeros of the constraints' Jacobian and of the Lagrangian's Hessian,
//
//   sigma f(x) + lambda . g(x)         its lower triangle, each position once
//
// from StagedNlp (interface/control/nlp/nlp.h): a fixed pattern, and a call that fills in the numbers without
// allocation.  A single function has the same: AdFunction::hessianPattern(), and in custom_constraint.cpp its
// Jacobian's.
#include <Eigen/SparseCore>
#include <cstdio>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/solve/optimise.h>

using namespace dyntape;
using Eigen::VectorXd;
using Sparse = Eigen::SparseMatrix<double>;

// A pendulum is swung to horizontal with least torque.
Problem swing() {
  Problem p("pendulum", {"angle", "rate"}, {"torque"}, 1, [](const auto& s) {
    using std::sin;
    return vector(s.x[1], s.u[0] - 9.81 * sin(s.x[0]));
  });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.start << 0, 0;
  p.goal << M_PI / 2, 0;
  return p;
}

Sparse matrix(const Pattern& pattern, const std::vector<double>& values) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < pattern.nnz(); ++k)
    entries.emplace_back(int(pattern.row[k]), int(pattern.col[k]), values[k]);
  Sparse m(Eigen::Index(pattern.rows), Eigen::Index(pattern.cols));
  m.setFromTriplets(entries.begin(), entries.end());
  return m;
}

int main() try {
  StagedNlp nlp = discretize(swing(), {.intervals = 20});
  const NlpShape& shape = nlp.shape();
  const NlpSolution s = solve_nlp(nlp, nlp.start());
  const auto n = Eigen::Index(shape.n()), m = Eigen::Index(shape.m());

  std::vector<double> hessian(shape.hessian.nnz()), jacobian(shape.jacobian.nnz());
  nlp.hessian(s.x.data(), 1, s.lambda.data(), hessian.data());
  const Sparse lower = matrix(shape.hessian, hessian);
  std::printf("%ld variables, %ld constraints; H: %zu of %ld places, J: %zu of %ld\n", n, m,
              shape.hessian.nnz(), n * (n + 1) / 2, shape.jacobian.nnz(), n * m);
  for (std::size_t k = 0; k < 4; ++k) {  // one block per point: here angle and torque of the first two
    const std::size_t row = shape.hessian.row[k], col = shape.hessian.col[k];
    std::printf("  d2/d %s d %s = %.6f\n", nlp.variable_name(row).c_str(), nlp.variable_name(col).c_str(),
                hessian[k]);
  }

  // Along any direction H is the change of the Lagrangian's gradient.
  const auto slope = [&](const VectorXd& x) -> VectorXd {
    VectorXd g(n);
    nlp.gradient(x.data(), g.data()), nlp.jacobian(x.data(), jacobian.data());
    return g + matrix(shape.jacobian, jacobian).transpose() * VectorXd::Map(s.lambda.data(), m);
  };
  std::mt19937 random(1);
  std::normal_distribution<double> number;
  const VectorXd d = VectorXd::NullaryExpr(n, [&] { return number(random); }),
                 x = VectorXd::Map(s.x.data(), n);
  const VectorXd along = lower.selfadjointView<Eigen::Lower>() * d;
  const double off = ((slope(x + 1e-5 * d) - slope(x - 1e-5 * d)) / 2e-5 - along).cwiseAbs().maxCoeff();
  std::printf("H d is %.3f long, off from differences by %.1e\n", along.norm(), off);
  return s.status == SolveStatus::kSolved && off < 1e-7 ? 0 : 1;
} catch (const Error& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
