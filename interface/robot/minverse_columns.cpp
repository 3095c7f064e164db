// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/minverse_columns.h>

#include <cmath>

namespace dyntape {
namespace {

// Rows [first, first + rows) of a column: sums of products in the order of its path.
template <int lanes, bool fused, int rows>
void column(const double* in, int nv, const int* path, int count, const double* d, int first, double* out) {
  double x[rows * lanes];
  const double* m = in + (path[0] * nv + first) * lanes;
  for (int i = 0; i < rows; ++i) {
    for (int l = 0; l < lanes; ++l) x[i * lanes + l] = -(m[i * lanes + l] * d[l]);
  }
  for (int c = 1; c < count; ++c) {
    m = in + (path[c] * nv + first) * lanes;
    d += lanes;
    for (int i = 0; i < rows; ++i) {
      for (int l = 0; l < lanes; ++l) {
        double& sum = x[i * lanes + l];
        sum = fused ? std::fma(-m[i * lanes + l], d[l], sum) : sum - m[i * lanes + l] * d[l];
      }
    }
  }
  for (int i = 0; i < rows; ++i) {
    for (int l = 0; l < lanes; ++l) out[(first + i) * nv * lanes + l] = x[i * lanes + l];
  }
}

// The last group ends with the last row, and may do some rows of the group before once more.
template <int lanes, bool fused>
void columns(const MinverseColumns& of, const double* in, double* out) {
  constexpr int kMost = lanes == 1 ? 32 : 8, kLeast = 8;
  const double* d = in + of.nv * of.nv * lanes;
  for (int block = 0; block < 2; ++block, out += of.nv * of.nv * lanes) {
    for (int j = of.known[block]; j < of.nv; ++j) {
      const int begin = j == 0 ? 0 : of.end[j - 1], count = of.end[j] - begin;
      const auto rows = [&]<int n>(int first) {
        column<lanes, fused, n>(in, of.nv, of.path + begin, count, d, first, out + j * lanes);
      };
      int first = 0;
      for (; first + kMost <= of.nv; first += kMost) rows.template operator()<kMost>(first);
      for (; first + kLeast <= of.nv; first += kLeast) rows.template operator()<kLeast>(first);
      if (first < of.nv) rows.template operator()<kLeast>(of.nv - kLeast);
      d += count * lanes;
    }
  }
}

template <bool fused>
void of_lanes(const MinverseColumns& of, int lanes, const double* in, double* out) {
  if (lanes == 1) return columns<1, fused>(of, in, out);
  if (lanes == 2) return columns<2, fused>(of, in, out);
  if (lanes == 4) return columns<4, fused>(of, in, out);
  columns<8, fused>(of, in, out);
}

}  // namespace

void minverse_columns(const MinverseColumns& of, bool fused, int lanes, const double* in, double* out) {
  fused ? of_lanes<true>(of, lanes, in, out) : of_lanes<false>(of, lanes, in, out);
}

}  // namespace dyntape
