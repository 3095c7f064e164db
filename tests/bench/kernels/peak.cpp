// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/processor.h>

#include "route.h"

namespace dyntape::bench {
namespace {

#if defined(DYNTAPE_HAS_AVX512F)
constexpr int kWidth = 8;
#elif defined(DYNTAPE_HAS_AVX)
constexpr int kWidth = 4;
#else
constexpr int kWidth = 2;
#endif
typedef double Vector __attribute__((vector_size(kWidth * 8)));

constexpr int kChains = 12;  // more than latency times throughput, fewer than registers
constexpr int kSteps = 100;

// Chains that do not wait for each other, each a product and then a sum: nothing is contracted.
void multiply_and_add(int times) {
  Vector m, b, x0, x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11;
  for (int l = 0; l < kWidth; ++l) m[l] = 0.75, b[l] = 0.25;
  x0 = x1 = x2 = x3 = x4 = x5 = x6 = x7 = x8 = x9 = x10 = x11 = b;
  for (int i = 0; i < times * kSteps; ++i) {
    x0 = x0 * m + b, x1 = x1 * m + b, x2 = x2 * m + b, x3 = x3 * m + b;
    x4 = x4 * m + b, x5 = x5 * m + b, x6 = x6 * m + b, x7 = x7 * m + b;
    x8 = x8 * m + b, x9 = x9 * m + b, x10 = x10 * m + b, x11 = x11 * m + b;
    asm volatile("" : "+x"(x0), "+x"(x1), "+x"(x2), "+x"(x3), "+x"(x4), "+x"(x5));  // each step is needed
    asm volatile("" : "+x"(x6), "+x"(x7), "+x"(x8), "+x"(x9), "+x"(x10), "+x"(x11));
  }
}

}  // namespace

Route peak_route() {
  Route route;
  route.name = "multiply and add";
  route.operations = std::size_t{2} * kChains * kWidth * kSteps;
  route.run = [](int, int calls) { multiply_and_add(calls); };
  route.note = std::to_string(kWidth) + " doubles in a register";
  return route;
}

}  // namespace dyntape::bench
