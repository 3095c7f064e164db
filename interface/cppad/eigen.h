// SPDX-License-Identifier: BSD-3-Clause
//
// AD<Base> as a scalar of Eigen, before or after Eigen's headers, and without them for those who do not use it.
//
//   Eigen::Matrix<CppAD::AD<double>, Eigen::Dynamic, 1> ax(3);
//   ax = 2.0 * ax + Eigen::VectorXd::Ones(3).cast<CppAD::AD<double>>();
#pragma once

#include <dyntape/interface/cppad/ad.h>

namespace CppAD::inline dyntape_names::detail {
template <class Base>
struct LikeDouble {  // looked up when Eigen is there
  using type = double;
};

// Eigen's objects of this unit are those of the library (autodiff/eigen_layout.h); Eigen may come later.
#if defined(EIGEN_MAX_STATIC_ALIGN_BYTES)
inline constexpr bool kSharesLayout = EIGEN_MAX_STATIC_ALIGN_BYTES <= 16;
#elif defined(__AVX__) && !defined(EIGEN_MAX_ALIGN_BYTES)
inline constexpr bool kSharesLayout = false;
#else
inline constexpr bool kSharesLayout = true;
#endif
}  // namespace CppAD::inline dyntape_names::detail

namespace Eigen {

template <typename T>
struct NumTraits;
template <typename A, typename B, typename BinaryOp>
struct ScalarBinaryOpTraits;

template <class Base>
struct NumTraits<CppAD::AD<Base>> : NumTraits<typename CppAD::detail::LikeDouble<Base>::type> {
  static_assert(
      sizeof(Base) > 0 && CppAD::detail::kSharesLayout,
      "this unit's flags (-march, -mavx) give Eigen another allocator than dyntape's, which is a plain "
      "build's: compile it without them, or link dyntape::dyntape_native");
  using S = CppAD::AD<Base>;
  using Real = S;
  using NonInteger = S;
  using Nested = S;
  using Literal = double;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1,
    AddCost = 1,
    MulCost = 1
  };
  static S epsilon() { return S(std::numeric_limits<double>::epsilon()); }
  static S dummy_precision() { return S(1e-12); }
  static S highest() { return S((std::numeric_limits<double>::max)()); }
  static S lowest() { return S(std::numeric_limits<double>::lowest()); }
  static S infinity() { return S(std::numeric_limits<double>::infinity()); }
  static S quiet_NaN() { return S(std::numeric_limits<double>::quiet_NaN()); }
};

template <class Base, typename BinaryOp>
struct ScalarBinaryOpTraits<CppAD::AD<Base>, double, BinaryOp> {
  using ReturnType = CppAD::AD<Base>;
};
template <class Base, typename BinaryOp>
struct ScalarBinaryOpTraits<double, CppAD::AD<Base>, BinaryOp> {
  using ReturnType = CppAD::AD<Base>;
};

}  // namespace Eigen

namespace CppAD::inline dyntape_names {

template <class Base>
const AD<Base>& conj(const AD<Base>& x) {
  return x;
}
template <class Base>
const AD<Base>& real(const AD<Base>& x) {
  return x;
}
template <class Base>
AD<Base> imag(const AD<Base>&) {
  return AD<Base>(0);
}
template <class Base>
AD<Base> abs2(const AD<Base>& x) {
  return x * x;
}

}  // namespace CppAD::inline dyntape_names
