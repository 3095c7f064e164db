// SPDX-License-Identifier: BSD-3-Clause
//
// Eigen's traits of AD; factorisations are in eigen.h.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <type_traits>

#include <dyntape/autodiff/eigen_layout.h>
#include <dyntape/autodiff/record/scalar.h>

namespace dyntape {
using VectorXad = Eigen::Matrix<AD, Eigen::Dynamic, 1>;
using MatrixXad = Eigen::Matrix<AD, Eigen::Dynamic, Eigen::Dynamic>;
}  // namespace dyntape

template <>
struct std::numeric_limits<dyntape::AD> : std::numeric_limits<double> {};

namespace Eigen {

template <>
struct NumTraits<dyntape::AD> : NumTraits<double> {
  using Real = dyntape::AD;
  using NonInteger = dyntape::AD;
  using Nested = dyntape::AD;
  using Literal = double;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1,  // costs as of double: Eigen then unrolls, and so sums, in the same order
    AddCost = 1,
    MulCost = 1
  };
  static Real epsilon() { return NumTraits<double>::epsilon(); }
  static Real dummy_precision() { return NumTraits<double>::dummy_precision(); }
  static Real highest() { return NumTraits<double>::highest(); }
  static Real lowest() { return NumTraits<double>::lowest(); }
};

template <typename BinaryOp>
struct ScalarBinaryOpTraits<dyntape::AD, double, BinaryOp> {
  using ReturnType = dyntape::AD;
};
template <typename BinaryOp>
struct ScalarBinaryOpTraits<double, dyntape::AD, BinaryOp> {
  using ReturnType = dyntape::AD;
};

namespace internal {
template <typename Number>
requires std::is_arithmetic_v<Number>
struct cast_impl<dyntape::AD, Number> {
  static Number run(const dyntape::AD& x) { return static_cast<Number>(x.value()); }
};
}  // namespace internal

}  // namespace Eigen
