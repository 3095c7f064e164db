// SPDX-License-Identifier: BSD-3-Clause
//
// Local models of functions, with OCS2's names.
//
//   ScalarFunctionQuadraticApproximation cost = ScalarFunctionQuadraticApproximation::Zero(nx, nu);
//   cost += 0.5 * tracking;
//   double model = cost.f + cost.dfdx.dot(dx) + 0.5 * dx.dot(cost.dfdxx * dx);
//
//   scalar   f(x + dx, u + du) = f + dfdx . dx + dfdu . du
//                                + 1/2 dx . dfdxx dx + du . dfdux dx + 1/2 du . dfduu du
//   vector   the same for each entry of f; one second-order matrix an output
//
// Shapes: f a number or (nf); dfdx, dfdu gradients (nx), (nu) of a scalar, Jacobians (nf x nx), (nf x nu) of
// a vector; dfdxx (nx x nx), dfdux (nu x nx: input times state), dfduu (nu x nu).  nu = -1: no inputs, the u
// blocks are empty.  An empty block counts as zero in + and +=; other sizes that differ throw ArgumentError.
#pragma once

#include <Eigen/Core>
#include <concepts>
#include <iosfwd>
#include <string>
#include <vector>

#include <dyntape/autodiff/eigen_layout.h>

namespace dyntape {

using scalar_t = double;
using vector_t = Eigen::VectorXd;
using matrix_t = Eigen::MatrixXd;

struct ScalarFunctionLinearApproximation {
  scalar_t f = 0;
  vector_t dfdx, dfdu;

  ScalarFunctionLinearApproximation() = default;
  explicit ScalarFunctionLinearApproximation(int nx, int nu = -1);

  ScalarFunctionLinearApproximation& operator+=(const ScalarFunctionLinearApproximation& other);
  ScalarFunctionLinearApproximation& operator*=(scalar_t factor);
  ScalarFunctionLinearApproximation& resize(int nx, int nu = -1);  // entries are left undefined
  ScalarFunctionLinearApproximation& setZero(int nx, int nu = -1);
  static ScalarFunctionLinearApproximation Zero(int nx, int nu = -1);
};

struct ScalarFunctionQuadraticApproximation {
  scalar_t f = 0;
  vector_t dfdx, dfdu;
  matrix_t dfdxx, dfdux, dfduu;

  ScalarFunctionQuadraticApproximation() = default;
  explicit ScalarFunctionQuadraticApproximation(int nx, int nu = -1);

  ScalarFunctionQuadraticApproximation& operator+=(const ScalarFunctionQuadraticApproximation& other);
  ScalarFunctionQuadraticApproximation& operator*=(scalar_t factor);
  ScalarFunctionQuadraticApproximation& resize(int nx, int nu = -1);
  ScalarFunctionQuadraticApproximation& setZero(int nx, int nu = -1);
  static ScalarFunctionQuadraticApproximation Zero(int nx, int nu = -1);
};

struct VectorFunctionLinearApproximation {
  vector_t f;
  matrix_t dfdx, dfdu;

  VectorFunctionLinearApproximation() = default;
  explicit VectorFunctionLinearApproximation(int nf, int nx, int nu = -1);

  VectorFunctionLinearApproximation& operator+=(const VectorFunctionLinearApproximation& other);
  VectorFunctionLinearApproximation& operator*=(scalar_t factor);
  VectorFunctionLinearApproximation& resize(int nf, int nx, int nu = -1);
  VectorFunctionLinearApproximation& setZero(int nf, int nx, int nu = -1);
  static VectorFunctionLinearApproximation Zero(int nf, int nx, int nu = -1);
};

struct VectorFunctionQuadraticApproximation {
  vector_t f;
  matrix_t dfdx, dfdu;
  std::vector<matrix_t> dfdxx, dfdux, dfduu;  // (nf) each

  VectorFunctionQuadraticApproximation() = default;
  explicit VectorFunctionQuadraticApproximation(int nf, int nx, int nu = -1);

  VectorFunctionQuadraticApproximation& operator+=(const VectorFunctionQuadraticApproximation& other);
  VectorFunctionQuadraticApproximation& operator*=(scalar_t factor);
  VectorFunctionQuadraticApproximation& resize(int nf, int nx, int nu = -1);
  VectorFunctionQuadraticApproximation& setZero(int nf, int nx, int nu = -1);
  static VectorFunctionQuadraticApproximation Zero(int nf, int nx, int nu = -1);
};

template <class T>
concept Approximation = std::same_as<T, ScalarFunctionLinearApproximation> ||
    std::same_as<T, ScalarFunctionQuadraticApproximation> ||
    std::same_as<T, VectorFunctionLinearApproximation> ||
    std::same_as<T, VectorFunctionQuadraticApproximation>;

template <Approximation A>
A operator+(A a, const A& b) {
  return a += b;
}
template <Approximation A>
A operator*(A a, scalar_t factor) {
  return a *= factor;
}
template <Approximation A>
A operator*(scalar_t factor, A a) {
  return a *= factor;
}

std::ostream& operator<<(std::ostream& out, const ScalarFunctionLinearApproximation& a);
std::ostream& operator<<(std::ostream& out, const ScalarFunctionQuadraticApproximation& a);
std::ostream& operator<<(std::ostream& out, const VectorFunctionLinearApproximation& a);
std::ostream& operator<<(std::ostream& out, const VectorFunctionQuadraticApproximation& a);

// What does not have the shapes above, as a sentence that starts with `name`; empty if everything fits.
std::string checkSize(int nx, int nu, const ScalarFunctionLinearApproximation& a, const std::string& name);
std::string checkSize(int nx, int nu, const ScalarFunctionQuadraticApproximation& a, const std::string& name);
std::string checkSize(int nf, int nx, int nu, const VectorFunctionLinearApproximation& a,
                      const std::string& name);
std::string checkSize(int nf, int nx, int nu, const VectorFunctionQuadraticApproximation& a,
                      const std::string& name);

// Whether a matrix is square, finite, symmetric and positive semi-definite, each up to rounding on the scale
// of its largest entry (n eps max |a_ij|): a sentence, or empty.
std::string checkBeingPSD(const matrix_t& matrix, const std::string& name);

namespace detail {

std::string shape(Eigen::Index rows, Eigen::Index cols);  // "(3 x 4)"

}  // namespace detail

}  // namespace dyntape
