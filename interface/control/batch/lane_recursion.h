// SPDX-License-Identifier: BSD-3-Clause
//
// Riccati's recursion of all lanes, from the end to the start (riccati/riccati.h), each with its own shift.
//
//   LaneRecursion<8> recursion(arrays, secants, step);
//   recursion.backward(wanted);         // policies and slopes of those where all stages have a minimum; DdpState says of which
//
// The curvature of a stage: second derivatives by the slope of the cost to go, or those of the residuals with the secants.
#pragma once

#include <cmath>

#include <dyntape/interface/control/batch/box_lanes.h>
#include <dyntape/interface/control/batch/lane_functions.h>
#include <dyntape/interface/control/batch/lane_secants.h>

namespace dyntape {
inline namespace DYNTAPE_VECTORS {

template <int W>
class LaneRecursion {
  using P = Pack<double, W>;
  using M = Mask<W>;
  using Packs = std::vector<P>;

 public:
  LaneRecursion(LaneArrays<W>& arrays, const LaneSecants<W>& secants, LaneFunction<W>& step)
      : a_(arrays), secants_(secants), step_(step), controls_(arrays.m) {
    const int n = a_.n, m = a_.m, z = a_.z_size;
    used_ = a_.room(a_.N), q_ = a_.room(z), lower_ = upper_ = column_ = of_q_ = a_.room(m);
    P_to_go_ = a_.room(n * n), p_to_go_ = m_of_ = a_.room(n), weights_ = a_.room(a_.y_size);
    PF_ = a_.room(n * z), Q_ = a_.room(z * z), Q_uu_ = a_.room(m * m), gain_ = of_Q_ = a_.room(m * n);
  }

  void backward(const std::vector<bool>& wanted) {
    M sound = a_.mask_of(wanted), with(false);
    P shift(0);
    for (int l = 0; l < W; ++l) {
      DdpState& s = a_.states[std::size_t(l)];
      shift.set(l, s.shift);
      s.is_convex = s.is_convex || wanted[std::size_t(l)];
    }
    if (!a_.setup.is_exact) {
      std::vector<bool> helped(W);
      for (int l = 0; l < W; ++l) helped[std::size_t(l)] = a_.states[std::size_t(l)].with_secants;
      with = a_.mask_of(helped);
    }
    const M mask = sound;
    begin_cost_to_go(mask);
    for (int k = a_.N - 1; k >= 0; --k) {
      const P* const c = a_.setup.has_gaps ? &a_.gap[std::size_t(k * a_.n)] : nullptr;
      for (int i = 0; i < a_.n; ++i) {
        m_of_[std::size_t(i)] = p_to_go_[std::size_t(i)];
        for (int j = 0; c && j < a_.n; ++j)
          m_of_[std::size_t(i)] += P_to_go_[std::size_t(i * a_.n + j)] * c[j];
      }
      if (a_.setup.is_exact) curve(k);
      M used = with;
      M good = stage(k, used, shift);
      if (any(used && !good)) {
        used = used && good;
        good = stage(k, used, shift);
      }
      used_[std::size_t(k)] = select(mask, select(used, P(1), P(0)), used_[std::size_t(k)]);
      for (int l = 0; l < W; ++l)
        if (sound[l] && !good[l]) note_failure(l, k, shift);
      sound = sound && good;
      if (!any(sound)) break;
      close_stage(k, sound);
    }
    predict(wanted, sound);
  }

 private:
  void begin_cost_to_go(const M& mask) {
    std::fill(P_to_go_.begin(), P_to_go_.end(), P(0)), std::fill(p_to_go_.begin(), p_to_go_.end(), P(0));
    const Pattern &J = a_.setup.end.jacobian_pattern(), &H = a_.setup.end.hessian_pattern();
    for (std::size_t i = 0; i < J.nnz(); ++i) p_to_go_[J.col[i]] = a_.J_end[i];
    for (std::size_t i = 0; i < H.nnz(); ++i)
      P_to_go_[H.row[i] * std::size_t(a_.n) + H.col[i]] = P_to_go_[H.col[i] * std::size_t(a_.n) + H.row[i]] =
          a_.H_end[i];
    for (int i = 0; i < a_.n; ++i) {
      P& kept = a_.slope[std::size_t(a_.N * a_.n + i)];
      kept = select(mask, p_to_go_[std::size_t(i)], kept);
    }
  }

  // The curvature of a stage, by the slope of the cost to go.
  void curve(int k) {
    std::copy(m_of_.begin(), m_of_.end(), weights_.begin());
    weights_[std::size_t(a_.n)] = P(1);
    std::uint32_t left[W];
    step_.run(Order::kSecond, 1,
              {.x = reinterpret_cast<const double*>(&a_.z[std::size_t(k * a_.z_size)]),
               .p = reinterpret_cast<const double*>(&a_.p[std::size_t(k * a_.p_size)]),
               .w = reinterpret_cast<const double*>(weights_.data()),
               .hessian = reinterpret_cast<double*>(&a_.H[std::size_t(k * a_.H_size)])},
              left);
  }

  // Q = H + F^T P F, q = g + F^T m, the lower triangle; then the best controls; where there are.
  M stage(int k, const M& with_secants, const P& shift) {
    const P* const J = &a_.J[std::size_t(k * a_.J_size)];
    add_own_curvature(k, with_secants);
    for (int j = 0; j < a_.z_size; ++j) {
      const std::vector<NonZero>& column = a_.columns[std::size_t(j)];
      for (int i = 0; i < a_.n; ++i) {
        P sum(0);
        const P* const row = &P_to_go_[std::size_t(i * a_.n)];
        for (const NonZero& at : column) sum += row[at.at] * J[at.number];
        PF_[std::size_t(j * a_.n + i)] = sum;
      }
      P slope(0);
      for (const NonZero& at : column) slope += m_of_[std::size_t(at.at)] * J[at.number];
      q_[std::size_t(j)] = slope;
    }
    for (const NonZero& at : a_.gradient) q_[std::size_t(at.at)] += J[at.number];
    for (int a = 0; a < a_.z_size; ++a) {
      const std::vector<NonZero>& column = a_.columns[std::size_t(a)];
      for (int b = 0; b <= a; ++b) {
        P sum = Q_[std::size_t(a * a_.z_size + b)];
        const P* const of_b = &PF_[std::size_t(b * a_.n)];
        for (const NonZero& at : column) sum += J[at.number] * of_b[at.at];
        Q_[std::size_t(a * a_.z_size + b)] = sum;
      }
    }
    return minimise(k, shift);
  }

  void add_own_curvature(int k, const M& with_secants) {
    std::fill(Q_.begin(), Q_.end(), P(0));
    if (a_.setup.is_exact) {
      const Pattern& at = a_.setup.step.hessian_pattern();
      const P* const H = &a_.H[std::size_t(k * a_.H_size)];
      for (std::size_t i = 0; i < at.nnz(); ++i) Q_[at.row[i] * std::size_t(a_.z_size) + at.col[i]] = H[i];
      return;
    }
    const P* const J = &a_.J[std::size_t(k * a_.J_size)];
    for (const auto& residual : a_.residuals) {
      for (const NonZero& a : residual) {
        const P twice = P(2) * J[a.number];
        for (const NonZero& b : residual)
          if (b.at <= a.at) Q_[std::size_t(a.at * a_.z_size + b.at)] += twice * J[b.number];
      }
    }
    if (!any(with_secants)) return;
    const P* const S = secants_.of_stage(k);
    for (int a = 0; a < a_.z_size; ++a)
      for (int b = 0; b <= a; ++b)
        Q_[std::size_t(a * a_.z_size + b)] += select(with_secants, S[a * a_.z_size + b], P(0));
  }

  P& Q_uu(int i, int j) {
    return Q_[std::size_t((a_.n + std::max(i, j)) * a_.z_size + a_.n + std::min(i, j))];
  }
  P& Q_ux(int i, int j) { return Q_[std::size_t((a_.n + i) * a_.z_size + j)]; }

  M minimise(int k, const P& shift) {
    for (int i = 0; i < a_.m; ++i)
      for (int j = 0; j < a_.m; ++j) Q_uu_[std::size_t(i * a_.m + j)] = Q_uu(i, j) + (i == j ? shift : P(0));
    if (!a_.is_limited) return controls_.minimise(Q_uu_.data(), &q_[std::size_t(a_.n)], nullptr, nullptr);
    for (int i = 0; i < a_.m; ++i) {
      const P& u = a_.z[std::size_t(k * a_.z_size + a_.n + i)];
      lower_[std::size_t(i)] = P(a_.setup.lower[i]) - u, upper_[std::size_t(i)] = P(a_.setup.upper[i]) - u;
    }
    return controls_.minimise(Q_uu_.data(), &q_[std::size_t(a_.n)], lower_.data(), upper_.data());
  }

  // K, and the cost to go of the policy as it is: P = Q_xx + K^T Q_ux + Q_xu K + K^T Q_uu K.
  void close_stage(int k, const M& sound) {
    const P* const u = controls_.u();
    P *const K = gain_.data(), *const of_q = of_q_.data(), *const of_Q = of_Q_.data();
    for (int j = 0; j < a_.n; ++j) {
      for (int i = 0; i < a_.m; ++i) column_[std::size_t(i)] = -Q_ux(i, j);
      controls_.solve(column_.data());
      for (int i = 0; i < a_.m; ++i) K[i * a_.n + j] = column_[std::size_t(i)];
    }
    // (m) q_u + Q_uu k, (m x n) Q_ux + Q_uu K
    for (int i = 0; i < a_.m; ++i) {
      P sum = q_[std::size_t(a_.n + i)];
      for (int j = 0; j < a_.m; ++j) sum += Q_uu(i, j) * u[j];
      of_q[i] = sum;
      for (int j = 0; j < a_.n; ++j) {
        P entry = Q_ux(i, j);
        for (int r = 0; r < a_.m; ++r) entry += Q_uu(i, r) * K[r * a_.n + j];
        of_Q[i * a_.n + j] = entry;
      }
    }
    for (int i = 0; i < a_.n; ++i) {
      P slope = q_[std::size_t(i)];
      for (int r = 0; r < a_.m; ++r) slope += Q_ux(r, i) * u[r] + K[r * a_.n + i] * of_q[r];
      p_to_go_[std::size_t(i)] = slope;
      for (int j = 0; j <= i; ++j) {
        P sum = Q_[std::size_t(i * a_.z_size + j)];
        for (int r = 0; r < a_.m; ++r)
          sum += Q_ux(r, i) * K[r * a_.n + j] + K[r * a_.n + i] * of_Q[r * a_.n + j];
        P_to_go_[std::size_t(i * a_.n + j)] = P_to_go_[std::size_t(j * a_.n + i)] = sum;
      }
      P& kept = a_.slope[std::size_t(k * a_.n + i)];
      kept = select(sound, slope, kept);
    }
    for (int i = 0; i < a_.m; ++i) {
      P& kept = a_.k[std::size_t(k * a_.m + i)];
      kept = select(sound, u[i], kept);
    }
    for (int i = 0; i < a_.m * a_.n; ++i) {
      P& kept = a_.K[std::size_t(k * a_.m * a_.n + i)];
      kept = select(sound, K[i], kept);
    }
  }

  void note_failure(int lane, int k, const P& shift) {
    DdpState& s = a_.states[std::size_t(lane)];
    s.is_convex = false, s.failed_stage = k;
    s.failed.resize(a_.m, a_.m);
    for (int i = 0; i < a_.m; ++i)
      for (int j = 0; j < a_.m; ++j) s.failed(i, j) = Q_uu(i, j)[lane] + (i == j ? shift[lane] : 0);
  }

  // What the whole step changes the cost by, to first order and by its curvature, and its largest entry.
  void predict(const std::vector<bool>& wanted, const M& sound) {
    if (!any(sound)) return;
    P linear(0), curved(0), size(0);
    Packs dx(std::size_t(a_.n), P(0)), next(dx), dz(std::size_t(a_.z_size), P(0)), Hz(dz);
    for (int k = 0; k < a_.N; ++k) {
      const P* const J = &a_.J[std::size_t(k * a_.J_size)];
      std::copy(dx.begin(), dx.end(), dz.begin());
      for (int i = 0; i < a_.m; ++i) {
        const P own = a_.k[std::size_t(k * a_.m + i)];
        size = max(size, abs(own));
        P sum(0);
        for (int j = 0; j < a_.n; ++j)
          sum += a_.K[std::size_t((k * a_.m + i) * a_.n + j)] * dx[std::size_t(j)];
        dz[std::size_t(a_.n + i)] = own + sum;
      }
      for (const NonZero& at : a_.gradient) linear += J[at.number] * dz[std::size_t(at.at)];
      std::fill(Hz.begin(), Hz.end(), P(0));
      add_used_curvature(k, dz, Hz);
      curved += a_.dot(dz, Hz) * P(0.5);
      for (int i = 0; i < a_.n; ++i)
        next[std::size_t(i)] = a_.setup.has_gaps ? a_.gap[std::size_t(k * a_.n + i)] : P(0);
      for (int j = 0; j < a_.z_size; ++j)
        for (const NonZero& at : a_.columns[std::size_t(j)])
          next[std::size_t(at.at)] += J[at.number] * dz[std::size_t(j)];
      std::swap(dx, next);
    }
    const Pattern &g = a_.setup.end.jacobian_pattern(), &H = a_.setup.end.hessian_pattern();
    for (std::size_t i = 0; i < g.nnz(); ++i) linear += a_.J_end[i] * dx[g.col[i]];
    for (std::size_t i = 0; i < H.nnz(); ++i)
      curved += a_.H_end[i] * dx[H.row[i]] * dx[H.col[i]] * P(H.row[i] == H.col[i] ? 0.5 : 1);
    for (int l = 0; l < W; ++l) {
      if (!wanted[std::size_t(l)] || !sound[l]) continue;
      a_.states[std::size_t(l)].step_size = size[l], a_.states[std::size_t(l)].linear = linear[l],
      a_.states[std::size_t(l)].curved = curved[l];
    }
  }

  void add_used_curvature(int k, const Packs& dz, Packs& to) const {
    if (a_.setup.is_exact) {
      const Pattern& at = a_.setup.step.hessian_pattern();
      const P* const H = &a_.H[std::size_t(k * a_.H_size)];
      for (std::size_t i = 0; i < at.nnz(); ++i) {
        to[at.row[i]] += H[i] * dz[at.col[i]];
        if (at.row[i] != at.col[i]) to[at.col[i]] += H[i] * dz[at.row[i]];
      }
      return;
    }
    a_.add_curvature(&a_.J[std::size_t(k * a_.J_size)], dz, to);
    const M used = used_[std::size_t(k)] == P(1);
    if (!any(used)) return;
    const P* const S = secants_.of_stage(k);
    for (int i = 0; i < a_.z_size; ++i) {
      P sum(0);
      for (int j = 0; j < a_.z_size; ++j) sum += S[i * a_.z_size + j] * dz[std::size_t(j)];
      to[std::size_t(i)] += select(used, sum, P(0));
    }
  }

  LaneArrays<W>& a_;
  const LaneSecants<W>& secants_;
  LaneFunction<W>& step_;
  LaneControls<W> controls_;
  Packs used_;  // (N) 1 where the last step took the secants
  // Of one stage.
  Packs P_to_go_, p_to_go_, m_of_, weights_, PF_, Q_, Q_uu_, q_, lower_, upper_, gain_, column_, of_q_, of_Q_;
};

}  // namespace DYNTAPE_VECTORS
}  // namespace dyntape
