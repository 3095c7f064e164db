// SPDX-License-Identifier: BSD-3-Clause
//
// Derivatives of forward dynamics by ways that share no line with those of dyntape's routes: jets, the complex step, differences of
// fourth order.  Each state (q, v, tau); each result d FD/dq, d FD/dv, d FD/dtau, (nv x nv) one after another, row by row.
//
//   ByJets jets(model);
//   jets.evaluate(state, result);
//
// ByComplexStep is for robots whose configurations are plain numbers: ArgumentError where one has a quaternion.
#pragma once

#include <complex>

#include <dyntape/autodiff/scalars/jet_eigen.h>
#include <dyntape/dynamics/algorithms/algorithms.h>

namespace dyntape::tools {

class ByJets {
 public:
  explicit ByJets(const dynamics::Model<double>& model);
  void evaluate(const Eigen::VectorXd& state, double* result);

 private:
  using J = Jet<double, 8>;  // columns a run
  dynamics::Model<J> model_;
  dynamics::Data<J> data_;
};

class ByComplexStep {
 public:
  explicit ByComplexStep(const dynamics::Model<double>& model);
  void evaluate(const Eigen::VectorXd& state, double* result);

 private:
  using C = std::complex<double>;
  dynamics::Model<C> model_;
  dynamics::Data<C> data_;
};

// (8 (f(h) - f(-h)) - (f(2h) - f(-2h))) / 12h, configurations moved along their tangents; h is `step` times the magnitude of
// what is moved, where that is more than one.
class ByFourthOrder {
 public:
  ByFourthOrder(const dynamics::Model<double>& model, double step);
  void evaluate(const Eigen::VectorXd& state, double* result);

 private:
  const dynamics::Model<double>& model_;
  dynamics::Data<double> data_;
  double step_;
};

}  // namespace dyntape::tools
