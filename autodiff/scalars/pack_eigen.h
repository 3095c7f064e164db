// SPDX-License-Identifier: BSD-3-Clause
//
// Makes Pack a scalar of Eigen.
//
//   Eigen::Matrix<Pack<double, 8>, 3, 3> R;     // eight rotations; sums run in the same order in every lane
//
// Matrices of packs take their memory from C++'s aligned new: Eigen's own heap aligns to 16 bytes (eigen_layout.h),
// a pack needs up to 64.  Every product is computed entry by entry.  Eigen's blocked kernels would put unaligned
// scalars on the stack, and their block sizes, hence the order of a sum, depend on the size of the scalar.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <new>

#include <dyntape/autodiff/eigen_layout.h>
#include <dyntape/autodiff/scalars/pack.h>

template <int N>
struct std::numeric_limits<dyntape::Pack<double, N>> : std::numeric_limits<double> {};

namespace Eigen {

template <int N>
struct NumTraits<dyntape::Pack<double, N>> : NumTraits<double> {
  using Real = dyntape::Pack<double, N>;
  using NonInteger = Real;
  using Nested = Real;
  using Literal = double;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 0,
    ReadCost = 1,  // costs as of double: Eigen unrolls and sums in the same order
    AddCost = 1,
    MulCost = 1
  };
  static Real epsilon() { return NumTraits<double>::epsilon(); }
  static Real dummy_precision() { return NumTraits<double>::dummy_precision(); }
  static Real highest() { return NumTraits<double>::highest(); }
  static Real lowest() { return NumTraits<double>::lowest(); }
};

template <int N, typename BinaryOp>
struct ScalarBinaryOpTraits<dyntape::Pack<double, N>, double, BinaryOp> {
  using ReturnType = dyntape::Pack<double, N>;
};
template <int N, typename BinaryOp>
struct ScalarBinaryOpTraits<double, dyntape::Pack<double, N>, BinaryOp> {
  using ReturnType = dyntape::Pack<double, N>;
};

namespace internal {

template <class Scalar>
inline constexpr bool is_pack = false;
template <int N>
inline constexpr bool is_pack<dyntape::Pack<double, N>> = true;

// Selects the kernel of a product as if all sizes were small.
template <typename Lhs, typename Rhs>
requires is_pack<typename remove_all<Lhs>::type::Scalar> || is_pack<typename remove_all<Rhs>::type::Scalar>
struct product_type<Lhs, Rhs> {
  using L = traits<typename remove_all<Lhs>::type>;
  using R = traits<typename remove_all<Rhs>::type>;
  enum {
    rows = L::RowsAtCompileTime == 1 ? 1 : Small,
    cols = R::ColsAtCompileTime == 1 ? 1 : Small,
    depth = L::ColsAtCompileTime == 1 || R::RowsAtCompileTime == 1 ? 1 : Small,
    value = product_type_selector<rows, cols, depth>::ret,
    ret = value
  };
};

// Memory of fixed matrices: Eigen would align them to 16 bytes, less than a pack needs.
template <int N, int Size, int Options>
requires(Size > 0) struct plain_array<dyntape::Pack<double, N>, Size, Options, 16> {
  dyntape::Pack<double, N> array[Size];
  plain_array() = default;
  explicit plain_array(constructor_without_unaligned_array_assert) {}
};

// Memory of dynamic matrices.
#define DYNTAPE_PACK_MEMORY(N)                                                                              \
  template <>                                                                                               \
  inline dyntape::Pack<double, N>* conditional_aligned_new_auto<dyntape::Pack<double, N>, true>(            \
      std::size_t size) {                                                                                   \
    using Scalar = dyntape::Pack<double, N>;                                                                \
    if (size == 0) return nullptr;                                                                          \
    check_size_for_overflow<Scalar>(size);                                                                  \
    check_that_malloc_is_allowed();                                                                         \
    return static_cast<Scalar*>(::operator new (size * sizeof(Scalar), std::align_val_t{alignof(Scalar)})); \
  }                                                                                                         \
  template <>                                                                                               \
  inline void conditional_aligned_delete_auto<dyntape::Pack<double, N>, true>(dyntape::Pack<double, N> * p, \
                                                                              std::size_t) {                \
    ::operator delete (p, std::align_val_t{alignof(dyntape::Pack<double, N>)});                             \
  }                                                                                                         \
  template <>                                                                                               \
  inline dyntape::Pack<double, N>* conditional_aligned_realloc_new_auto<dyntape::Pack<double, N>, true>(    \
      dyntape::Pack<double, N> * p, std::size_t size, std::size_t old) {                                    \
    using Scalar = dyntape::Pack<double, N>;                                                                \
    Scalar* q = conditional_aligned_new_auto<Scalar, true>(size);                                           \
    std::copy(p, p + (size < old ? size : old), q);                                                         \
    conditional_aligned_delete_auto<Scalar, true>(p, old);                                                  \
    return q;                                                                                               \
  }
DYNTAPE_PACK_MEMORY(1)
DYNTAPE_PACK_MEMORY(2)
DYNTAPE_PACK_MEMORY(4)
DYNTAPE_PACK_MEMORY(8)
#undef DYNTAPE_PACK_MEMORY

}  // namespace internal
}  // namespace Eigen
