// SPDX-License-Identifier: BSD-3-Clause
//
// Riccati's recursion in lanes, from end to start (riccati/riccati.h); each lane has its own shift and stage.
//
//   LaneRecursion<8> recursion(arrays, step);
//   over = recursion.backward(slots);   // policies and slopes of slots with a minimum at all stages (DdpState)
//   recursion.predict(slots);           // the predicted changes of cost
//
// The curvature of a stage: second derivatives weighted by the slope of the cost to go, or those of the residuals
// plus secants.
#pragma once

#include <cmath>

#include <dyntape/interface/control/batch/box_lanes.h>
#include <dyntape/interface/control/batch/lane_arrays.h>
#include <dyntape/interface/control/batch/lane_functions.h>

namespace dyntape {
inline namespace DYNTAPE_VECTORS {

template <int W>
class LaneRecursion {
  using P = Pack<double, W>;
  using M = Mask<W>;
  using Packs = std::vector<P>;

  static constexpr double kNotStrict = 1e-10;  // as in solve/ddp_sensitivities.cpp

 public:
  LaneRecursion(LaneArrays<W>& arrays, LaneFunction<W>& step)
      : a_(arrays),
        step_(step),
        controls_(arrays.m),
        places_(arrays.places({})),
        is_flat_(arrays.states.size(), false) {
    const int n = a_.n, m = a_.m, z = a_.z_size;
    J_ = a_.room(a_.J_size), H_ = a_.room(a_.H_size), S_ = a_.room(a_.S.size);
    is_used_ = a_.room(1), z_ = q_ = a_.room(z), p_ = a_.room(a_.p_size), gap_ = a_.room(n);
    J_end_ = a_.room(a_.J_end.size), H_end_ = a_.room(a_.H_end.size);
    lower_ = upper_ = column_ = of_q_ = a_.room(m);
    P_to_go_ = a_.room(n * n), p_to_go_ = m_of_ = a_.room(n), weights_ = a_.room(a_.y_size);
    PF_ = a_.room(n * z), Q_ = a_.room(z * z), Q_uu_ = a_.room(m * m), gain_ = of_Q_ = a_.room(m * n);
  }

  // Each slot continues from its own stage, at first from the end, when a lane is free.  Returns when one or more
  // slots are over (at the start, or at a stage without minimum), with these slots.  Slots already on their way are
  // among the wanted.
  std::vector<int> backward(const std::vector<int>& wanted) {
    std::vector<int> over;
    begin(wanted);
    while (over.empty()) {
      const M running = places_.used(), good = pass_stage(running);
      for (int l = 0; l < W; ++l) {
        if (!places_.is_used[l]) continue;
        if (!good[l]) note_failure(l);
        const int next = good[l] ? places_.stage[l] - 1 : -1;
        a_.go_to(places_, l, places_.slot[l], std::max(next, 0));
        if (next >= 0) continue;
        is_flat_[std::size_t(places_.slot[l])] = least_pivot_[l] <= kNotStrict * largest_curvature_[l];
        places_.is_used[l] = false;
        over.push_back(places_.slot[l]);
      }
    }
    return over;
  }

  // Whether the minimum of a finished slot is not strict: the cost hardly changes along some controls at no limit.
  bool is_flat(int slot) const { return is_flat_[std::size_t(slot)]; }

  // For slots that reached the start: the first-order change of the cost by the whole step, its change by curvature,
  // and the step's largest entry.
  void predict(const std::vector<int>& slots) {
    LanePlaces<W> places = a_.places(slots);
    P linear(0), curved(0), size(0);
    Packs dx(std::size_t(a_.n), P(0)), next(dx), dz(std::size_t(a_.z_size), P(0)), Hz(dz);
    for (int k = 0; k < a_.N; ++k) {
      a_.go_to(places, k);
      a_.gather(a_.J, places, J_.data()), a_.gather(a_.K, places, gain_.data()),
          a_.gather(a_.k, places, column_.data());
      std::copy(dx.begin(), dx.end(), dz.begin());
      for (int i = 0; i < a_.m; ++i) {
        const P own = column_[std::size_t(i)];
        size = max(size, abs(own));
        P sum(0);
        for (int j = 0; j < a_.n; ++j) sum += gain_[std::size_t(i * a_.n + j)] * dx[std::size_t(j)];
        dz[std::size_t(a_.n + i)] = own + sum;
      }
      for (const NonZero& at : a_.gradient) linear += J_[std::size_t(at.number)] * dz[std::size_t(at.at)];
      std::fill(Hz.begin(), Hz.end(), P(0));
      add_used_curvature(places, dz, Hz);
      curved += a_.dot(dz, Hz) * P(0.5);
      if (a_.setup.has_gaps)
        a_.gather(a_.gap, places, next.data());
      else
        std::fill(next.begin(), next.end(), P(0));
      for (int j = 0; j < a_.z_size; ++j)
        for (const NonZero& at : a_.columns[std::size_t(j)])
          next[std::size_t(at.at)] += J_[std::size_t(at.number)] * dz[std::size_t(j)];
      std::swap(dx, next);
    }
    a_.go_to(places, 0);
    a_.gather(a_.J_end, places, J_end_.data()), a_.gather(a_.H_end, places, H_end_.data());
    const Pattern &g = a_.setup.end.jacobian_pattern(), &H = a_.setup.end.hessian_pattern();
    for (std::size_t i = 0; i < g.nnz(); ++i) linear += J_end_[i] * dx[g.col[i]];
    for (std::size_t i = 0; i < H.nnz(); ++i)
      curved += H_end_[i] * dx[H.row[i]] * dx[H.col[i]] * P(H.row[i] == H.col[i] ? 0.5 : 1);
    for (int l = 0; l < W; ++l) {
      if (!places.is_used[l]) continue;
      DdpState& s = a_.states[std::size_t(places.slot[l])];
      s.step_size = size[l], s.linear = linear[l], s.curved = curved[l];
    }
  }

 private:
  // Gives free lanes to slots that are not on their way.
  void begin(const std::vector<int>& wanted) {
    LanePlaces<W> fresh = places_;
    std::fill(fresh.is_used, fresh.is_used + W, false);
    int lane = 0;
    for (const int slot : wanted) {
      while (lane < W && places_.is_used[lane]) ++lane;
      if (lane == W) break;
      if (is_on_its_way(slot)) continue;
      DdpState& s = a_.states[std::size_t(slot)];
      s.is_convex = true;
      shift_.set(lane, s.shift), with_.set(lane, !a_.setup.is_exact && s.with_secants);
      least_pivot_.set(lane, HUGE_VAL), largest_curvature_.set(lane, 0);
      a_.go_to(places_, lane, slot, a_.N - 1), a_.go_to(fresh, lane, slot, a_.N - 1);
      places_.is_used[lane] = fresh.is_used[lane] = true;
    }
    if (any(fresh.used())) begin_cost_to_go(fresh);
  }
  bool is_on_its_way(int slot) const {
    for (int l = 0; l < W; ++l)
      if (places_.is_used[l] && places_.slot[l] == slot) return true;
    return false;
  }

  // For stages with a minimum.
  M pass_stage(const M& running) {
    a_.gather(a_.J, places_, J_.data());
    if (a_.is_limited || a_.setup.is_exact) a_.gather(a_.z, places_, z_.data());
    if (a_.setup.has_gaps) a_.gather(a_.gap, places_, gap_.data());
    for (int i = 0; i < a_.n; ++i) {
      m_of_[std::size_t(i)] = p_to_go_[std::size_t(i)];
      for (int j = 0; a_.setup.has_gaps && j < a_.n; ++j)
        m_of_[std::size_t(i)] += P_to_go_[std::size_t(i * a_.n + j)] * gap_[std::size_t(j)];
    }
    if (a_.setup.is_exact) curve();
    M used = with_ == P(1) && running;
    if (any(used)) a_.gather(a_.S, places_, S_.data());
    M good = stage(used, running);
    if (any(used && !good)) {
      used = used && good;
      good = stage(used, running);
    }
    is_used_[0] = select(used, P(1), P(0));
    a_.scatter(is_used_.data(), places_, a_.used);
    LanePlaces<W> sound = places_;
    for (int l = 0; l < W; ++l) sound.is_used[l] = sound.is_used[l] && good[l];
    least_pivot_ = select(good, min(least_pivot_, controls_.least_pivot()), least_pivot_);
    largest_curvature_ =
        select(good, max(largest_curvature_, controls_.largest_curvature()), largest_curvature_);
    if (any(good && running)) close_stage(sound);
    return good;
  }

  void begin_cost_to_go(const LanePlaces<W>& fresh) {
    const Pattern &J = a_.setup.end.jacobian_pattern(), &H = a_.setup.end.hessian_pattern();
    const M mask = fresh.used();
    a_.gather(a_.J_end, fresh, J_end_.data()), a_.gather(a_.H_end, fresh, H_end_.data());
    for (P& x : P_to_go_) x = select(mask, P(0), x);
    for (P& x : p_to_go_) x = select(mask, P(0), x);
    const auto set = [&](P& to, const P& from) { to = select(mask, from, to); };
    for (std::size_t i = 0; i < J.nnz(); ++i) set(p_to_go_[J.col[i]], J_end_[i]);
    for (std::size_t i = 0; i < H.nnz(); ++i) {
      set(P_to_go_[H.row[i] * std::size_t(a_.n) + H.col[i]], H_end_[i]);
      set(P_to_go_[H.col[i] * std::size_t(a_.n) + H.row[i]], H_end_[i]);
    }
    LanePlaces<W> ends = fresh;
    a_.go_to(ends, a_.N), a_.scatter(p_to_go_.data(), ends, a_.slope);
  }

  // The curvature of a stage, weighted by the slope of the cost to go.
  void curve() {
    std::copy(m_of_.begin(), m_of_.end(), weights_.begin());
    weights_[std::size_t(a_.n)] = P(1);
    a_.gather(a_.p, places_, p_.data());
    std::uint32_t left[W];
    step_.run(Order::kSecond, 1,
              {.x = reinterpret_cast<const double*>(z_.data()),
               .p = reinterpret_cast<const double*>(p_.data()),
               .w = reinterpret_cast<const double*>(weights_.data()),
               .hessian = reinterpret_cast<double*>(H_.data())},
              left);
    a_.scatter(H_.data(), places_, a_.H);
  }

  // Q = H + F^T P F, q = g + F^T m, the lower triangle; then the best controls, where they exist.
  M stage(const M& with_secants, const M& running) {
    const P* const J = J_.data();
    add_own_curvature(with_secants);
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
    return minimise(running);
  }

  void add_own_curvature(const M& with_secants) {
    std::fill(Q_.begin(), Q_.end(), P(0));
    if (a_.setup.is_exact) {
      const Pattern& at = a_.setup.step.hessian_pattern();
      const P* const H = H_.data();
      for (std::size_t i = 0; i < at.nnz(); ++i) Q_[at.row[i] * std::size_t(a_.z_size) + at.col[i]] = H[i];
      return;
    }
    const P* const J = J_.data();
    for (const auto& residual : a_.residuals) {
      for (const NonZero& a : residual) {
        const P twice = P(2) * J[a.number];
        for (const NonZero& b : residual)
          if (b.at <= a.at) Q_[std::size_t(a.at * a_.z_size + b.at)] += twice * J[b.number];
      }
    }
    if (!any(with_secants)) return;
    const P* const S = S_.data();
    for (int a = 0, at = 0; a < a_.z_size; ++a)
      for (int b = 0; b <= a; ++b, ++at)
        Q_[std::size_t(a * a_.z_size + b)] += select(with_secants, S[at], P(0));
  }

  P& Q_uu(int i, int j) {
    return Q_[std::size_t((a_.n + std::max(i, j)) * a_.z_size + a_.n + std::min(i, j))];
  }
  P& Q_ux(int i, int j) { return Q_[std::size_t((a_.n + i) * a_.z_size + j)]; }

  M minimise(const M& running) {
    for (int i = 0; i < a_.m; ++i)
      for (int j = 0; j < a_.m; ++j) Q_uu_[std::size_t(i * a_.m + j)] = Q_uu(i, j) + (i == j ? shift_ : P(0));
    if (!a_.is_limited)
      return controls_.minimise(Q_uu_.data(), &q_[std::size_t(a_.n)], nullptr, nullptr, running);
    for (int i = 0; i < a_.m; ++i) {
      const P& u = z_[std::size_t(a_.n + i)];
      lower_[std::size_t(i)] = P(a_.setup.lower[i]) - u, upper_[std::size_t(i)] = P(a_.setup.upper[i]) - u;
    }
    return controls_.minimise(Q_uu_.data(), &q_[std::size_t(a_.n)], lower_.data(), upper_.data(), running);
  }

  // K, and the cost to go of this policy: P = Q_xx + K^T Q_ux + Q_xu K + K^T Q_uu K.
  void close_stage(const LanePlaces<W>& sound) {
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
    }
    a_.scatter(p_to_go_.data(), sound, a_.slope), a_.scatter(u, sound, a_.k), a_.scatter(K, sound, a_.K);
  }

  void note_failure(int lane) {
    DdpState& s = a_.states[std::size_t(places_.slot[lane])];
    s.is_convex = false, s.failed_stage = places_.stage[lane];
    s.failed.resize(a_.m, a_.m);
    for (int i = 0; i < a_.m; ++i)
      for (int j = 0; j < a_.m; ++j) s.failed(i, j) = Q_uu(i, j)[lane] + (i == j ? shift_[lane] : 0);
  }

  // Of the stage whose J is in its room.
  void add_used_curvature(const LanePlaces<W>& places, const Packs& dz, Packs& to) {
    if (a_.setup.is_exact) {
      const Pattern& at = a_.setup.step.hessian_pattern();
      a_.gather(a_.H, places, H_.data());
      for (std::size_t i = 0; i < at.nnz(); ++i) {
        to[at.row[i]] += H_[i] * dz[at.col[i]];
        if (at.row[i] != at.col[i]) to[at.col[i]] += H_[i] * dz[at.row[i]];
      }
      return;
    }
    a_.add_curvature(J_.data(), dz, to);
    a_.gather(a_.used, places, is_used_.data());
    const M used = is_used_[0] == P(1);
    if (!any(used)) return;
    a_.gather(a_.S, places, S_.data());
    for (int i = 0, at = 0; i < a_.z_size; ++i) {
      for (int j = 0; j <= i; ++j, ++at) {
        const P entry = select(used, S_[std::size_t(at)], P(0));
        to[std::size_t(i)] += entry * dz[std::size_t(j)];
        if (i != j) to[std::size_t(j)] += entry * dz[std::size_t(i)];
      }
    }
  }

  LaneArrays<W>& a_;
  LaneFunction<W>& step_;
  LaneControls<W> controls_;
  LanePlaces<W> places_;       // of the slots on their way
  std::vector<bool> is_flat_;  // (slots)
  P shift_ = P(0), with_ = P(0), least_pivot_ = P(HUGE_VAL), largest_curvature_ = P(0);
  // Of one stage.
  Packs J_, z_, p_, gap_, S_, H_, J_end_, H_end_, is_used_;
  Packs P_to_go_, p_to_go_, m_of_, weights_, PF_, Q_, Q_uu_, q_, lower_, upper_, gain_, column_, of_q_, of_Q_;
};

}  // namespace DYNTAPE_VECTORS
}  // namespace dyntape
