// SPDX-License-Identifier: BSD-3-Clause
//
// The part of the Hessian that Gauss-Newton omits, learned as in solve/stage_secants.h, for all lanes.
//
//   LaneSecants<8> secants(arrays);
//   secants.learn(places, now);         // after their linearisation; DdpState::help says whether the secants help
//   arrays.gather(arrays.S, places, S); // the lower triangle of (n_z x n_z) packs, by rows
#pragma once

#include <cmath>
#include <limits>

#include <dyntape/interface/control/batch/lane_arrays.h>

namespace dyntape {
inline namespace DYNTAPE_VECTORS {

template <int W>
class LaneSecants {
  using P = Pack<double, W>;
  using M = Mask<W>;
  using Packs = std::vector<P>;

 public:
  explicit LaneSecants(LaneArrays<W>& arrays) : a_(arrays) {
    if (a_.setup.is_exact) return;
    const int z = a_.z_size;
    S_ = a_.room(a_.S.size), z_before_ = a_.room(a_.N * z), J_before_ = a_.room(a_.J_size);
    size_ = inverse_size_ = s_ = r_ = change_ = a_.room(z);
  }

  // Like StageSecants::learn(), for slots that are linearised; their stored values are those of the previous
  // linearisation.
  void learn(LanePlaces<W>& places, const LaneMotion<W>& now) {
    constexpr double kFarOff = 0.2;
    P is_first(0);
    for (int l = 0; l < W; ++l) is_first.set(l, a_.states[std::size_t(places.slot[l])].is_first);
    const M is_new = is_first == P(1), learns = !is_new;
    for (int k = 0; k < a_.N; ++k) {
      a_.go_to(places, k);
      a_.gather(a_.before_z, places, &z_before_[std::size_t(k * a_.z_size)]);
    }
    std::fill(size_.begin(), size_.end(), P(std::numeric_limits<double>::min()));
    for (std::size_t i = 0; i < now.z.size(); ++i) {
      P& size = size_[i % std::size_t(a_.z_size)];
      size = max(size, abs(now.z[i] - z_before_[i]));
    }
    for (std::size_t i = 0; i < size_.size(); ++i) inverse_size_[i] = P(1) / size_[i];
    P known(0), missing(0), left(0);
    for (int k = 0; k < a_.N; ++k) {
      a_.go_to(places, k);
      a_.gather(a_.S, places, S_.data());
      if (any(is_new))
        for (P& x : S_) x = select(is_new, P(0), x);
      if (any(learns)) {
        a_.gather(a_.J, places, J_before_.data());
        learn_stage(k, now, learns, known, missing, left);
      }
      a_.scatter(S_.data(), places, a_.S);
      a_.scatter(&now.z[std::size_t(k * a_.z_size)], places, a_.before_z);
    }
    const M help = learns && abs(left) < abs(missing) && abs(missing) > P(kFarOff) * known;
    for (int l = 0; l < W; ++l)
      if (places.is_used[l]) a_.states[std::size_t(places.slot[l])].help = help[l];
  }

 private:
  // to += sign (g + (A | B)^T adjoint)
  void add_slope(const P* J, const P* adjoint, const P& sign, Packs& to) const {
    for (int j = 0; j < a_.z_size; ++j) {
      P sum(0);
      for (const NonZero& at : a_.columns[std::size_t(j)]) sum += J[at.number] * adjoint[at.at];
      to[std::size_t(j)] += sign * sum;
    }
    for (const NonZero& at : a_.gradient) to[std::size_t(at.at)] += sign * J[at.number];
  }

  void learn_stage(int k, const LaneMotion<W>& now, const M& learns, P& known, P& missing, P& left) {
    constexpr double kWorse = 2, kSkipped = 1e-2, kRounding = 1e-13;
    const P *const J = now.J.data() + k * a_.J_size, *const J_before = J_before_.data(),
                   *const adjoint = &now.adjoint[std::size_t((k + 1) * a_.n)];
    P* const S = S_.data();
    for (int i = 0; i < a_.z_size; ++i) {
      const auto at = std::size_t(i);
      s_[at] = now.z[std::size_t(k * a_.z_size) + at] - z_before_[std::size_t(k * a_.z_size) + at];
      change_[at] = r_[at] = P(0);
    }
    a_.add_curvature(J, s_, r_);
    known += a_.dot(s_, r_);
    // The errors of H and of H + S.
    for (P& x : r_) x = -x;
    std::swap(change_, r_);
    add_slope(J, adjoint, P(1), change_), add_slope(J_before, adjoint, P(-1), change_);
    std::copy(change_.begin(), change_.end(), r_.begin());
    for (int i = 0, at = 0; i < a_.z_size; ++i) {
      for (int j = 0; j < i; ++j, ++at) {
        r_[std::size_t(i)] -= S[at] * s_[std::size_t(j)];
        r_[std::size_t(j)] -= S[at] * s_[std::size_t(i)];
      }
      r_[std::size_t(i)] -= S[at++] * s_[std::size_t(i)];
    }
    missing += a_.dot(s_, change_), left += a_.dot(s_, r_);
    const M counts = learns && sqrt(a_.dot(r_, r_)) > P(kRounding) * size_of_slopes(J, adjoint);
    const auto scaled_squares = [&](const Packs& x, const Packs& by) {
      P sum(0);
      for (std::size_t i = 0; i < x.size(); ++i) sum += x[i] * by[i] * (x[i] * by[i]);
      return sum;
    };
    P of_r = scaled_squares(r_, size_);
    const P of_change = scaled_squares(change_, size_);
    const M anew = counts && of_r > P(kWorse * kWorse) * of_change;
    of_r = select(anew, of_change, of_r);
    for (int i = 0; i < a_.z_size; ++i)
      r_[std::size_t(i)] = select(anew, change_[std::size_t(i)], r_[std::size_t(i)]);
    const P curvature = a_.dot(r_, s_);
    const M changes =
        counts && abs(curvature) > P(kSkipped) * sqrt(of_r) * sqrt(scaled_squares(s_, inverse_size_));
    const P part = select(changes, P(1) / curvature, P(0));
    for (int i = 0, at = 0; i < a_.z_size; ++i) {
      const P of_row = select(changes, part * r_[std::size_t(i)], P(0));
      for (int j = 0; j <= i; ++j, ++at)
        S[at] = select(anew, P(0), S[at]) + select(changes, of_row * r_[std::size_t(j)], P(0));
    }
  }

  // |g| + (|A| + |B|) |adjoint|: the scale of the rounding error in a change of slope.
  P size_of_slopes(const P* J, const P* adjoint) const {
    P of_g(0), of_A(0), of_B(0), of_adjoint(0);
    for (const NonZero& at : a_.gradient) of_g += J[at.number] * J[at.number];
    for (int j = 0; j < a_.z_size; ++j)
      for (const NonZero& at : a_.columns[std::size_t(j)])
        (j < a_.n ? of_A : of_B) += J[at.number] * J[at.number];
    for (int i = 0; i < a_.n; ++i) of_adjoint += adjoint[i] * adjoint[i];
    return sqrt(of_g) + (sqrt(of_A) + sqrt(of_B)) * sqrt(of_adjoint);
  }

  LaneArrays<W>& a_;
  Packs z_before_;
  Packs size_, inverse_size_;            // of steps: the largest of each entry
  Packs S_, J_before_, s_, r_, change_;  // of one stage
};

}  // namespace DYNTAPE_VECTORS
}  // namespace dyntape
