// SPDX-License-Identifier: BSD-3-Clause
//
// Compiled for several levels of the processor; a unit of its own, because sines.h defines macros.
#include <dyntape/autodiff/own_sines.h>
#include <dyntape/autodiff/processor.h>
#include <stdint.h>

#include <cstring>
#include <type_traits>

#if defined(DYNTAPE_HAS_AVX512F)
#define DT_WIDTH 8
#elif defined(DYNTAPE_HAS_AVX)
#define DT_WIDTH 4
#else
#define DT_WIDTH 2
#endif

namespace dyntape::own {
namespace {

#include <dyntape/autodiff/scalars/sines.h>
typedef double dt_vector __attribute__((vector_size(8 * DT_WIDTH)));
typedef int64_t dt_vector_words __attribute__((vector_size(8 * DT_WIDTH)));
#include <dyntape/autodiff/scalars/sines_in_lanes.h>

// Computes the results whose pointers are not null.  Lanes beyond the last number are zero.
template <class Sine, class Cosine>
void in_lanes(const double* x, Sine sine, Cosine cosine, int n) {
  for (int i = 0; i < n; i += DT_WIDTH) {
    const auto copy = [left = n - i](void* to, const void* from) {
      if (left >= DT_WIDTH)
        std::memcpy(to, from, sizeof(dt_vector));
      else
        std::memcpy(to, from, sizeof(double) * std::size_t(left));
    };
    dt_vector values = {}, s, c;
    copy(&values, x + i);
    dt_turn(values, &s, &c);
    if constexpr (!std::is_null_pointer_v<Sine>) copy(sine + i, &s);
    if constexpr (!std::is_null_pointer_v<Cosine>) copy(cosine + i, &c);
  }
}

}  // namespace

void sin(const double* x, double* sine, int n) {
  if (n > 1) return in_lanes(x, sine, nullptr, n);
  if (n == 1) *sine = dt_circular(*x, 0u);
}

void cos(const double* x, double* cosine, int n) {
  if (n > 1) return in_lanes(x, nullptr, cosine, n);
  if (n == 1) *cosine = dt_circular(*x, 1u);
}

void sincos(const double* x, double* sine, double* cosine, int n) {
  if (n > 1) return in_lanes(x, sine, cosine, n);
  if (n == 1) dt_circle(*x, sine, cosine);
}

}  // namespace dyntape::own
