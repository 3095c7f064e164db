// SPDX-License-Identifier: BSD-3-Clause
//
// Derivatives by finite differences.  Use them to check other derivatives.
//
//   matrix_t J = finiteDifferenceDerivative([&](const vector_t& x) { return f.getFunctionValue(x); }, x0);
//
// The step of entry i is eps * max(|x_i|, 1).  Default of eps: the cube root of the machine epsilon for central
// differences, its square root for one-sided differences.  (OCS2's default is the machine epsilon, at which a
// difference keeps no correct digit.)
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <dyntape/interface/ocs2/names.h>

namespace dyntape::ocs2 {

// (m x n); eps 0: the default.
template <class F>
matrix_t finiteDifferenceDerivative(const F& f, const vector_t& x0, scalar_t eps = 0,
                                    bool doubleSided = true) {
  constexpr scalar_t kEpsilon = std::numeric_limits<scalar_t>::epsilon();
  if (eps <= 0) eps = doubleSided ? std::cbrt(kEpsilon) : std::sqrt(kEpsilon);
  const vector_t f0 = f(x0);
  matrix_t derivative(f0.size(), x0.size());
  for (Eigen::Index i = 0; i < x0.size(); ++i) {
    const scalar_t h = eps * std::max(std::abs(x0[i]), 1.0);
    vector_t up = x0, down = x0;
    up[i] += h;
    down[i] -= doubleSided ? h : 0;
    const vector_t low = doubleSided ? vector_t(f(down)) : f0;
    derivative.col(i) = (f(up) - low) / (up[i] - down[i]);
  }
  return derivative;
}

// Derivatives by the state and by the input of a system with computeFlowMap(time, state, input).
// isSecondOrderSystem: the upper half is velocity; its derivatives are set to exactly [0 1] and 0.
template <class System>
matrix_t finiteDifferenceDerivativeState(System& system, scalar_t t, const vector_t& x, const vector_t& u,
                                         scalar_t eps = 0, bool doubleSided = true,
                                         bool isSecondOrderSystem = false) {
  matrix_t A = finiteDifferenceDerivative([&](const vector_t& at) { return system.computeFlowMap(t, at, u); },
                                          x, eps, doubleSided);
  if (isSecondOrderSystem) {
    const Eigen::Index n = x.size() / 2;
    A.topRows(n) << matrix_t::Zero(n, n), matrix_t::Identity(n, n);
  }
  return A;
}

template <class System>
matrix_t finiteDifferenceDerivativeInput(System& system, scalar_t t, const vector_t& x, const vector_t& u,
                                         scalar_t eps = 0, bool doubleSided = true,
                                         bool isSecondOrderSystem = false) {
  matrix_t B = finiteDifferenceDerivative([&](const vector_t& at) { return system.computeFlowMap(t, x, at); },
                                          u, eps, doubleSided);
  if (isSecondOrderSystem) B.topRows(x.size() / 2).setZero();
  return B;
}

}  // namespace dyntape::ocs2
