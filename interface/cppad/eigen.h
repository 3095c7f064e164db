// SPDX-License-Identifier: BSD-3-Clause
//
// Makes AD<Base> a scalar of Eigen.  Include Eigen's headers before or after this header, or not at all.
//
//   Eigen::Matrix<CppAD::AD<double>, Eigen::Dynamic, 1> ax(3);
//   ax = 2.0 * ax + Eigen::VectorXd::Ones(3).cast<CppAD::AD<double>>();
#pragma once

#include <dyntape/interface/cppad/conditions.h>

namespace CppAD::inline dyntape_names::detail {
template <class Base>
struct LikeDouble {  // looked up if Eigen is included
  using type = double;
};

// Whether Eigen's objects have the layout of the library (autodiff/eigen_layout.h); Eigen may be included later.
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
template <typename Scalar, int rows, int cols, int options, int max_rows, int max_cols>
class Matrix;

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

// An Eigen column with unsigned sizes and indices, as CppAD requires of vectors.  Needs <Eigen/Core>.
template <class Scalar>
class eigen_vector : public Eigen::Matrix<Scalar, -1, 1, 0, -1, 1> {
  using Column = Eigen::Matrix<Scalar, -1, 1, 0, -1, 1>;

 public:
  eigen_vector() = default;
  explicit eigen_vector(std::size_t n) : Column(std::ptrdiff_t(n)) {}
  Scalar& operator[](std::size_t i) { return Column::operator[](std::ptrdiff_t(i)); }
  const Scalar& operator[](std::size_t i) const { return Column::operator[](std::ptrdiff_t(i)); }
  std::size_t size() const { return std::size_t(Column::size()); }
  void resize(std::size_t n) { Column::resize(std::ptrdiff_t(n)); }
};

// Converts a sparse_rcv to an Eigen::SparseMatrix; keeps entries that are zero.
template <class Sparse, class Matrix>
void sparse2eigen(const Sparse& source, Matrix& destination) {
  using Value = std::remove_cvref_t<decltype(source.val()[0])>;
  struct Entry {
    std::ptrdiff_t i, j;
    Value v;
    std::ptrdiff_t row() const { return i; }
    std::ptrdiff_t col() const { return j; }
    const Value& value() const { return v; }
  };
  vector<Entry> entries(source.nnz());
  for (std::size_t k = 0; k < source.nnz(); ++k)
    entries[k] = {std::ptrdiff_t(source.row()[k]), std::ptrdiff_t(source.col()[k]), source.val()[k]};
  destination.resize(std::ptrdiff_t(source.nr()), std::ptrdiff_t(source.nc()));
  destination.setFromTriplets(entries.data(), entries.data() + entries.size());
}

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

// CppAD's header for Eigen has these.  The constraint prefers them where both namespaces are searched.
namespace std {
template <class Base>
requires CppAD::detail::IsBase<Base>
bool isnan(const CppAD::AD<Base>& x) { return CppAD::isnan(x); }
template <class Base>
requires CppAD::detail::IsBase<Base>
bool isinf(const CppAD::AD<Base>& x) { return CppAD::isinf(x); }
}  // namespace std
