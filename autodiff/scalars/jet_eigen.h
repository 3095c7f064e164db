// SPDX-License-Identifier: BSD-3-Clause
//
// Makes Jet a scalar of Eigen.
#pragma once

#include <Eigen/Core>
#include <limits>

#include <dyntape/autodiff/eigen_layout.h>
#include <dyntape/autodiff/scalars/jet.h>

template <class T, int N>
struct std::numeric_limits<dyntape::Jet<T, N>> : std::numeric_limits<T> {};

namespace Eigen {

template <class T, int N>
struct NumTraits<dyntape::Jet<T, N>> : NumTraits<T> {
  using Real = dyntape::Jet<T, N>;
  using NonInteger = Real;
  using Nested = Real;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1,  // costs as of double: Eigen unrolls and sums in the same order
    AddCost = 1,
    MulCost = 1
  };
  static Real epsilon() { return NumTraits<T>::epsilon(); }
  static Real dummy_precision() { return NumTraits<T>::dummy_precision(); }
  static Real highest() { return NumTraits<T>::highest(); }
  static Real lowest() { return NumTraits<T>::lowest(); }
};

template <class T, int N, typename BinaryOp>
struct ScalarBinaryOpTraits<dyntape::Jet<T, N>, double, BinaryOp> {
  using ReturnType = dyntape::Jet<T, N>;
};
template <class T, int N, typename BinaryOp>
struct ScalarBinaryOpTraits<double, dyntape::Jet<T, N>, BinaryOp> {
  using ReturnType = dyntape::Jet<T, N>;
};

}  // namespace Eigen
