// SPDX-License-Identifier: BSD-3-Clause
//
// Derivatives of the motions of all lanes by their initial states, with their policies (solve/ddp_sensitivities.h):
//
//   LaneChanges<8> changes(arrays);
//   changes.find(places);                    // slots that are linearised and whose recursion has reached the start
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

  void find(LanePlaces<W> places) {
    const int n = a_.n, m = a_.m;
    x_.assign(std::size_t((a_.N + 1) * n * n), P(0)), u_.assign(std::size_t(a_.N * m * n), P(0));
    J_ = a_.room(a_.J_size), K_ = a_.room(m * n), z_ = a_.room(a_.z_size), adjoint_ = a_.room(n);
    for (int i = 0; i < n; ++i) x_[std::size_t(i * n + i)] = P(1);
    begin_weak(places);
    for (int k = 0; k < a_.N; ++k) {
      a_.go_to(places, k);
      a_.gather(a_.J, places, J_.data()), a_.gather(a_.K, places, K_.data()),
          a_.gather(a_.z, places, z_.data());
      const P* const x = &x_[std::size_t(k * n * n)];
      P *const u = &u_[std::size_t(k * m * n)], *const next = &x_[std::size_t((k + 1) * n * n)];
      for (int i = 0; i < m; ++i)
        for (int r = 0; r < n; ++r)
          for (int j = 0; j < n; ++j) u[i * n + j] += K_[std::size_t(i * n + r)] * x[r * n + j];
      for (int c = 0; c < a_.z_size; ++c) {
        const P* const row = c < n ? x + c * n : u + (c - n) * n;
        for (const NonZero& at : a_.columns[std::size_t(c)])
          for (int j = 0; j < n; ++j) next[at.at * n + j] += J_[std::size_t(at.number)] * row[j];
      }
      a_.go_to(places, k + 1), a_.gather(a_.adjoint, places, adjoint_.data());
      add_weak();
    }
  }

 private:
  // Scales for forces and distances.
  void begin_weak(const LanePlaces<W>& places) {
    sizes_ = a_.room(a_.m), weak_ = P(0);
    for (int l = 0; l < W; ++l) {
      const DdpState& s = a_.states[std::size_t(places.slot[l])];
      near_.set(l, kWeaklyHeld * s.largest_u);
      for (int i = 0; i < a_.m; ++i) sizes_[std::size_t(i)].set(l, s.sizes[i]);
    }
  }

  void add_weak() {
    for (int i = 0; i < a_.m; ++i) {
      if (a_.setup.lower[i] >= a_.setup.upper[i]) continue;
      const P u = z_[std::size_t(a_.n + i)], lower(a_.setup.lower[i]), upper(a_.setup.upper[i]);
      const M is_held = u <= lower || u >= upper,
              has_no_force = abs(slope(i)) <= P(kWeaklyHeld) * sizes_[std::size_t(i)];
      const M weak = (is_held && has_no_force) || (!is_held && min(u - lower, upper - u) <= near_);
      weak_ = select(weak, P(1), weak_);
    }
  }

  // L_u + B^T lambda
  P slope(int i) const {
    P sum(0);
    for (const NonZero& at : a_.columns[std::size_t(a_.n + i)])
      sum += J_[std::size_t(at.number)] * adjoint_[std::size_t(at.at)];
    for (const NonZero& at : a_.gradient)
      if (at.at == a_.n + i) sum += J_[std::size_t(at.number)];
    return sum;
  }

  LaneArrays<W>& a_;
  Packs x_, u_;
  Packs J_, K_, z_, adjoint_, sizes_;  // of one stage
  P near_ = P(0), weak_ = P(0);
};

}  // namespace DYNTAPE_VECTORS
}  // namespace dyntape
