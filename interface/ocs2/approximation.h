// SPDX-License-Identifier: BSD-3-Clause
//
// Linear and quadratic approximations of functions, with OCS2's names.
//
//   ScalarFunctionQuadraticApproximation cost = ScalarFunctionQuadraticApproximation::Zero(nx, nu);
//   cost += 0.5 * tracking;
//   double model = cost.f + cost.dfdx.dot(dx) + 0.5 * dx.dot(cost.dfdxx * dx);
//
//   scalar   f(x + dx, u + du) = f + dfdx . dx + dfdu . du
//                                + 1/2 dx . dfdxx dx + du . dfdux dx + 1/2 du . dfduu du
//   vector   the same for each entry of f; one second-order matrix per output
//
// Shapes: f a number or (nf); dfdx, dfdu gradients (nx), (nu) of a scalar, Jacobians (nf x nx), (nf x nu) of
// a vector; dfdxx (nx x nx), dfdux (nu x nx: input times state), dfduu (nu x nu).  nu = -1: no inputs, the u
// blocks are empty.  An empty block counts as zero in + and +=; other sizes that differ throw ArgumentError.
//
// Each converts implicitly to a client's struct with members of these names: Theirs theirs = ours;
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

namespace detail {

struct OfDyntape {};  // marks dyntape's structs, to distinguish them from a client's

// A client's struct with the same members.
template <class Theirs>
concept LinearLike =
    !std::derived_from<Theirs, OfDyntape> && std::default_initializable<Theirs> && requires(Theirs t) {
  t.f;
  t.dfdx;
  t.dfdu;
};
template <class Theirs>
concept QuadraticLike = LinearLike<Theirs> && requires(Theirs t) {
  t.dfdxx;
  t.dfdux;
  t.dfduu;
};

template <class Theirs>
Theirs linear_as(const auto& a) {
  Theirs t;
  t.f = a.f, t.dfdx = a.dfdx, t.dfdu = a.dfdu;
  return t;
}
// Second-order blocks may be lists of another type.
template <class To>
To blocks_as(const auto& from) {
  if constexpr (requires(To to) { to = from; }) {
    return from;
  } else {
    return To(from.begin(), from.end());
  }
}
template <class Theirs>
Theirs quadratic_as(const auto& a) {
  Theirs t = linear_as<Theirs>(a);
  t.dfdxx = blocks_as<decltype(t.dfdxx)>(a.dfdxx);
  t.dfdux = blocks_as<decltype(t.dfdux)>(a.dfdux);
  t.dfduu = blocks_as<decltype(t.dfduu)>(a.dfduu);
  return t;
}

template <class F, class Slope>
struct LinearBlocks : OfDyntape {
  F f{};
  Slope dfdx, dfdu;

  template <LinearLike Theirs>
  requires(!QuadraticLike<Theirs>) operator Theirs() const { return linear_as<Theirs>(*this); }
};
template <class F, class Slope, class Curvature>
struct QuadraticBlocks : OfDyntape {
  F f{};
  Slope dfdx, dfdu;
  Curvature dfdxx, dfdux, dfduu;

  template <QuadraticLike Theirs>
  operator Theirs() const {
    return quadratic_as<Theirs>(*this);
  }
};

// Operations on all blocks.  Size: of f, for vectors only.  Entries are undefined after a change of size.
template <class Self, class Blocks, class... Size>
struct ApproximationOf : Blocks {
  ApproximationOf() = default;
  explicit ApproximationOf(Size... nf, int nx, int nu = -1) { resize(nf..., nx, nu); }
  Self& operator+=(const Self& other);
  Self& operator*=(scalar_t factor);
  Self& resize(Size... nf, int nx, int nu = -1);
  Self& setZero(Size... nf, int nx, int nu = -1);
  static Self Zero(Size... nf, int nx, int nu = -1) { return Self().setZero(nf..., nx, nu); }
};
template <class Self, class Blocks>
using OfScalar = ApproximationOf<Self, Blocks>;
template <class Self, class Blocks>
using OfVector = ApproximationOf<Self, Blocks, int>;

}  // namespace detail

struct ScalarFunctionLinearApproximation
    : detail::OfScalar<ScalarFunctionLinearApproximation, detail::LinearBlocks<scalar_t, vector_t>> {
  using ApproximationOf::ApproximationOf;
};
struct ScalarFunctionQuadraticApproximation
    : detail::OfScalar<ScalarFunctionQuadraticApproximation,
                       detail::QuadraticBlocks<scalar_t, vector_t, matrix_t>> {
  using ApproximationOf::ApproximationOf;
};
struct VectorFunctionLinearApproximation
    : detail::OfVector<VectorFunctionLinearApproximation, detail::LinearBlocks<vector_t, matrix_t>> {
  using ApproximationOf::ApproximationOf;
};
// The second order is one matrix per output.
struct VectorFunctionQuadraticApproximation
    : detail::OfVector<VectorFunctionQuadraticApproximation,
                       detail::QuadraticBlocks<vector_t, matrix_t, std::vector<matrix_t>>> {
  using ApproximationOf::ApproximationOf;
};

template <class T>
concept Approximation = std::derived_from<T, detail::OfDyntape>;
template <class T>
concept ScalarFunctionApproximation = Approximation<T> && std::same_as<decltype(T::f), scalar_t>;
template <class T>
concept VectorFunctionApproximation = Approximation<T> && !ScalarFunctionApproximation<T>;

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

template <Approximation A>
std::ostream& operator<<(std::ostream& out, const A& a);

// Deviations from the shapes above, as sentences that start with `name`; empty if all shapes are right.
template <ScalarFunctionApproximation A>
std::string checkSize(int nx, int nu, const A& a, const std::string& name);
template <VectorFunctionApproximation A>
std::string checkSize(int nf, int nx, int nu, const A& a, const std::string& name);

// Checks that a matrix is square, finite, symmetric and positive semi-definite, up to rounding relative to its
// largest entry (n eps max |a_ij|).  Returns a sentence, or "".
std::string checkBeingPSD(const matrix_t& matrix, const std::string& name);

}  // namespace dyntape
