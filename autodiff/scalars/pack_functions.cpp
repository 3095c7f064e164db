// SPDX-License-Identifier: BSD-3-Clause
//
// Elementary functions of packs: sine and cosine of own_sines.h, the others SLEEF's deterministic ones (N. Shibata,
// F. Petrogalli, SLEEF: A Portable Vectorized Library of C Standard Mathematical Functions, IEEE TPDS 2020), which
// have the same bits in 1, 2, 4 and 8 lanes on any processor.  This unit uses the widest registers that it is
// compiled for.
#include <array>

#include <dyntape/autodiff/own_sines.h>
#include <dyntape/autodiff/scalars/pack.h>

// SLEEF declares what the compiler's own macros name.
#if defined(DYNTAPE_HAS_AVX) && !defined(__AVX__)
#define __AVX__ 1
#endif
#if defined(DYNTAPE_HAS_AVX512F) && !defined(__AVX512F__)
#define __AVX512F__ 1
#endif
#include <sleef.h>

namespace dyntape::detail {
namespace {

// Lanes by address to and from what SLEEF takes and gives.
void put(double* y, double x) { *y = x; }
#if defined(__SSE2__)
void put(double* y, const __m128d& x) { _mm_storeu_pd(y, x); }
#endif
#if defined(__aarch64__)
void put(double* y, const float64x2_t& x) { vst1q_f64(y, x); }
#endif
#if defined(DYNTAPE_HAS_AVX)
void put(double* y, const __m256d& x) { _mm256_storeu_pd(y, x); }
#endif
#if defined(DYNTAPE_HAS_AVX512F)
void put(double* y, const __m512d& x) { _mm512_storeu_pd(y, x); }
#endif

}  // namespace

// STEP(lanes, load, suffix) of each instruction set, from the widest; i runs over n lanes.
#if defined(DYNTAPE_HAS_AVX512F)
#define DYNTAPE_STEP_8(STEP, ...) \
  for (; n - i >= 8; i += 8) STEP(8, _mm512_loadu_pd, avx512fnofma, __VA_ARGS__)
#else
#define DYNTAPE_STEP_8(...)
#endif
#if defined(DYNTAPE_HAS_AVX)
#define DYNTAPE_STEP_4(STEP, ...) \
  for (; n - i >= 4; i += 4) STEP(4, _mm256_loadu_pd, avx, __VA_ARGS__)
#else
#define DYNTAPE_STEP_4(...)
#endif
#if defined(__SSE2__)
#define DYNTAPE_STEP_2(STEP, ...) \
  for (; n - i >= 2; i += 2) STEP(2, _mm_loadu_pd, sse2, __VA_ARGS__)
#elif defined(__aarch64__)
#define DYNTAPE_STEP_2(STEP, ...) \
  for (; n - i >= 2; i += 2) STEP(2, vld1q_f64, advsimdnofma, __VA_ARGS__)
#else
#define DYNTAPE_STEP_2(...)
#endif
#define DYNTAPE_STEPS(STEP, ...)     \
  int i = 0;                         \
  DYNTAPE_STEP_8(STEP, __VA_ARGS__); \
  DYNTAPE_STEP_4(STEP, __VA_ARGS__); \
  DYNTAPE_STEP_2(STEP, __VA_ARGS__); \
  for (; i < n; ++i) STEP(1, *, purec, __VA_ARGS__)

#define DYNTAPE_UNARY_STEP(lanes, load, isa, fn, ulp) \
  put(y + i, Sleef_cinz_##fn##d##lanes##_##ulp##isa(load(x + i)));
#define DYNTAPE_BINARY_STEP(lanes, load, isa, fn, ulp) \
  put(z + i, Sleef_cinz_##fn##d##lanes##_##ulp##isa(load(x + i), load(y + i)));

#define DYNTAPE_DEFINE_1(fn, ulp) \
  void pack_##fn(const double* x, double* y, int n) { DYNTAPE_STEPS(DYNTAPE_UNARY_STEP, fn, ulp) }
#define DYNTAPE_DEFINE_2(fn, ulp)                                      \
  void pack_##fn(const double* x, const double* y, double* z, int n) { \
    DYNTAPE_STEPS(DYNTAPE_BINARY_STEP, fn, ulp)                        \
  }

#define OP(...)
#define FN(...)
#define LIBM(ulp, name, fn, n, ...) DYNTAPE_DEFINE_##n(fn, ulp)
#define OWN(...)
#include <dyntape/autodiff/graph/ops.def>

void pack_sin(const double* x, double* y, int n) { own::sin(x, y, n); }
void pack_cos(const double* x, double* y, int n) { own::cos(x, y, n); }

}  // namespace dyntape::detail

namespace dyntape {
namespace {

// The portable function of an operator, with one argument or with two.
struct Portable {
  void (*of_one)(const double*, double*, int) = nullptr;
  void (*of_two)(const double*, const double*, double*, int) = nullptr;
};

constexpr std::array<Portable, kTableOps> kPortable = [] {
  std::array<Portable, kTableOps> table{};
#define OP(...)
#define FN(...)
#define LIBM(ulp, name, fn, n, ...) DYNTAPE_ENTER_##n(table[std::size_t(Op::name)], detail::pack_##fn)
#define DYNTAPE_ENTER_1(row, function) row.of_one = function;
#define DYNTAPE_ENTER_2(row, function) row.of_two = function;
#include <dyntape/autodiff/graph/ops.def>
  return table;
}();

}  // namespace

void portable_values(Op op, const double* x, const double* y, double* result, int n) {
  const Portable& row = kPortable[static_cast<std::size_t>(op)];
  if (row.of_one) row.of_one(x, result, n);
  if (row.of_two) row.of_two(x, y, result, n);
}

}  // namespace dyntape
