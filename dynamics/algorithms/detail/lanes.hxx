// SPDX-License-Identifier: BSD-3-Clause
//
// Loops with one SIMD instruction for several neighbouring entries.
//
//   over<T>(begin, end, [&](int s, auto lanes) { lanes.store(y + s, lanes.load(x + s) * a); });
//
// Built-in floats are processed kLanes at a time, as many as a register holds, other scalars one by one.  The
// operations on an entry are the same, so results have the same bits.  Arrays (LaneArray) begin and end on whole
// cache lines, for all processors, and a loop runs over whole groups of lanes, so that values are loaded in the
// pieces in which they were stored, which is fast.  `over` may overwrite the neighbours of [begin, end) in its first
// and last group; `over_before` does not change entries from `end` on.
#pragma once

#include <dyntape/autodiff/processor.h>
#include <dyntape/dynamics/algebra/vec3.h>

#include <cstddef>
#include <type_traits>
#include <vector>

namespace dyntape::dynamics::detail {

template <class T>
inline constexpr bool kHasLanes = std::is_same_v<T, double> || std::is_same_v<T, float>;

// Entries per cache line; array sizes are multiples of this.
template <class T>
inline constexpr int kLine = kHasLanes<T> ? 64 / sizeof(T) : 1;

// n rounded up to whole lines.
template <class T>
constexpr std::ptrdiff_t whole_lines(std::ptrdiff_t n) {
  return (n + kLine<T> - 1) / kLine<T> * kLine<T>;
}

inline namespace DYNTAPE_VECTORS {

template <class T>
inline constexpr int kLanes = kHasLanes<T> ? DYNTAPE_REGISTER / sizeof(T) : 1;

template <class T, bool = (kLanes<T> > 1)>
struct Lanes {
  using Vector = T;
  static Vector zero() { return T(0); }
  T load(const T* x) const { return *x; }
  void store(T* x, const T& v) const { *x = v; }
};

template <class T>
struct Lanes<T, true> {
  typedef T Vector __attribute__((vector_size(kLanes<T> * sizeof(T)), may_alias));
  using Index = std::conditional_t<sizeof(T) == 8, long long, int>;
  typedef Index Indices __attribute__((vector_size(kLanes<T> * sizeof(T))));

  static Vector zero() { return Vector{}; }
  Vector load(const T* x) const { return *reinterpret_cast<const Vector*>(x); }
  void store(T* x, const Vector& v) const { *reinterpret_cast<Vector*>(x) = v; }
  static Indices indices() {
    Indices k;
    for (int i = 0; i < kLanes<T>; ++i) k[i] = i;
    return k;
  }
};

// The first `count` of a group.
template <class T>
struct FirstLanes : Lanes<T> {
  using Vector = typename Lanes<T>::Vector;
  explicit FirstLanes(int count) : here(Lanes<T>::indices() < count) {}
  void store(T* x, const Vector& v) const { Lanes<T>::store(x, here ? v : Vector(this->load(x))); }
  typename Lanes<T>::Indices here;
};

// The end of a loop, out of line: if inlined, gcc 12 keeps less of the loop in registers, and crba and
// id_derivatives take 1.2 to 1.5 times as long.
template <class T, class Body>
__attribute__((noinline)) void over_rest(int s, int end, Body& body) {
  body(s, FirstLanes<T>(end - s));
}

}  // namespace DYNTAPE_VECTORS

template <class T>
class LaneArray {
 public:
  explicit LaneArray(std::ptrdiff_t count = 0)
      : lines_(static_cast<std::size_t>(whole_lines<T>(count) / kLine<T>)) {}
  T* data() { return lines_.data()->entries; }
  const T* data() const { return lines_.data()->entries; }

 private:
  struct alignas(kLine<T> * alignof(T)) Line {
    T entries[kLine<T>] = {};
  };
  std::vector<Line> lines_;
};

template <class T, class Body>
DYNTAPE_INLINE void over(int begin, int end, Body body) {
  for (int s = begin / kLanes<T> * kLanes<T>; s < end; s += kLanes<T>) body(s, Lanes<T>());
}

template <class T, class Body>
DYNTAPE_INLINE void over_before(int begin, int end, Body body) {
  int s = begin / kLanes<T> * kLanes<T>;
  for (; s + kLanes<T> <= end; s += kLanes<T>) body(s, Lanes<T>());
  if constexpr (kLanes < T >> 1) {
    if (s < end) over_rest<T>(s, end, body);
  }
}

// The group with its entry `at` replaced; unchanged if the group has no such entry.
template <class T>
DYNTAPE_INLINE typename Lanes<T>::Vector with_lane(const typename Lanes<T>::Vector& group, int at,
                                                   const T& value) {
  if constexpr (kLanes < T >> 1) {
    return Lanes<T>::indices() == at ? typename Lanes<T>::Vector{} + value : group;
  } else {
    return at == 0 ? value : group;
  }
}

// The group with its first `count` entries replaced by zeros, and a one at `one`.
template <class T>
DYNTAPE_INLINE typename Lanes<T>::Vector with_first_lanes(const typename Lanes<T>::Vector& group, int count,
                                                          int one) {
  if constexpr (kLanes < T >> 1) {
    using Vector = typename Lanes<T>::Vector;
    const auto indices = Lanes<T>::indices();
    const Vector unit = indices == one ? Vector{} + T(1) : Vector{};
    return indices < count ? unit : group;
  } else {
    return count <= 0 ? group : one == 0 ? T(1) : T(0);
  }
}

// x[at] = value, stored so that a group can be loaded efficiently.
template <class T>
DYNTAPE_INLINE void put_lane(T* x, int at, const T& value) {
  const Lanes<T> lanes;
  T* group = x + at / kLanes<T> * kLanes<T>;
  lanes.store(group, with_lane<T>(lanes.load(group), at % kLanes<T>, value));
}

}  // namespace dyntape::dynamics::detail
