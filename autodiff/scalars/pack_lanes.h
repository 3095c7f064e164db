// SPDX-License-Identifier: BSD-3-Clause
//
// Copies states between memory and packs: lane k of a pack is an entry of state k.  States lie one after the other
// in memory.
//
//   Pack8 x[7];
//   gather_lanes(states, 7, 8, x, 7);        // x[i] lane k: entry i of state k; state k starts at states + 7 k
//   scatter_lanes(x, 7, results, 7, 8);      // and back
//
// Transposes N x N entries at a time in registers, in log2 N rounds of exchanges between pairs of rows.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include <dyntape/autodiff/scalars/pack.h>

namespace dyntape {
namespace detail {

// Exchanges the off-diagonal halves of each 2h x 2h block of the rows a and b = a + h.
template <int H, int N, std::size_t... J>
[[gnu::always_inline]] inline void exchange(Pack<double, N>& a, Pack<double, N>& b,
                                            std::index_sequence<J...>) {
  const auto u = a.vector(), v = b.vector();
  a = Pack<double, N>(__builtin_shufflevector(u, v, (J & H ? N + J - H : J)...));
  b = Pack<double, N>(__builtin_shufflevector(u, v, (J & H ? N + J : J + H)...));
}

// Inlined and unrolled, so that the rows stay in registers.
template <int N, int H = N / 2>
[[gnu::always_inline]] inline void transpose(Pack<double, N>* rows) {
  if constexpr (H > 0) {
#pragma GCC unroll 8
    for (int i = 0; i < N; ++i) {
      if (!(i & H)) exchange<H>(rows[i], rows[i + H], std::make_index_sequence<N>());
    }
    transpose<N, H / 2>(rows);
  }
}

// A row from two halves in memory.
#if defined(DYNTAPE_HAS_AVX512F)
[[gnu::always_inline]] inline Pack<double, 8> joined(const double* low, const double* high) {
  // In the compiler's notation gcc 12 reads all of both rows and shuffles; without a mask it warns.
  const __m512d row = _mm512_castpd256_pd512(_mm256_loadu_pd(low));
  return Pack<double, 8>(_mm512_maskz_insertf64x4(0xff, row, _mm256_loadu_pd(high), 1));
}
#endif

// Loads and transposes the rows at N addresses, row(k).  If N = 8, loads half rows: this replaces the first round of
// exchanges, and does not use the processor's single shuffle unit.
template <int N, class Row>
[[gnu::always_inline]] inline void load_transposed_rows(Row&& row, Pack<double, N>* rows) {
#if defined(DYNTAPE_HAS_AVX512F)
  if constexpr (N == 8) {
#pragma GCC unroll 4
    for (int k = 0; k < 4; ++k) {
      rows[k] = joined(row(k), row(k + 4));
      rows[k + 4] = joined(row(k) + 4, row(k + 4) + 4);
    }
    return transpose<8, 2>(rows);
  }
#endif
#pragma GCC unroll 8
  for (int k = 0; k < N; ++k) rows[k] = Pack<double, N>::load(row(k));
  transpose(rows);
}

// Size of the blocks of an N x N square, such that a row of a block fits into a register.
template <int N>
inline constexpr int kRow = 8 * N > DYNTAPE_REGISTER ? DYNTAPE_REGISTER / 8 : N;

// Loads S <= N numbers at each of N addresses, from[k] + i, and stores them as S rows of N (transposed).
// store_transposed is the reverse, to the first `count` addresses.
template <int N, int S = N>
void load_transposed(const double* const* from, std::size_t i, double* square) {
  constexpr int W = std::min(kRow<N>, S);
#pragma GCC unroll 4
  for (int r = 0; r < N; r += W) {
#pragma GCC unroll 4
    for (int c = 0; c < S; c += W) {
      Pack<double, W> rows[W];
      load_transposed_rows<W>([&](int k) { return from[r + k] + i + c; }, rows);
#pragma GCC unroll 8
      for (int k = 0; k < W; ++k) rows[k].store(square + (c + k) * N + r);
    }
  }
}
template <int N, int S = N>
void store_transposed(const double* square, double* const* to, std::size_t i, int count) {
  constexpr int W = std::min(kRow<N>, S);
#pragma GCC unroll 4
  for (int r = 0; r < N; r += W) {
#pragma GCC unroll 4
    for (int c = 0; c < S; c += W) {
      Pack<double, W> rows[W];
      load_transposed_rows<W>([&](int k) { return square + (c + k) * N + r; }, rows);
#pragma GCC unroll 8
      for (int k = 0; k < W; ++k) {
        if (r + k < count) rows[k].store(to[r + k] + i + c);
      }
    }
  }
}

#if defined(DYNTAPE_HAS_AVX512F) && !defined(__clang__)
#define DYNTAPE_STORES_LINES 1
template <int N>
[[gnu::always_inline]] inline void load_square(const double* square, Pack<double, N>* rows) {
  load_transposed_rows<N>([&](int k) { return square + k * N; }, rows);
}

// Stores the first n / N * N entries of all states, n >= N, at addresses of any alignment.  A store across two cache
// lines costs twice, so the parts of two squares that belong to one line are joined first.  Only the first and last
// stores cross lines.
template <int N>
void store_in_lines(const double* block, double* const* to, std::size_t n) {
  using Bits = typename Mask<N>::Bits;
  Bits shift[N];
  std::size_t head[N];
  for (int k = 0; k < N; ++k) {
    head[k] = (N - reinterpret_cast<std::uintptr_t>(to[k]) / sizeof(double) % N) % N;
    for (int j = 0; j < N; ++j) shift[k][j] = static_cast<std::int64_t>(head[k]) + j;
  }
  Pack<double, N> before[N], rows[N];
  load_square<N>(block, before);
#pragma GCC unroll 8
  for (int k = 0; k < N; ++k) before[k].store(to[k]);
  std::size_t i = N;
  for (; i + N <= n; i += N) {
    load_square<N>(block + i * N, rows);
#pragma GCC unroll 8
    for (int k = 0; k < N; ++k) {
      const auto line = __builtin_shuffle(before[k].vector(), rows[k].vector(), shift[k]);
      Pack<double, N>(line).store(to[k] + i - N + head[k]);
      before[k] = rows[k];
    }
  }
#pragma GCC unroll 8
  for (int k = 0; k < N; ++k) before[k].store(to[k] + i - N);
}

#endif

}  // namespace detail

// Loads n entries of each of `lanes` states, 1 <= lanes <= N, into a block of N states: entry i of state k, at
// states + k stride, goes to block[i N + k].  Lanes beyond the last state repeat that state, so that they compute
// harmless values.  Reads nothing beyond the n entries of a state.
template <int N>
void gather_lanes(const double* states, std::size_t stride, int lanes, double* block, std::size_t n) {
  const double* from[N];
  for (int k = 0; k < N; ++k) from[k] = states + stride * static_cast<std::size_t>(k < lanes ? k : lanes - 1);
  std::size_t i = 0;
  for (; i + N <= n; i += N) detail::load_transposed<N>(from, i, block + i * N);
  if (i < n && n >= N) {  // loads some entries twice, which is cheaper than one by one
    i = n - N;
    return detail::load_transposed<N>(from, i, block + i * N);
  }
  if constexpr (N == 8) {  // half a square, likewise
    if (n >= N / 2 && n < N) {
      detail::load_transposed<N, N / 2>(from, 0, block);
      i = n - N / 2;
      return detail::load_transposed<N, N / 2>(from, i, block + i * N);
    }
  }
  for (; i < n; ++i) {
    for (int k = 0; k < N; ++k) block[i * N + static_cast<std::size_t>(k)] = from[k][i];
  }
}

// The reverse of gather_lanes; does not write lanes beyond the last state.
template <int N>
void scatter_lanes(const double* block, std::size_t n, double* states, std::size_t stride, int lanes) {
  double* to[N];
  for (int k = 0; k < lanes; ++k) to[k] = states + stride * static_cast<std::size_t>(k);
  std::size_t i = 0;
#if defined(DYNTAPE_STORES_LINES)
  if (N == 8 && lanes == N && n >= 4 * N) {
    detail::store_in_lines<N>(block, to, n);
    i = n / N * N;
  }
#endif
  for (; i + N <= n; i += N) detail::store_transposed<N>(block + i * N, to, i, lanes);
  if (i < n && n >= N) {
    i = n - N;
    return detail::store_transposed<N>(block + i * N, to, i, lanes);
  }
  if constexpr (N == 8) {
    if (n >= N / 2 && n < N) {
      detail::store_transposed<N, N / 2>(block, to, 0, lanes);
      i = n - N / 2;
      return detail::store_transposed<N, N / 2>(block + i * N, to, i, lanes);
    }
  }
  for (; i < n; ++i) {
    for (int k = 0; k < lanes; ++k) to[k][i] = block[i * N + static_cast<std::size_t>(k)];
  }
}

// The same between states and packs.
template <int N>
void gather_lanes(const double* states, std::size_t stride, int lanes, Pack<double, N>* x, std::size_t n) {
  if (n > 0) gather_lanes<N>(states, stride, lanes, reinterpret_cast<double*>(x), n);
}
template <int N>
void scatter_lanes(const Pack<double, N>* x, std::size_t n, double* states, std::size_t stride, int lanes) {
  if (n > 0) scatter_lanes<N>(reinterpret_cast<const double*>(x), n, states, stride, lanes);
}

}  // namespace dyntape
