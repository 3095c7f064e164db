// SPDX-License-Identifier: BSD-3-Clause
//
// How the motions of all lanes change with their states at the start, by their policies (solve/ddp_sensitivities.h):
//
//   LaneChanges<8> changes(arrays);
//   changes.find(sizes);                     // after linearise() and backward(); sizes (n_u), of the slopes by the controls
//   changes.x()[(k n + i) n + j]             // d x_k[i] / d x_0[j];  changes.u()[(k m + i) n + j] likewise
//   changes.is_weak(lane)                    // whether a control is weakly held
//
// du_k = K_k dx_k, dx_{k+1} = A_k dx_k + B_k du_k.
#pragma once

#include <dyntape/interface/control/batch/lane_arrays.h>
#include <dyntape/interface/control/solve/ddp_sensitivities.h>

namespace dyntape {
inline namespace DYNTAPE_VECTORS {

template <int W>
class LaneChanges {
  using P = Pack<double, W>;
  using M = Mask<W>;
  using Packs = std::vector<P>;

 public:
  explicit LaneChanges(LaneArrays<W>& arrays) : a_(arrays) {}

  const Packs& x() const { return x_; }
  const Packs& u() const { return u_; }
  bool is_weak(int lane) const { return weak_[lane] == 1; }

  void find(const Packs& sizes) {
    const int n = a_.n, m = a_.m;
    x_.assign(std::size_t((a_.N + 1) * n * n), P(0)), u_.assign(std::size_t(a_.N * m * n), P(0));
    for (int i = 0; i < n; ++i) x_[std::size_t(i * n + i)] = P(1);
    for (int k = 0; k < a_.N; ++k) {
      const P *const J = &a_.J[std::size_t(k * a_.J_size)], *const x = &x_[std::size_t(k * n * n)],
                     *const K = &a_.K[std::size_t(k * m * n)];
      P *const u = &u_[std::size_t(k * m * n)], *const next = &x_[std::size_t((k + 1) * n * n)];
      for (int i = 0; i < m; ++i)
        for (int r = 0; r < n; ++r)
          for (int j = 0; j < n; ++j) u[i * n + j] += K[i * n + r] * x[r * n + j];
      for (int c = 0; c < a_.z_size; ++c) {
        const P* const row = c < n ? x + c * n : u + (c - n) * n;
        for (const NonZero& at : a_.columns[std::size_t(c)])
          for (int j = 0; j < n; ++j) next[at.at * n + j] += J[at.number] * row[j];
      }
    }
    find_weak(sizes);
  }

 private:
  void find_weak(const Packs& sizes) {
    P largest(0);
    for (int k = 0; k < a_.N; ++k)
      for (int i = 0; i < a_.m; ++i) largest = max(largest, abs(a_.z[std::size_t(k * a_.z_size + a_.n + i)]));
    const P near = P(kWeaklyHeld) * largest;
    M weak(false);
    for (int k = 0; k < a_.N; ++k) {
      for (int i = 0; i < a_.m; ++i) {
        const P u = a_.z[std::size_t(k * a_.z_size + a_.n + i)], lower(a_.setup.lower[i]),
                upper(a_.setup.upper[i]);
        if (a_.setup.lower[i] >= a_.setup.upper[i]) continue;
        const M is_held = u <= lower || u >= upper;
        const M has_no_force = abs(slope(k, i)) <= P(kWeaklyHeld) * sizes[std::size_t(i)];
        weak = weak || (is_held && has_no_force) || (!is_held && min(u - lower, upper - u) <= near);
      }
    }
    weak_ = select(weak, P(1), P(0));
  }

  // L_u + B^T lambda
  P slope(int k, int i) const {
    const P *const J = &a_.J[std::size_t(k * a_.J_size)], *const adjoint =
                                                              &a_.adjoint[std::size_t((k + 1) * a_.n)];
    P sum(0);
    for (const NonZero& at : a_.columns[std::size_t(a_.n + i)]) sum += J[at.number] * adjoint[at.at];
    for (const NonZero& at : a_.gradient)
      if (at.at == a_.n + i) sum += J[at.number];
    return sum;
  }

  LaneArrays<W>& a_;
  Packs x_, u_;
  P weak_ = P(0);
};

}  // namespace DYNTAPE_VECTORS
}  // namespace dyntape
