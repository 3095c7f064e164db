// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/batch/lane_work.h>

#include <cmath>
#include <cstring>
#include <limits>

#include <dyntape/interface/control/batch/lane_changes.h>
#include <dyntape/interface/control/batch/lane_recursion.h>

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
  explicit WorkOf(const LaneSetup& setup)
      : a_(setup),
        step_(setup.step),
        end_(setup.end),
        secants_(a_),
        recursion_(a_, secants_, step_),
        changes_(a_) {
    slopes_ = sizes_ = a_.room(a_.m), dz_ = a_.room(a_.z_size), trial_y_ = a_.room(a_.y_size);
    trial_p_ = a_.room(a_.p_size), adjoint_ = a_.room(a_.n), of_step_ = a_.room(a_.z_size);
  }

  int lanes() const override { return W; }
  DdpState& at(int lane) override { return a_.states[std::size_t(lane)]; }

  void load(int lane, const MatrixXd& parameters, const VectorXd& at_end, const MatrixXd& x,
            const MatrixXd& u) override {
    for (int k = 0; k < a_.N; ++k) {
      put(a_.p, k * a_.p_size, lane, parameters.col(k));
      put(a_.z, k * a_.z_size, lane, x.col(k));
      put(a_.z, k * a_.z_size + a_.n, lane, u.col(k));
    }
    put(a_.x_end, 0, lane, x.col(a_.N));
    put(a_.p_end, 0, lane, at_end);
    for (Packs* of_stages : {&a_.K, &a_.k, &a_.gap})
      for (P& entry : *of_stages) entry.set(lane, 0);
    for (Packs* unknown : {&a_.slope, &a_.adjoint})
      for (P& entry : *unknown) entry.set(lane, std::numeric_limits<double>::quiet_NaN());
  }

  DdpMotion motion(int lane) const override {
    DdpMotion motion{MatrixXd(a_.n, a_.N + 1), MatrixXd(a_.m, a_.N), MatrixXd(a_.n, a_.N + 1),
                     MatrixXd(a_.n, a_.N + 1), std::vector<LqrPolicy>(std::size_t(a_.N))};
    for (int k = 0; k <= a_.N; ++k) {
      take(a_.slope, k * a_.n, lane, motion.slope.col(k)),
          take(a_.adjoint, k * a_.n, lane, motion.adjoint.col(k));
      if (k == a_.N) break;
      take(a_.z, k * a_.z_size, lane, motion.x.col(k)),
          take(a_.z, k * a_.z_size + a_.n, lane, motion.u.col(k));
      LqrPolicy& policy = motion.policy[std::size_t(k)];
      policy.K.resize(a_.m, a_.n), policy.k.resize(a_.m);
      take(a_.k, k * a_.m, lane, policy.k);
      for (int i = 0; i < a_.m; ++i)
        for (int j = 0; j < a_.n; ++j) policy.K(i, j) = a_.K[std::size_t((k * a_.m + i) * a_.n + j)][lane];
    }
    take(a_.x_end, 0, lane, motion.x.col(a_.N));
    return motion;
  }

  void set_policy(int lane, int last, const MatrixXd& change) override {
    for (int k = 0; k < a_.N; ++k) put(a_.k, k * a_.m, lane, change.col(k));
    const int until = std::min(last + 1, a_.N) * a_.m * a_.n;
    for (int i = 0; i < until; ++i) a_.K[std::size_t(i)].set(lane, 0);
    for (P& gap : a_.gap) gap.set(lane, 0);
  }

  void set_policy(int lane, const std::vector<LqrPolicy>& policy) override {
    for (int k = 0; k < a_.N; ++k) {
      put(a_.k, k * a_.m, lane, policy[std::size_t(k)].k);
      for (int i = 0; i < a_.m; ++i)
        for (int j = 0; j < a_.n; ++j)
          a_.K[std::size_t((k * a_.m + i) * a_.n + j)].set(lane, policy[std::size_t(k)].K(i, j));
    }
  }

  void roll_out(std::vector<LaneTrial>& trials) override {
    P length(0);
    bool in_place = true;
    for (int l = 0; l < W; ++l) {
      const bool is_used = std::size_t(l) < trials.size();
      source_[l] = is_used ? trials[std::size_t(l)].lane : l;
      length.set(l, is_used ? trials[std::size_t(l)].length : 0);
      in_place = in_place && source_[l] == l;
    }
    set_order();
    const P costs = in_place ? roll_out([](const P& x) { return x; }, length)
                             : roll_out([this](const P& x) { return moved(x); }, length);
    for (std::size_t l = 0; l < trials.size(); ++l) trials[l].cost = costs[int(l)];
  }

  void accept(const std::vector<int>& trial_of) override {
    bool all_in_place = true;
    for (int l = 0; l < W; ++l) all_in_place = all_in_place && trial_of[std::size_t(l)] == l;
    if (all_in_place) {
      std::swap(a_.z, a_.next_z), std::swap(a_.x_end, a_.next_end);
      return;
    }
    alignas(8 * W) std::int64_t is_taken[W];
    for (int l = 0; l < W; ++l) {
      is_taken[l] = trial_of[std::size_t(l)] >= 0 ? -1 : 0;
      source_[l] = std::max(trial_of[std::size_t(l)], 0);
    }
    set_order();
    typename M::Bits bits;
    std::memcpy(&bits, is_taken, sizeof bits);
    const M taken(bits);
    for (std::size_t i = 0; i < a_.z.size(); ++i) a_.z[i] = select(taken, moved(a_.next_z[i]), a_.z[i]);
    for (std::size_t i = 0; i < a_.x_end.size(); ++i)
      a_.x_end[i] = select(taken, moved(a_.next_end[i]), a_.x_end[i]);
  }

  void linearise(const std::vector<bool>& wanted) override {
    const M mask = a_.mask_of(wanted);
    std::uint32_t left[W];
    std::swap(a_.J, a_.J_before);
    step_.run(Order::kFirst, std::size_t(a_.N),
              {.x = numbers(a_.z), .p = numbers(a_.p), .y = numbers(a_.y), .jacobian = numbers(a_.J)}, left);
    const P one(1);
    std::uint32_t left_at_end[W];
    end_.run(Order::kSecond, 1,
             {.x = numbers(a_.x_end),
              .p = numbers(a_.p_end),
              .w = reinterpret_cast<const double*>(&one),
              .y = reinterpret_cast<double*>(&a_.cost_end),
              .jacobian = numbers(a_.J_end),
              .hessian = numbers(a_.H_end)},
             left_at_end);
    P finite = a_.cost_end * P(0), gap(0), gaps(0), cost = a_.cost_end;
    for (const Packs* all : {&a_.J_end, &a_.H_end})
      for (const P& x : *all) finite += x * P(0);
    for (int k = 0; a_.setup.has_gaps && k < a_.N; ++k) {
      const P* const next = k + 1 < a_.N ? &a_.z[std::size_t((k + 1) * a_.z_size)] : a_.x_end.data();
      for (int i = 0; i < a_.n; ++i) {
        P& entry = a_.gap[std::size_t(k * a_.n + i)];
        entry = select(mask, a_.y[std::size_t(k * a_.y_size + i)] - next[i], entry);
        gap = max(gap, abs(entry)), gaps += abs(entry);
      }
      cost += a_.y[std::size_t(k * a_.y_size + a_.n)];
    }
    for (const P& x : a_.y) finite += x * P(0);
    find_adjoint(mask, finite);
    P largest_x(0), largest_u(0);
    for (int k = 0; k < a_.N; ++k) {
      const P* const z = &a_.z[std::size_t(k * a_.z_size)];
      for (int i = 0; i < a_.n; ++i) largest_x = max(largest_x, abs(z[i]));
      for (int i = a_.n; i < a_.z_size; ++i) largest_u = max(largest_u, abs(z[i]));
    }
    for (const P& x : a_.x_end) largest_x = max(largest_x, abs(x));
    for (int l = 0; l < W; ++l) {
      if (!wanted[std::size_t(l)]) continue;
      DdpState& s = at(l);
      s.is_finite = finite[l] == 0 && !left[l] && !left_at_end[l];
      s.cost = cost[l], s.gap = gap[l], s.gaps = gaps[l];
      s.largest_x = largest_x[l], s.largest_u = largest_u[l];
      s.slopes.resize(a_.m), s.sizes.resize(a_.m);
      take(slopes_, 0, l, s.slopes), take(sizes_, 0, l, s.sizes);
    }
    if (!a_.setup.is_exact) secants_.learn(wanted);
  }

  void backward(const std::vector<bool>& wanted) override { recursion_.backward(wanted); }

  void find_changes() override { changes_.find(sizes_); }
  bool is_weakly_held(int lane) const override { return changes_.is_weak(lane); }
  ChangesOfMotion changes(int lane, bool with_motion) const override {
    ChangesOfMotion result(a_.n, a_.m, a_.N, with_motion);
    take(a_.adjoint, 0, lane, result.cost);
    if (!with_motion) return result;
    for (int j = 0; j < a_.n; ++j) {
      for (Index i = 0; i < result.x.rows(); ++i)
        result.x(i, j) = changes_.x()[std::size_t(i * a_.n + j)][lane];
      for (Index i = 0; i < result.u.rows(); ++i)
        result.u(i, j) = changes_.u()[std::size_t(i * a_.n + j)][lane];
    }
    return result;
  }

 private:
  static const double* numbers(const Packs& packs) { return reinterpret_cast<const double*>(packs.data()); }
  static double* numbers(Packs& packs) { return reinterpret_cast<double*>(packs.data()); }

  template <class Vector>
  static void put(Packs& to, int first, int lane, const Vector& from) {
    for (Index i = 0; i < from.size(); ++i) to[std::size_t(first + i)].set(lane, from[i]);
  }
  template <class Vector>
  static void take(const Packs& from, int first, int lane, Vector&& to) {
    for (Index i = 0; i < to.size(); ++i) to[i] = from[std::size_t(first + i)][lane];
  }

  void set_order() {
    alignas(8 * W) std::int64_t order[W];
    std::copy(source_, source_ + W, order);
    std::memcpy(&order_, order, sizeof order_);
  }
  // Lane l becomes that of lane source_[l].
  P moved(const P& x) const {
#if !defined(__clang__)
    if constexpr (8 * W <= DYNTAPE_REGISTER) return P(__builtin_shuffle(x.vector(), order_));
#endif
    alignas(8 * W) double in[W], out[W];
    x.store(in);
    for (int l = 0; l < W; ++l) out[l] = in[source_[l]];
    return P::load(out);
  }

  template <class Move>
  P roll_out(const Move& move, const P& length) {
    P cost(0), finite(0);
    const P rest = P(1) - length;
    std::uint32_t left[W], any_left[W] = {};
    for (int i = 0; i < a_.n; ++i) a_.next_z[std::size_t(i)] = move(a_.z[std::size_t(i)]);
    for (int k = 0; k < a_.N; ++k) {
      const P *const z = &a_.z[std::size_t(k * a_.z_size)], *const K = &a_.K[std::size_t(k * a_.m * a_.n)];
      P* const next = &a_.next_z[std::size_t(k * a_.z_size)];
      for (int i = 0; i < a_.n; ++i) dz_[std::size_t(i)] = next[i] - move(z[i]);
      for (int i = 0; i < a_.m; ++i) {
        P u = move(z[a_.n + i]) + length * move(a_.k[std::size_t(k * a_.m + i)]), feedback(0);
        for (int j = 0; j < a_.n; ++j) feedback += move(K[i * a_.n + j]) * dz_[std::size_t(j)];
        u += feedback;
        if (a_.is_limited) u = min(max(u, P(a_.setup.lower[i])), P(a_.setup.upper[i]));
        next[a_.n + i] = u;
      }
      for (int i = 0; i < a_.p_size; ++i)
        trial_p_[std::size_t(i)] = move(a_.p[std::size_t(k * a_.p_size + i)]);
      step_.run(Order::kValue, 1,
                {.x = reinterpret_cast<const double*>(next), .p = numbers(trial_p_), .y = numbers(trial_y_)},
                left);
      for (int l = 0; l < W; ++l) any_left[l] |= left[l];
      P* const end = k + 1 < a_.N ? next + a_.z_size : a_.next_end.data();
      for (int i = 0; i < a_.n; ++i) {
        finite += trial_y_[std::size_t(i)] * P(0);
        end[i] = trial_y_[std::size_t(i)];
        if (a_.setup.has_gaps) end[i] -= rest * move(a_.gap[std::size_t(k * a_.n + i)]);
      }
      cost += trial_y_[std::size_t(a_.n)];
    }
    Packs at_end(a_.p_end);
    for (P& x : at_end) x = move(x);
    P of_end;
    end_.run(Order::kValue, 1,
             {.x = numbers(a_.next_end), .p = numbers(at_end), .y = reinterpret_cast<double*>(&of_end)},
             left);
    cost += of_end + finite;
    for (int l = 0; l < W; ++l)
      if (left[l] | any_left[l]) cost.set(l, std::numeric_limits<double>::quiet_NaN());
    return cost;
  }

  // lambda_k = L_x + A^T lambda_{k+1}, and of each control the largest slope that it can still follow downwards.
  void find_adjoint(const M& mask, P& finite) {
    Packs &adjoint = adjoint_, &all = of_step_;
    std::fill(adjoint.begin(), adjoint.end(), P(0));
    const Pattern& of_end = a_.setup.end.jacobian_pattern();
    for (std::size_t i = 0; i < of_end.nnz(); ++i) adjoint[of_end.col[i]] = a_.J_end[i];
    std::fill(slopes_.begin(), slopes_.end(), P(0)), std::fill(sizes_.begin(), sizes_.end(), P(0));
    for (int k = a_.N;; --k) {
      for (int i = 0; i < a_.n; ++i) {
        P& kept = a_.adjoint[std::size_t(k * a_.n + i)];
        kept = select(mask, adjoint[std::size_t(i)], kept);
      }
      if (k == 0) break;
      const P *const J = &a_.J[std::size_t((k - 1) * a_.J_size)], *const z =
                                                                      &a_.z[std::size_t((k - 1) * a_.z_size)];
      for (int j = 0; j < a_.z_size; ++j) {
        P sum(0);
        for (const NonZero& at : a_.columns[std::size_t(j)])
          sum += J[at.number] * adjoint[std::size_t(at.at)];
        all[std::size_t(j)] = sum;
        if (j >= a_.n) sizes_[std::size_t(j - a_.n)] = max(sizes_[std::size_t(j - a_.n)], abs(sum));
      }
      add_sizes(k - 1, all);
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
  void add_sizes(int k, const Packs& of_dynamics) {
    for (const NonZero& at : a_.gradient) {
      if (at.at < a_.n) continue;
      P& size = sizes_[std::size_t(at.at - a_.n)];
      size =
          max(size, abs(of_dynamics[std::size_t(at.at)]) + abs(a_.J[std::size_t(k * a_.J_size + at.number)]));
    }
  }

  LaneArrays<W> a_;
  LaneFunction<W> step_, end_;
  LaneSecants<W> secants_;
  LaneRecursion<W> recursion_;
  LaneChanges<W> changes_;
  int source_[W] = {};
  typename M::Bits order_ = {};                                        // the same
  Packs slopes_, sizes_, dz_, trial_y_, trial_p_, adjoint_, of_step_;  // of one stage
};

}  // namespace

std::unique_ptr<LaneWork> make_lane_work(const LaneSetup& setup) {
  switch (setup.step.lane_width()) {
    case 4:
      return std::make_unique<WorkOf<4>>(setup);
    case 2:
      return std::make_unique<WorkOf<2>>(setup);
    default:
      return std::make_unique<WorkOf<8>>(setup);
  }
}

}  // namespace dyntape
