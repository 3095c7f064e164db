// SPDX-License-Identifier: BSD-3-Clause
//
// Between states that lie one after the other in memory and packs, whose lanes are the states.
//
//   Pack8 x[7];
//   gather_lanes(states, 7, 8, x, 7);        // x[i] lane k: entry i of state k; state k starts at states + 7 k
//   scatter_lanes(x, 7, results, 7, 8);      // and back
//
// N x N entries at a time are transposed in registers: log2 N rounds of exchanges between pairs of rows.
#pragma once

#include <cstddef>
#include <utility>

#include <dyntape/autodiff/pack.h>

namespace dyntape {
namespace detail {

// Exchanges the off-diagonal halves of each 2h x 2h block of the rows a and b = a + h.
template <int H, int N, std::size_t... J>
void exchange(Pack<double, N>& a, Pack<double, N>& b, std::index_sequence<J...>) {
  const auto u = a.vector(), v = b.vector();
  a = Pack<double, N>(__builtin_shufflevector(u, v, (J & H ? N + J - H : J)...));
  b = Pack<double, N>(__builtin_shufflevector(u, v, (J & H ? N + J : J + H)...));
}

template <int N, int H = N / 2>
void transpose(Pack<double, N>* rows) {
  if constexpr (H > 0) {
    for (int i = 0; i < N; ++i) {
      if (!(i & H)) exchange<H>(rows[i], rows[i + H], std::make_index_sequence<N>());
    }
    transpose<N, H / 2>(rows);
  }
}

}  // namespace detail

// A block of N states from n entries of `lanes` of them, state k at states + k stride, 1 <= lanes <= N: entry i
// of state k goes to block[i N + k].  Lanes beyond the last state repeat it, so that they compute something
// harmless.  Nothing beyond the n entries of a state is read.
template <int N>
void gather_lanes(const double* states, std::size_t stride, int lanes, double* block, std::size_t n) {
  const double* from[N];
  for (int k = 0; k < N; ++k) from[k] = states + stride * static_cast<std::size_t>(k < lanes ? k : lanes - 1);
  const auto square = [&](std::size_t i) {
    Pack<double, N> rows[N];
    for (int k = 0; k < N; ++k) rows[k] = Pack<double, N>::load(from[k] + i);
    detail::transpose(rows);
    for (int k = 0; k < N; ++k) rows[k].store(block + (i + static_cast<std::size_t>(k)) * N);
  };
  std::size_t i = 0;
  for (; i + N <= n; i += N) square(i);
  if (i < n && n >= N) return square(n - N);  // some entries once more: cheaper than one by one
  for (; i < n; ++i) {
    for (int k = 0; k < N; ++k) block[i * N + static_cast<std::size_t>(k)] = from[k][i];
  }
}

// The reverse; lanes beyond the last state are not written.
template <int N>
void scatter_lanes(const double* block, std::size_t n, double* states, std::size_t stride, int lanes) {
  const auto square = [&](std::size_t i) {
    Pack<double, N> rows[N];
    for (int k = 0; k < N; ++k)
      rows[k] = Pack<double, N>::load(block + (i + static_cast<std::size_t>(k)) * N);
    detail::transpose(rows);
    for (int k = 0; k < lanes; ++k) rows[k].store(states + stride * static_cast<std::size_t>(k) + i);
  };
  std::size_t i = 0;
  for (; i + N <= n; i += N) square(i);
  if (i < n && n >= N) return square(n - N);
  for (; i < n; ++i) {
    for (int k = 0; k < lanes; ++k)
      states[stride * static_cast<std::size_t>(k) + i] = block[i * N + static_cast<std::size_t>(k)];
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
