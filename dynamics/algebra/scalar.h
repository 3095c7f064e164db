// SPDX-License-Identifier: BSD-3-Clause
//
// The operations that an algorithm of dynamics/ may use on a scalar.
//
//   template <class T> T smooth_abs(const T& x) { return sqrt(x * x + T(1e-6)); }   // unqualified calls
//   template <class T> T relu(const T& x) { return select(x > T(0), x, T(0)); }     // no `if` on a T
//
// Every algorithm is a template on the scalar T: double, float, a 113-bit float, a recording scalar, a pack of
// lanes.  Call mathematical functions unqualified: the declarations below are for built-in floats, with the sines of own_sines.h;
// other scalars use argument-dependent lookup.  A decision on a value of type T is `select`, never `if`, so that a recording has both
// sides.  A decision on the structure of a robot is an `if` on plain data.
#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <type_traits>

#include <dyntape/autodiff/own_sines.h>
#include <dyntape/dynamics/algebra/vec3.h>

// Compiles a function template of dynamics/ for T; overloaded ones are listed in full (instantiate.h).
#define DYNTAPE_COMPILE(function, T, ...) \
  __VA_ARGS__ template decltype(dyntape::dynamics::function<T>) dyntape::dynamics::function<T>;

// For built-in floats the library has the code: a unit that includes the file, possibly with other flags, uses the
// library's and emits none.
#define DYNTAPE_DECLARE_BUILT_IN(instantiate) instantiate(double, extern) instantiate(float, extern)

namespace dyntape::dynamics {

using own::cos;
using own::sin;
using own::sincos;
using std::abs;
using std::acos;
using std::asin;
using std::atan;
using std::atan2;
using std::exp;
using std::log;
using std::sqrt;
using std::tan;
using std::tanh;

// a if the condition holds, else b; for scalars whose comparisons are plain bools.  Accepts bool only, without
// conversion: a recorded condition without its own `select` must not compile.
template <class C, class T>
requires std::same_as<C, bool> T select(C condition, const T& a, const T& b) { return condition ? a : b; }

// Both at once; a scalar that computes both for the cost of one defines its own.
template <class T>
void sincos(const T& x, T& sine, T& cosine) {
  sine = sin(x);
  cosine = cos(x);
}

// Binary digits that a series must resolve for T; scalars that wrap double do not specialise numeric_limits.
template <class T>
inline constexpr int kDigits = std::numeric_limits<T>::digits > 0 ? std::numeric_limits<T>::digits : 53;

template <class T>
using Vector4 = Eigen::Matrix<T, 4, 1>;
template <class T>
using Vector6 = Eigen::Matrix<T, 6, 1>;
template <class T>
using Matrix6 = Eigen::Matrix<T, 6, 6>;
template <class T>
using VectorX = Eigen::Matrix<T, Eigen::Dynamic, 1>;
template <class T>
using MatrixX = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;
template <class T>
using Matrix6X = Eigen::Matrix<T, 6, Eigen::Dynamic>;

// A vector argument: any contiguous Eigen vector, without copy.  The scalar is deduced from the model.
template <class T>
using VectorRef = std::type_identity_t<Eigen::Ref<const VectorX<T>>>;

}  // namespace dyntape::dynamics
