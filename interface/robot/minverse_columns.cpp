// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/minverse_columns.h>

#include <algorithm>
#include <cstring>

#include <dyntape/autodiff/processor.h>

namespace dyntape {
namespace {

// What is added up at once: a register, or one number where a register would hold entries of several rows and lanes.
template <int lanes>
constexpr int width() {
  constexpr int of_register = DYNTAPE_REGISTER / 8;
  return lanes == 1 || lanes % of_register == 0 ? of_register : 1;
}

using Register = double __attribute__((vector_size(DYNTAPE_REGISTER), aligned(8), may_alias));

template <bool alone>
struct SumOf {
  typedef Register Type;
};
template <>
struct SumOf<true> {
  typedef double Type;
};

// Rows [first, first + rows) of a column: sums of products in the order of its path.
template <int lanes, int rows>
void column(const double* in, int nv, const int* path, int count, const double* d, int first, double* out) {
  constexpr int w = width<lanes>(), sums = rows * lanes / w, of_row = lanes == 1 ? 1 : lanes / w;
  using Sum = typename SumOf<w == 1>::Type;
  const auto at = [](const double* from, int k) { return *reinterpret_cast<const Sum*>(from + k * w); };
  const auto factor = [&](const double* of, int k) {
    if constexpr (lanes == 1)
      return *of - Sum{};  // keeps the sign of a zero
    else
      return at(of, k % of_row);
  };
  Sum x[sums];
  const double* m = in + (path[0] * nv + first) * lanes;
  for (int k = 0; k < sums; ++k) x[k] = -(at(m, k) * factor(d, k));
  for (int c = 1; c < count; ++c) {
    m = in + (path[c] * nv + first) * lanes;
    d += lanes;
    for (int k = 0; k < sums; ++k) x[k] = x[k] - at(m, k) * factor(d, k);
  }
  double results[rows * lanes];
  std::memcpy(results, x, sizeof results);
  for (int i = 0; i < rows; ++i) std::copy_n(results + i * lanes, lanes, out + (first + i) * nv * lanes);
}

// The last group ends with the last row, and may do some rows of the group before once more.
template <int lanes>
void columns(const MinverseColumns& of, const double* in, double* out) {
  constexpr int kMost = lanes == 1 ? 32 : 8, kLeast = 8;
  const double* d = in + of.nv * of.nv * lanes;
  for (int block = 0; block < 2; ++block, out += of.nv * of.nv * lanes) {
    for (int j = of.known[block]; j < of.nv; ++j) {
      const int begin = j == 0 ? 0 : of.end[j - 1], count = of.end[j] - begin;
      const auto rows = [&]<int n>(int first) {
        column<lanes, n>(in, of.nv, of.path + begin, count, d, first, out + j * lanes);
      };
      int first = 0;
      for (; first + kMost <= of.nv; first += kMost) rows.template operator()<kMost>(first);
      for (; first + kLeast <= of.nv; first += kLeast) rows.template operator()<kLeast>(first);
      if (first < of.nv) rows.template operator()<kLeast>(of.nv - kLeast);
      d += count * lanes;
    }
  }
}

}  // namespace

void minverse_columns(const MinverseColumns& of, int lanes, const double* in, double* out) {
  if (lanes == 1) return columns<1>(of, in, out);
  if (lanes == 2) return columns<2>(of, in, out);
  if (lanes == 4) return columns<4>(of, in, out);
  columns<8>(of, in, out);
}

}  // namespace dyntape
