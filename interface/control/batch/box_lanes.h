// SPDX-License-Identifier: BSD-3-Clause
//
// Minimises 1/2 u.H u + g.u over the controls of one stage, within limits if there are any, for many problems in
// lanes.
//
//   LaneControls<8> controls(m);
//   Mask<8> good = controls.minimise(H, g, nullptr, nullptr, wanted);  // true if H is positive definite
//   good = controls.minimise(H, g, lower, upper, wanted);              // projected Newton steps (riccati.h)
//   controls.u();                                                      // the minimum, where the mask is true
//   controls.solve(b);                                                 // H^-1 b for controls at no limit, else zero
//
// H (m x m), symmetric; g, lower, upper, b (m).
#pragma once

#include <cmath>
#include <vector>

#include <dyntape/autodiff/scalars/pack.h>

namespace dyntape {
inline namespace DYNTAPE_VECTORS {

template <int W>
class LaneControls {
 public:
  using P = Pack<double, W>;
  using M = Mask<W>;

  explicit LaneControls(int m)
      : m_(m), L_(std::size_t(m * m)), u_(std::size_t(m)), slope_(u_), step_(u_), next_(u_), inverse_(u_) {
    free_.assign(std::size_t(m), M(true)), open_ = free_;
  }

  const P* u() const { return u_.data(); }

  // The factorisation of H for the controls at no limit: least pivot (infinite if all are at limits), largest
  // diagonal entry.
  P least_pivot() const {
    P least(HUGE_VAL);
    for (int i = 0; i < m_; ++i)
      least = min(least, select(free_[i], L_[i * m_ + i] * L_[i * m_ + i], P(HUGE_VAL)));
    return least;
  }
  P largest_curvature() const {
    P largest(0);
    for (int i = 0; i < m_; ++i) {
      P own(0);
      for (int k = 0; k <= i; ++k) own += L_[i * m_ + k] * L_[i * m_ + k];
      largest = max(largest, select(free_[i], own, P(0)));
    }
    return largest;
  }

  M minimise(const P* H, const P* g, const P* lower, const P* upper, const M& wanted) {
    if (lower) return minimise_within(H, g, lower, upper, wanted);
    std::fill(free_.begin(), free_.end(), M(true));
    const M good = factor(H, free_);
    for (int i = 0; i < m_; ++i) u_[i] = -g[i];
    solve(u_.data());
    return good;
  }

  void solve(P* b) const {
    for (int i = 0; i < m_; ++i) {
      P sum = select(free_[i], b[i], P(0));
      for (int j = 0; j < i; ++j) sum -= L_[i * m_ + j] * b[j];
      b[i] = sum * inverse_[i];
    }
    for (int i = m_; i-- > 0;) {
      P sum = b[i];
      for (int j = i + 1; j < m_; ++j) sum -= L_[j * m_ + i] * b[j];
      b[i] = sum * inverse_[i];
    }
  }

 private:
  // Factorises the chosen rows and columns, with the unit matrix elsewhere; true where this is positive definite.
  M factor(const P* H, const std::vector<M>& chosen) {
    M good(true);
    for (int i = 0; i < m_; ++i) {
      for (int j = 0; j <= i; ++j) {
        P sum = select(chosen[i] && chosen[j], H[i * m_ + j], P(i == j));
        for (int k = 0; k < j; ++k) sum -= L_[i * m_ + k] * L_[j * m_ + k];
        if (i > j) {
          L_[i * m_ + j] = sum * inverse_[j];
          continue;
        }
        const M positive = sum > P(0) && sum * P(0) == P(0);
        good = good && positive;
        L_[i * m_ + i] = sqrt(select(positive, sum, P(1)));
        inverse_[i] = P(1) / L_[i * m_ + i];
      }
    }
    return good;
  }

  static P clamped(const P& x, const P& lower, const P& upper) {
    const P above = select(x < lower, lower, x);
    return select(upper < above, upper, above);
  }

  P value(const P* H, const P* g, const std::vector<P>& u) const {
    P sum(0);
    for (int i = 0; i < m_; ++i) sum += (slope_at(H, u, i) * P(0.5) + g[i]) * u[i];
    return sum;
  }
  P slope_at(const P* H, const std::vector<P>& u, int i) const {
    P sum(0);
    for (int j = 0; j < m_; ++j) sum += H[i * m_ + j] * u[j];
    return sum;
  }

  // The controls that may move; if H is not positive definite on these, only those that are not pressed against a
  // limit.
  M open_up(const P* H, const P* g, const P* lower, const P* upper) {
    for (int i = 0; i < m_; ++i) open_[i] = lower[i] < upper[i];
    M good = factor(H, open_);
    if (all(good)) return good;
    for (int i = 0; i < m_; ++i) {
      const M pressed = (lower[i] >= P(0) && g[i] > P(0)) || (upper[i] <= P(0) && g[i] < P(0));
      open_[i] = open_[i] && !(pressed && !good);
    }
    return factor(H, open_);
  }

  M minimise_within(const P* H, const P* g, const P* lower, const P* upper, const M& wanted) {
    constexpr int kMostRounds = 100, kHalvings = 40;
    const M good = open_up(H, g, lower, upper);
    for (int i = 0; i < m_; ++i) u_[i] = clamped(P(0), lower[i], upper[i]);
    M active = good && wanted;
    std::vector<M>& free = free_;
    for (int round = 0; round < kMostRounds && any(active); ++round) {
      M any_free(false);
      for (int i = 0; i < m_; ++i) {
        slope_[i] = slope_at(H, u_, i) + g[i];
        const M stays = (u_[i] <= lower[i] && slope_[i] > P(0)) || (u_[i] >= upper[i] && slope_[i] < P(0));
        free[i] = (active && open_[i] && !stays) || (!active && free[i]);
        any_free = any_free || free[i];
        step_[i] = -slope_[i];
      }
      factor(H, free);
      solve(step_.data());
      const auto go = [&] {
        for (int i = 0; i < m_; ++i)
          next_[i] = select(free[i], clamped(u_[i] + step_[i], lower[i], upper[i]), u_[i]);
      };
      go();
      const P now = value(H, g, u_);
      for (int i = 0; i < kHalvings; ++i) {
        const M worse = active && value(H, g, next_) > now;
        if (!any(worse)) break;
        for (P& s : step_) s = select(worse, s * P(0.5), s);
        go();
      }
      P moved(0), size(0);
      for (int i = 0; i < m_; ++i) {
        moved = max(moved, abs(next_[i] - u_[i])), size = max(size, abs(u_[i]));
        u_[i] = select(active, next_[i], u_[i]);
      }
      active = active && any_free && !(moved <= P(1e-14) * (P(1) + size));
    }
    factor(H, free);
    return good;
  }

  int m_;
  std::vector<P> L_, u_, slope_, step_, next_, inverse_;  // L_: (m x m), by rows
  std::vector<M> free_, open_;
};

}  // namespace DYNTAPE_VECTORS
}  // namespace dyntape
