// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/batch/lane_work.h>

#include <cmath>
#include <limits>

#include <dyntape/interface/control/batch/lane_changes.h>
#include <dyntape/interface/control/batch/lane_recursion.h>
#include <dyntape/interface/control/batch/lane_secants.h>

namespace dyntape {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

template <int W>
class WorkOf final : public LaneWork {
  using P = Pack<double, W>;
  using M = Mask<W>;
  using Packs = std::vector<P>;

 public:
  WorkOf(const LaneSetup& setup, int slots_a_lane)
      : a_(setup, W * slots_a_lane),
        now_(a_),
        step_(setup.step),
        end_(setup.end),
        secants_(a_),
        recursion_(a_, step_),
        changes_(a_) {
    next_z_ = a_.room(a_.N * a_.z_size), next_end_ = gap_ = a_.room(a_.n);
    slopes_ = sizes_ = a_.room(a_.m), K_ = a_.room(a_.m * a_.n), k_ = a_.room(a_.m), z_ = a_.room(a_.z_size);
    dz_ = a_.room(a_.n), trial_y_ = a_.room(a_.y_size), trial_p_ = a_.room(a_.p_size);
    at_end_ = a_.room(a_.p_end.size), adjoint_ = a_.room(a_.n), of_step_ = a_.room(a_.z_size);
  }

  int lanes() const override { return W; }
  int slots() const override { return a_.slots; }
  DdpState& at(int slot) override { return a_.states[std::size_t(slot)]; }

  void load(int slot, const MatrixXd& parameters, const VectorXd& at_end, const MatrixXd& x,
            const MatrixXd& u) override {
    for (int k = 0; k < a_.N; ++k) {
      put(a_.p, slot, k, parameters.col(k));
      std::copy_n(x.col(k).data(), a_.n, a_.at(a_.z, slot, k));
      std::copy_n(u.col(k).data(), a_.m, a_.at(a_.z, slot, k) + a_.n);
    }
    put(a_.x_end, slot, 0, x.col(a_.N)), put(a_.p_end, slot, 0, at_end);
    for (const SlotNumbers* known : {&a_.K, &a_.k, &a_.gap}) a_.fill(*known, slot, 0);
    for (const SlotNumbers* unknown : {&a_.slope, &a_.adjoint})
      a_.fill(*unknown, slot, std::numeric_limits<double>::quiet_NaN());
  }

  DdpMotion motion(int slot) const override {
    DdpMotion motion{MatrixXd(a_.n, a_.N + 1), MatrixXd(a_.m, a_.N), MatrixXd(a_.n, a_.N + 1),
                     MatrixXd(a_.n, a_.N + 1), std::vector<LqrPolicy>(std::size_t(a_.N))};
    for (int k = 0; k <= a_.N; ++k) {
      motion.slope.col(k) = entries(a_.at(a_.slope, slot, k), a_.n);
      motion.adjoint.col(k) = entries(a_.at(a_.adjoint, slot, k), a_.n);
      if (k == a_.N) break;
      motion.x.col(k) = entries(a_.at(a_.z, slot, k), a_.n);
      motion.u.col(k) = entries(a_.at(a_.z, slot, k) + a_.n, a_.m);
      LqrPolicy& policy = motion.policy[std::size_t(k)];
      policy.k = entries(a_.at(a_.k, slot, k), a_.m);
      policy.K = entries(a_.at(a_.K, slot, k), a_.m * a_.n).reshaped(a_.n, a_.m).transpose();
    }
    motion.x.col(a_.N) = entries(a_.at(a_.x_end, slot), a_.n);
    return motion;
  }

  void set_policy(int slot, int last, const MatrixXd& change) override {
    for (int k = 0; k < a_.N; ++k) put(a_.k, slot, k, change.col(k));
    for (int k = 0; k <= std::min(last, a_.N - 1); ++k) std::fill_n(a_.at(a_.K, slot, k), a_.m * a_.n, 0.0);
    a_.fill(a_.gap, slot, 0);
  }

  void set_policy(int slot, const std::vector<LqrPolicy>& policy) override {
    for (int k = 0; k < a_.N; ++k) {
      const LqrPolicy& of_stage = policy[std::size_t(k)];
      put(a_.k, slot, k, of_stage.k);
      for (int i = 0; i < a_.m; ++i)
        for (int j = 0; j < a_.n; ++j) a_.at(a_.K, slot, k)[i * a_.n + j] = of_stage.K(i, j);
    }
  }

  void roll_out(std::vector<LaneTrial>& trials) override {
    P length(0);
    std::vector<int> slots;
    for (std::size_t l = 0; l < trials.size(); ++l) {
      slots.push_back(trials[l].slot);
      length.set(int(l), trials[l].length);
    }
    LanePlaces<W> places = a_.places(slots);
    const P costs = roll_out(places, length);
    for (std::size_t l = 0; l < trials.size(); ++l) trials[l].cost = costs[int(l)];
  }

  void accept(int slot, int trial) override {
    for (int k = 0; k < a_.N; ++k) take(next_z_, k * a_.z_size, trial, a_.at(a_.z, slot, k), a_.z_size);
    take(next_end_, 0, trial, a_.at(a_.x_end, slot), a_.n);
  }

  void linearise(const std::vector<int>& slots) override {
    LanePlaces<W> places = a_.places(slots);
    gather_motion(places);
    std::uint32_t left[W], left_at_end[W];
    step_.run(Order::kFirst, std::size_t(a_.N),
              {.x = numbers(now_.z), .p = numbers(now_.p), .y = numbers(now_.y), .jacobian = numbers(now_.J)},
              left);
    const P one(1);
    P cost;
    end_.run(Order::kSecond, 1,
             {.x = numbers(now_.x_end),
              .p = numbers(now_.p_end),
              .w = reinterpret_cast<const double*>(&one),
              .y = reinterpret_cast<double*>(&cost),
              .jacobian = numbers(now_.J_end),
              .hessian = numbers(now_.H_end)},
             left_at_end);
    P finite = cost * P(0), gap(0), gaps(0);
    for (const Packs* all : {&now_.J_end, &now_.H_end})
      for (const P& x : *all) finite += x * P(0);
    for (int k = 0; a_.setup.has_gaps && k < a_.N; ++k) {
      const P* const next = k + 1 < a_.N ? &now_.z[std::size_t((k + 1) * a_.z_size)] : now_.x_end.data();
      for (int i = 0; i < a_.n; ++i) {
        P& entry = gap_[std::size_t(i)];
        entry = now_.y[std::size_t(k * a_.y_size + i)] - next[i];
        gap = max(gap, abs(entry)), gaps += abs(entry);
      }
      a_.go_to(places, k), a_.scatter(gap_.data(), places, a_.gap);
      cost += now_.y[std::size_t(k * a_.y_size + a_.n)];
    }
    for (const P& x : now_.y) finite += x * P(0);
    find_adjoint(finite);
    P largest_x(0), largest_u(0);
    for (int k = 0; k < a_.N; ++k) {
      const P* const z = &now_.z[std::size_t(k * a_.z_size)];
      for (int i = 0; i < a_.n; ++i) largest_x = max(largest_x, abs(z[i]));
      for (int i = a_.n; i < a_.z_size; ++i) largest_u = max(largest_u, abs(z[i]));
    }
    for (const P& x : now_.x_end) largest_x = max(largest_x, abs(x));
    for (int l = 0; l < int(slots.size()); ++l) {
      DdpState& s = at(slots[std::size_t(l)]);
      s.is_finite = finite[l] == 0 && !left[l] && !left_at_end[l];
      s.cost = cost[l], s.gap = gap[l], s.gaps = gaps[l];
      s.largest_x = largest_x[l], s.largest_u = largest_u[l];
      s.slopes.resize(a_.m), s.sizes.resize(a_.m);
      take(slopes_, 0, l, s.slopes.data(), a_.m), take(sizes_, 0, l, s.sizes.data(), a_.m);
    }
    if (!a_.setup.is_exact) secants_.learn(places, now_);
    scatter_motion(places);
  }

  std::vector<int> backward(const std::vector<int>& slots) override { return recursion_.backward(slots); }
  void predict(const std::vector<int>& slots) override { recursion_.predict(slots); }

  VectorXd cost_slopes(int slot) const override { return entries(a_.at(a_.adjoint, slot), a_.n); }
  void find_changes(const std::vector<int>& slots) override { changes_.find(a_.places(slots)); }
  bool is_weakly_held(int lane) const override { return changes_.is_weak(lane); }
  bool is_flat(int slot) const override { return recursion_.is_flat(slot); }
  void take_changes(int lane, ChangesOfMotion& to) const override {
    for (Index j = 0; j < a_.n; ++j) {
      for (Index i = 0; i < to.x.rows(); ++i) to.x(i, j) = changes_.x()[std::size_t(i * a_.n + j)][lane];
      for (Index i = 0; i < to.u.rows(); ++i) to.u(i, j) = changes_.u()[std::size_t(i * a_.n + j)][lane];
    }
  }

 private:
  static const double* numbers(const Packs& packs) { return reinterpret_cast<const double*>(packs.data()); }
  static double* numbers(Packs& packs) { return reinterpret_cast<double*>(packs.data()); }
  static Eigen::Map<const VectorXd> entries(const double* from, int count) { return {from, count}; }

  template <class Vector>
  void put(const SlotNumbers& to, int slot, int k, const Vector& from) {
    std::copy_n(from.data(), from.size(), a_.at(to, slot, k));
  }
  static void take(const Packs& from, int first, int lane, double* to, int count) {
    const double* const lanes = numbers(from) + first * W + lane;
    for (int i = 0; i < count; ++i) to[i] = lanes[i * W];
  }

  void gather_motion(LanePlaces<W>& places) {
    a_.go_to(places, 0);
    a_.gather(a_.x_end, places, now_.x_end.data()), a_.gather(a_.p_end, places, now_.p_end.data());
    for (int k = 0; k < a_.N; ++k) {
      a_.go_to(places, k);
      a_.gather(a_.z, places, &now_.z[std::size_t(k * a_.z_size)]);
      a_.gather(a_.p, places, &now_.p[std::size_t(k * a_.p_size)]);
    }
  }

  void scatter_motion(LanePlaces<W>& places) {
    for (int k = 0; k <= a_.N; ++k) {
      a_.go_to(places, k);
      a_.scatter(&now_.adjoint[std::size_t(k * a_.n)], places, a_.adjoint);
      if (k < a_.N) a_.scatter(now_.J.data() + k * a_.J_size, places, a_.J);
    }
    a_.go_to(places, 0);
    a_.scatter(now_.J_end.data(), places, a_.J_end), a_.scatter(now_.H_end.data(), places, a_.H_end);
  }

  P roll_out(LanePlaces<W>& places, const P& length) {
    P cost(0), finite(0);
    const P rest = P(1) - length;
    std::uint32_t left[W], any_left[W] = {};
    for (int k = 0; k < a_.N; ++k) {
      a_.go_to(places, k);
      a_.gather(a_.z, places, z_.data()), a_.gather(a_.K, places, K_.data()),
          a_.gather(a_.k, places, k_.data());
      a_.gather(a_.p, places, trial_p_.data());
      P* const next = &next_z_[std::size_t(k * a_.z_size)];
      if (k == 0) std::copy_n(z_.data(), a_.n, next);
      for (int i = 0; i < a_.n; ++i) dz_[std::size_t(i)] = next[i] - z_[std::size_t(i)];
      for (int i = 0; i < a_.m; ++i) {
        P u = z_[std::size_t(a_.n + i)] + length * k_[std::size_t(i)], feedback(0);
        for (int j = 0; j < a_.n; ++j) feedback += K_[std::size_t(i * a_.n + j)] * dz_[std::size_t(j)];
        u += feedback;
        if (a_.is_limited) u = min(max(u, P(a_.setup.lower[i])), P(a_.setup.upper[i]));
        next[a_.n + i] = u;
      }
      step_.run(Order::kValue, 1,
                {.x = reinterpret_cast<const double*>(next), .p = numbers(trial_p_), .y = numbers(trial_y_)},
                left);
      for (int l = 0; l < W; ++l) any_left[l] |= left[l];
      P* const end = k + 1 < a_.N ? next + a_.z_size : next_end_.data();
      if (a_.setup.has_gaps) a_.gather(a_.gap, places, gap_.data());
      for (int i = 0; i < a_.n; ++i) {
        finite += trial_y_[std::size_t(i)] * P(0);
        end[i] = trial_y_[std::size_t(i)];
        if (a_.setup.has_gaps) end[i] -= rest * gap_[std::size_t(i)];
      }
      cost += trial_y_[std::size_t(a_.n)];
    }
    a_.go_to(places, 0);
    a_.gather(a_.p_end, places, at_end_.data());
    P of_end;
    end_.run(Order::kValue, 1,
             {.x = numbers(next_end_), .p = numbers(at_end_), .y = reinterpret_cast<double*>(&of_end)}, left);
    cost += of_end + finite;
    for (int l = 0; l < W; ++l)
      if (left[l] | any_left[l]) cost.set(l, std::numeric_limits<double>::quiet_NaN());
    return cost;
  }

  // lambda_k = L_x + A^T lambda_{k+1}, and of each control the largest slope that it can still follow downwards.
  void find_adjoint(P& finite) {
    Packs &adjoint = adjoint_, &all = of_step_;
    std::fill(adjoint.begin(), adjoint.end(), P(0));
    const Pattern& of_end = a_.setup.end.jacobian_pattern();
    for (std::size_t i = 0; i < of_end.nnz(); ++i) adjoint[of_end.col[i]] = now_.J_end[i];
    std::fill(slopes_.begin(), slopes_.end(), P(0)), std::fill(sizes_.begin(), sizes_.end(), P(0));
    for (int k = a_.N;; --k) {
      std::copy(adjoint.begin(), adjoint.end(), now_.adjoint.begin() + k * a_.n);
      if (k == 0) break;
      const P *const J = now_.J.data() + (k - 1) * a_.J_size, *const z =
                                                                  &now_.z[std::size_t((k - 1) * a_.z_size)];
      for (int j = 0; j < a_.z_size; ++j) {
        P sum(0);
        for (const NonZero& at : a_.columns[std::size_t(j)])
          sum += J[at.number] * adjoint[std::size_t(at.at)];
        all[std::size_t(j)] = sum;
        if (j >= a_.n) sizes_[std::size_t(j - a_.n)] = max(sizes_[std::size_t(j - a_.n)], abs(sum));
      }
      add_sizes(J, all);
      for (const NonZero& at : a_.gradient) all[std::size_t(at.at)] += J[at.number];
      for (const auto& residual : a_.residuals)
        for (const NonZero& at : residual) finite += J[at.number] * P(0);
      for (int i = 0; i < a_.m; ++i) {
        const P slope = all[std::size_t(a_.n + i)], lower(a_.setup.lower[i]), upper(a_.setup.upper[i]);
        const M held = lower >= upper || (z[a_.n + i] <= lower && slope > P(0)) ||
                       (z[a_.n + i] >= upper && slope < P(0));
        slopes_[std::size_t(i)] = max(slopes_[std::size_t(i)], select(held, P(0), abs(slope)));
        finite += slope * P(0);
      }
      std::copy(all.begin(), all.begin() + a_.n, adjoint.begin());
    }
    for (const P& x : adjoint) finite += x * P(0);
  }

  // |L_u| + |B^T lambda|
  void add_sizes(const P* J, const Packs& of_dynamics) {
    for (const NonZero& at : a_.gradient) {
      if (at.at < a_.n) continue;
      P& size = sizes_[std::size_t(at.at - a_.n)];
      size = max(size, abs(of_dynamics[std::size_t(at.at)]) + abs(J[at.number]));
    }
  }

  LaneArrays<W> a_;
  LaneMotion<W> now_;  // of the slots that are linearised
  LaneFunction<W> step_, end_;
  LaneSecants<W> secants_;
  LaneRecursion<W> recursion_;
  LaneChanges<W> changes_;
  Packs next_z_, next_end_;                                          // of the last trials
  Packs slopes_, sizes_, z_, K_, k_, gap_, dz_, trial_y_, trial_p_;  // of one stage
  Packs at_end_, adjoint_, of_step_;
};

}  // namespace

std::unique_ptr<LaneWork> make_lane_work(const LaneSetup& setup, int slots_a_lane) {
  switch (setup.step.lane_width()) {
    case 4:
      return std::make_unique<WorkOf<4>>(setup, slots_a_lane);
    case 2:
      return std::make_unique<WorkOf<2>>(setup, slots_a_lane);
    default:
      return std::make_unique<WorkOf<8>>(setup, slots_a_lane);
  }
}

}  // namespace dyntape
