// SPDX-License-Identifier: BSD-3-Clause
//
// A pack of lanes: N numbers that go through the same operations side by side, in one vector register.
//
//   Pack8 x = Pack8::load(angles);                       // eight states at once
//   Pack8 y = select(x < 0.0, -x, x) * sin(x);           // a decision is a selection, lane by lane
//   y.store(results);
//
// A template of dynamics/ that runs on double runs on packs (pack_eigen.h makes them a scalar of Eigen) and
// evaluates N states for little more than the price of one, without generating anything.
//
// Bits.  Every lane computes what Pack<double, 1> computes, whatever N is and whatever the other lanes hold:
// arithmetic and sqrt are IEEE's, nothing is contracted, and the elementary functions are the portable ones
// (portable.h; within 1 ulp): sine and cosine are those of every route, the others differ from the C library's in the
// last bit now and then.  A NaN stays in its lane.
//
// Comparisons give a Mask, which does not convert to bool: `if (x < y)` does not compile, for lanes may
// disagree.  any(mask) and all(mask) ask.
//
// Storage.  A pack is aligned to its size; C++17's new and std::vector keep to that.  N is 1, 2, 4 or 8; where the
// processor's registers are shorter, a pack is two halves, and each half is one register or two halves again.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include <dyntape/autodiff/graph/composed.h>
#include <dyntape/autodiff/own_sines.h>
#include <dyntape/autodiff/processor.h>
#include <dyntape/autodiff/scalars/portable.h>

#if defined(__SSE2__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace dyntape {
namespace detail {
inline namespace DYNTAPE_VECTORS {

template <class Entry, int N>
struct Halves;

// What holds N entries: a register, or two halves.
template <class Entry, int N>
struct Lanes {
  using Type [[gnu::vector_size(sizeof(Entry) * N)]] = Entry;
};
template <class Entry, int N>
requires(sizeof(Entry) * N > DYNTAPE_REGISTER) struct Lanes<Entry, N> {
  using Type = Halves<Entry, N>;
};

// The same bits as another vector.
template <class To, class From>
To bits_as(const From& x) {
  static_assert(sizeof(To) == sizeof(From));
  if constexpr (requires { x.low; }) {
    using Half = typename To::Half;
    return {bits_as<Half>(x.low), bits_as<Half>(x.high)};
  } else {
    return reinterpret_cast<To>(x);
  }
}

// Halves do what registers do, in the compiler's notation.
template <class Entry, int N>
struct alignas(sizeof(Entry) * N) Halves {
  using Half = typename Lanes<Entry, N / 2>::Type;
  Half low, high;

  Entry operator[](int lane) const { return lane < N / 2 ? low[lane] : high[lane - N / 2]; }

  friend Halves operator-(Entry a, const Halves& b) { return {a - b.low, a - b.high}; }
  friend Halves operator-(const Halves& a, Entry b) { return {a.low - b, a.high - b}; }
  friend Halves operator-(const Halves& a) { return {-a.low, -a.high}; }
  friend Halves operator~(const Halves& a) { return {~a.low, ~a.high}; }
#define DYNTAPE_BOTH(op) \
  friend Halves operator op(const Halves& a, const Halves& b) { return {a.low op b.low, a.high op b.high}; }
  DYNTAPE_BOTH(+)
  DYNTAPE_BOTH(-)
  DYNTAPE_BOTH(*)
  DYNTAPE_BOTH(/)
  DYNTAPE_BOTH(&)
  DYNTAPE_BOTH(|)
#undef DYNTAPE_BOTH
#define DYNTAPE_BOTH(op)                                                         \
  friend Halves<std::int64_t, N> operator op(const Halves& a, const Halves& b) { \
    using Truth = typename Halves<std::int64_t, N>::Half;                        \
    return {bits_as<Truth>(a.low op b.low), bits_as<Truth>(a.high op b.high)};   \
  }
  DYNTAPE_BOTH(<)
  DYNTAPE_BOTH(<=)
  DYNTAPE_BOTH(>)
  DYNTAPE_BOTH(>=)
  DYNTAPE_BOTH(==)
  DYNTAPE_BOTH(!=)
#undef DYNTAPE_BOTH
};

template <class Vector, class Entry>
void set_lane(Vector& v, int lane, Entry x) {
  if constexpr (requires { v.low; }) {
    constexpr int half = sizeof v.low / sizeof x;
    lane < half ? set_lane(v.low, lane, x) : set_lane(v.high, lane - half, x);
  } else {
    v[lane] = x;
  }
}

}  // namespace DYNTAPE_VECTORS
}  // namespace detail

inline namespace DYNTAPE_VECTORS {

template <class Real, int N>
class Pack;

// The outcome of a comparison, a truth value a lane.
template <int N>
class Mask {
 public:
  using Bits = typename detail::Lanes<std::int64_t, N>::Type;  // 0 or -1

  Mask() = default;
  explicit Mask(const Bits& bits) : bits_(bits) {}
  explicit Mask(bool everywhere) : bits_(Bits{} - std::int64_t{everywhere}) {}
  template <class Other>
  Mask(Other) = delete;  // NOLINT: not from numbers

  const Bits& bits() const { return bits_; }
  bool operator[](int lane) const { return bits_[lane] != 0; }

  friend Mask operator!(const Mask& a) { return Mask(Bits(~a.bits_)); }
  friend Mask operator&&(const Mask& a, const Mask& b) { return Mask(Bits(a.bits_ & b.bits_)); }
  friend Mask operator||(const Mask& a, const Mask& b) { return Mask(Bits(a.bits_ | b.bits_)); }
  friend Mask operator&&(const Mask& a, bool b) { return a && Mask(b); }
  friend Mask operator||(const Mask& a, bool b) { return a || Mask(b); }
  friend Mask operator&&(bool a, const Mask& b) { return Mask(a) && b; }
  friend Mask operator||(bool a, const Mask& b) { return Mask(a) || b; }

  friend bool any(const Mask& a) {
    for (int i = 0; i < N; ++i) {
      if (a[i]) return true;
    }
    return false;
  }
  friend bool all(const Mask& a) { return !any(!a); }

 private:
  Bits bits_;
};

template <int N>
class Pack<double, N> {
 public:
  static_assert(N == 1 || N == 2 || N == 4 || N == 8, "a pack has 1, 2, 4 or 8 lanes");
  static constexpr int kLanes = N;
  using Vector = typename detail::Lanes<double, N>::Type;
  using Truth = dyntape::Mask<N>;

  Pack() = default;
  Pack(double everywhere) : v_(everywhere - Vector{}) {}  // NOLINT: constants mix with packs; -0 stays -0
  explicit Pack(const Vector& v) : v_(v) {}

  // N neighbouring numbers, of any alignment.
  static Pack load(const double* x) {
    Pack p;
    std::memcpy(&p.v_, x, sizeof p.v_);
    return p;
  }
  void store(double* x) const { std::memcpy(x, &v_, sizeof v_); }

  const Vector& vector() const { return v_; }
  double operator[](int lane) const { return v_[lane]; }
  void set(int lane, double x) { detail::set_lane(v_, lane, x); }

  Pack& operator+=(const Pack& b) { return *this = *this + b; }
  Pack& operator-=(const Pack& b) { return *this = *this - b; }
  Pack& operator*=(const Pack& b) { return *this = *this * b; }
  Pack& operator/=(const Pack& b) { return *this = *this / b; }

  friend Pack operator+(const Pack& a, const Pack& b) { return Pack(Vector(a.v_ + b.v_)); }
  friend Pack operator-(const Pack& a, const Pack& b) { return Pack(Vector(a.v_ - b.v_)); }
  friend Pack operator*(const Pack& a, const Pack& b) { return Pack(Vector(a.v_ * b.v_)); }
  friend Pack operator/(const Pack& a, const Pack& b) { return Pack(Vector(a.v_ / b.v_)); }
  friend Pack operator-(const Pack& a) { return Pack(Vector(-a.v_)); }
  friend Pack operator+(const Pack& a) { return a; }

  friend Truth operator<(const Pack& a, const Pack& b) { return Truth(detail::bits_as<Bits>(a.v_ < b.v_)); }
  friend Truth operator<=(const Pack& a, const Pack& b) { return Truth(detail::bits_as<Bits>(a.v_ <= b.v_)); }
  friend Truth operator>(const Pack& a, const Pack& b) { return Truth(detail::bits_as<Bits>(a.v_ > b.v_)); }
  friend Truth operator>=(const Pack& a, const Pack& b) { return Truth(detail::bits_as<Bits>(a.v_ >= b.v_)); }
  friend Truth operator==(const Pack& a, const Pack& b) { return Truth(detail::bits_as<Bits>(a.v_ == b.v_)); }
  friend Truth operator!=(const Pack& a, const Pack& b) { return Truth(detail::bits_as<Bits>(a.v_ != b.v_)); }

  // a where the condition holds, else b; what the other holds there, a NaN say, does not matter.
  friend Pack select(const Truth& condition, const Pack& a, const Pack& b) {
    if constexpr (kIsWide)
      return by_halves([](const auto&... x) { return select(x...); }, condition, a, b);
    else
      return Pack(Vector(condition.bits() ? a.v_ : b.v_));
  }

  // The names of ops.def that are not <cmath>'s.
  friend Pack min(const Pack& a, const Pack& b) { return select(b < a, b, a); }
  friend Pack max(const Pack& a, const Pack& b) { return select(a < b, b, a); }
  friend Pack azmul(const Pack& a, const Pack& b) { return select(a == Pack(0), Pack(0), a * b); }
  friend Pack fma(const Pack& a, const Pack& b, const Pack& c) { return multiplied_and_added(a, b, c); }
  friend Pack fms(const Pack& a, const Pack& b, const Pack& c) { return multiplied_and_added(a, b, -c); }
  friend Pack fnma(const Pack& a, const Pack& b, const Pack& c) { return multiplied_and_added(-a, b, c); }
  friend Pack fnms(const Pack& a, const Pack& b, const Pack& c) { return multiplied_and_added(-a, b, -c); }
  friend Pack sign(const Pack& a) {
    return select(a > Pack(0), Pack(1), select(a < Pack(0), Pack(-1), Pack(0)));
  }

  friend Pack abs(const Pack& a) {
    return Pack(detail::bits_as<Vector>(detail::bits_as<Bits>(a.v_) & magnitude()));
  }
  friend Pack fabs(const Pack& a) { return abs(a); }
  friend Pack copysign(const Pack& a, const Pack& b) {
    return Pack(detail::bits_as<Vector>((detail::bits_as<Bits>(a.v_) & magnitude()) |
                                        (detail::bits_as<Bits>(b.v_) & ~magnitude())));
  }
  friend Pack sqrt(const Pack& a) { return a.root(); }
  friend Pack floor(const Pack& a) {
    return a.each([](double x) { return std::floor(x); });
  }
  friend Pack ceil(const Pack& a) {
    return a.each([](double x) { return std::ceil(x); });
  }
  friend Pack trunc(const Pack& a) {
    return a.each([](double x) { return std::trunc(x); });
  }
  friend Pack round(const Pack& a) {
    return a.each([](double x) { return std::round(x); });
  }
  friend Pack rint(const Pack& a) {
    return a.each([](double x) { return std::rint(x); });
  }
  friend Pack nearbyint(const Pack& a) { return rint(a); }
  friend Pack fmod(const Pack& a, const Pack& b) {
    Pack r;
    for (int i = 0; i < N; ++i) r.set(i, std::fmod(a[i], b[i]));
    return r;
  }
  friend Pack remainder(const Pack& a, const Pack& b) {
    Pack r;
    for (int i = 0; i < N; ++i) r.set(i, std::remainder(a[i], b[i]));
    return r;
  }
  friend Pack fdim(const Pack& a, const Pack& b) { return ops::positive_difference(a, b); }
  friend Pack hypot(const Pack& a, const Pack& b, const Pack& c) { return ops::length_of_three(a, b, c); }

 private:
  using Bits = typename Truth::Bits;
  static constexpr bool kIsWide = 8 * N > DYNTAPE_REGISTER;

  static Bits magnitude() { return std::numeric_limits<std::int64_t>::max() - Bits{}; }  // all but the sign

  static auto low(const Pack& a) { return Pack<double, N / 2>(a.v_.low); }
  static auto low(const Truth& a) { return dyntape::Mask<N / 2>(a.bits().low); }
  static auto high(const Pack& a) { return Pack<double, N / 2>(a.v_.high); }
  static auto high(const Truth& a) { return dyntape::Mask<N / 2>(a.bits().high); }
  template <class F, class... Args>
  static Pack by_halves(F f, const Args&... args) {
    return Pack(Vector{f(low(args)...).vector(), f(high(args)...).vector()});
  }

  template <class F>
  Pack each(F f) const {
    Pack r;
    for (int i = 0; i < N; ++i) r.set(i, f(v_[i]));
    return r;
  }

  static Pack multiplied_and_added(const Pack& a, const Pack& b, const Pack& c) {
    if constexpr (kIsWide) return by_halves([](const auto&... x) { return fma(x...); }, a, b, c);
#if defined(DYNTAPE_HAS_AVX512F)
    if constexpr (N == 8) return Pack(_mm512_fmadd_pd(a.v_, b.v_, c.v_));
#endif
#if defined(DYNTAPE_HAS_FMA)
    if constexpr (N == 4) return Pack(_mm256_fmadd_pd(a.v_, b.v_, c.v_));
    if constexpr (N == 2) return Pack(_mm_fmadd_pd(a.v_, b.v_, c.v_));
#elif defined(__aarch64__)
    if constexpr (N == 2) return Pack(vfmaq_f64(c.v_, a.v_, b.v_));
#endif
    Pack r;
    for (int i = 0; i < N; ++i) r.set(i, std::fma(a[i], b[i], c[i]));
    return r;
  }

  Pack root() const {
    if constexpr (kIsWide) return by_halves([](const auto& x) { return sqrt(x); }, *this);
#if defined(DYNTAPE_HAS_AVX512F)
    if constexpr (N == 8) return Pack(_mm512_mask_sqrt_pd(v_, 0xff, v_));  // gcc 12 warns of the plain one
#endif
#if defined(DYNTAPE_HAS_AVX)
    if constexpr (N == 4) return Pack(_mm256_sqrt_pd(v_));
#endif
#if defined(__SSE2__)
    if constexpr (N == 2) return Pack(_mm_sqrt_pd(v_));
#elif defined(__aarch64__)
    if constexpr (N == 2) return Pack(vsqrtq_f64(v_));
#endif
    return each([](double x) { return std::sqrt(x); });
  }

  Vector v_;
};

}  // namespace DYNTAPE_VECTORS

using Pack4 = Pack<double, 4>;
using Pack8 = Pack<double, 8>;

namespace detail {

// Elementary functions of n lanes, n = 1, 2, 4 or 8.  By address, so that no vector crosses a boundary between
// units that may have been compiled for different processors.
#define OP(...)
#define FN(...)
#define LIBM(ulp, name, fn, n, ...) DYNTAPE_DECLARE_##n(fn)
#define DYNTAPE_DECLARE_1(fn) void pack_##fn(const double* x, double* y, int n);
#define DYNTAPE_DECLARE_2(fn) void pack_##fn(const double* x, const double* y, double* z, int n);
#include <dyntape/autodiff/graph/ops.def>
#undef DYNTAPE_DECLARE_1
#undef DYNTAPE_DECLARE_2

}  // namespace detail

#define DYNTAPE_DEFINE_1(fn)                     \
  template <int N>                               \
  Pack<double, N> fn(const Pack<double, N>& x) { \
    alignas(8 * N) double in[N], out[N];         \
    x.store(in);                                 \
    detail::pack_##fn(in, out, N);               \
    return Pack<double, N>::load(out);           \
  }
#define DYNTAPE_DEFINE_2(fn)                                               \
  template <int N>                                                         \
  Pack<double, N> fn(const Pack<double, N>& x, const Pack<double, N>& y) { \
    alignas(8 * N) double a[N], b[N], out[N];                              \
    x.store(a);                                                            \
    y.store(b);                                                            \
    detail::pack_##fn(a, b, out, N);                                       \
    return Pack<double, N>::load(out);                                     \
  }                                                                        \
  template <int N>                                                         \
  Pack<double, N> fn(const Pack<double, N>& x, double y) {                 \
    return fn(x, Pack<double, N>(y));                                      \
  }                                                                        \
  template <int N>                                                         \
  Pack<double, N> fn(double x, const Pack<double, N>& y) {                 \
    return fn(Pack<double, N>(x), y);                                      \
  }
#define OP(...)
#define FN(...)
#define LIBM(ulp, name, fn, n, ...) DYNTAPE_DEFINE_##n(fn)
#include <dyntape/autodiff/graph/ops.def>
#undef DYNTAPE_DEFINE_1
#undef DYNTAPE_DEFINE_2

// Both at the price of little more than one.
template <int N>
void sincos(const Pack<double, N>& x, Pack<double, N>& sine, Pack<double, N>& cosine) {
  alignas(8 * N) double in[N], s[N], c[N];
  x.store(in);
  own::sincos(in, s, c, N);
  sine = Pack<double, N>::load(s);
  cosine = Pack<double, N>::load(c);
}

}  // namespace dyntape
