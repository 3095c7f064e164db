// SPDX-License-Identifier: BSD-3-Clause
//
// Pinocchio's templates on the recording scalar.  Include this header instead of pinocchio/autodiff/cppad.hpp,
// before the headers of Pinocchio's algorithms.
//
//   using Scalar = CppAD::AD<double>;
//   const pinocchio::ModelTpl<Scalar> recorded = model.cast<Scalar>();
//   pinocchio::DataTpl<Scalar> data(recorded);
//   CppAD::Independent(ax);
//   const Vector tau = pinocchio::rnea(recorded, data, q, v, a);
//   CppAD::ADFun<double> f(ax, tau);
//
// Pinocchio's choices between values are recorded as conditions: integrate, difference and free flyers leave no
// guard.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <boost/math/constants/constants.hpp>

#include <dyntape/interface/cppad/cppad.h>

#if __has_include(<pinocchio/math.hpp>)
#include <pinocchio/math.hpp>
#else  // before Pinocchio 4
#include <pinocchio/math/fwd.hpp>
#endif
#include <pinocchio/utils/static-if.hpp>

namespace Eigen::internal {

template <class Base>
struct cast_impl<CppAD::AD<Base>, Base> {
  static Base run(const CppAD::AD<Base>& x) { return CppAD::Value(x); }
};

}  // namespace Eigen::internal

namespace boost::math::constants::detail {

template <class Base>
struct constant_pi<CppAD::AD<Base>> : constant_pi<Base> {
  template <class Digits>
  static CppAD::AD<Base> get(const Digits& digits) {
    return CppAD::AD<Base>(constant_pi<Base>::get(digits));
  }
};

}  // namespace boost::math::constants::detail

namespace pinocchio {

template <class Base>
struct TaylorSeriesExpansion<CppAD::AD<Base>> : TaylorSeriesExpansion<Base> {
  template <int degree>
  static CppAD::AD<Base> precision() {
    return CppAD::AD<Base>(TaylorSeriesExpansion<Base>::template precision<degree>());
  }
};

template <class To, class Base>
struct ScalarCast<To, CppAD::AD<Base>> {
  static To cast(const CppAD::AD<Base>& x) { return scalar_cast<To>(CppAD::Value(x)); }
};

namespace internal {

template <class Base, class Then, class Else>
struct if_then_else_impl<CppAD::AD<Base>, CppAD::AD<Base>, Then, Else> {
  using S = CppAD::AD<Base>;
  using ReturnType = S;
  static S run(ComparisonOperators op, const S& left, const S& right, const Then& if_true,
               const Else& if_false) {
    using namespace CppAD;
    constexpr CompareOp kRelations[] = {CompareLt, CompareLe, CompareEq, CompareGe,
                                        CompareGt};  // as Pinocchio numbers them
    static_assert(LT == 0 && LE == 1 && EQ == 2 && GE == 3 && GT == 4);
    return CondExpOp(kRelations[op], left, right, S(if_true), S(if_false));
  }
};

#if __has_include(<pinocchio/math.hpp>)
// Inverts symmetric matrices by formulas, without pivots.
template <class Base, int Rows, int Cols, int Options, int MaxRows, int MaxCols>
struct MatrixInversion<Eigen::Matrix<CppAD::AD<Base>, Rows, Cols, Options, MaxRows, MaxCols>, false>
    : MatrixInversionImpl<Rows, Cols> {};
#endif

}  // namespace internal
}  // namespace pinocchio
