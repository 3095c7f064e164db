// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/riccati/restoration.h>

#include <algorithm>
#include <cmath>

namespace dyntape {

RestorationEnd Restoration::run(BarrierPoint& point, double mu, double small,
                                const std::function<bool(const BarrierPoint&)>& takes,
                                const std::function<bool()>& stops,
                                const std::function<bool(BarrierPoint&)>& evaluate) {
  // Ten times as many find no more: of an arm's goals that end so they lessen the squares by a fiftieth, and the sum not at all.
  constexpr int kMostSteps = 300;
  constexpr double kEnough = 0.9, kArmijo = 1e-4, kShortest = 1e-12, kTau = 0.99, kFlatPart = 1e-6;
  constexpr double kLeastShift = 1e-10, kShort = 0.3, kRaise = 10, kLower = 0.2, kMostShift = 1e12;
  const Eigen::Index n = barrier_.n(), m = barrier_.m();
  const double unreached = kEnough * point.sum;
  Eigen::VectorXd jacobian(Eigen::Index(nlp_.shape().jacobian.nnz())),
      hessian(Eigen::Index(nlp_.shape().hessian.nnz()));
  Eigen::VectorXd slope, of_c(n + m), step(n + m);
  KktDiagonal diagonal{Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(m), 0, 1, false};
  KktVector right{Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(m), Eigen::VectorXd::Zero(m)}, change;
  // All logarithms together weigh less than what is lacked.
  const auto is_bound = [](double bound) { return std::abs(bound) < HUGE_VAL; };
  const auto bounds = std::count_if(barrier_.lower().begin(), barrier_.lower().end(), is_bound) +
                      std::count_if(barrier_.upper().begin(), barrier_.upper().end(), is_bound);
  const double share = 0.1 / double(std::max<std::ptrdiff_t>(bounds, 1));
  mu = std::min(mu, share * point.c.squaredNorm());
  // Small ones let a point leave a bound that it is stuck at.
  BoundMultipliers bound_multipliers;
  bound_multipliers.begin(barrier_, point.w, mu, 1);
  BarrierPoint trial;
  const auto merit = [&](const BarrierPoint& at) {
    BarrierPoint without;
    without.w = at.w;
    return barrier_.value(without, mu) + 0.5 * at.c.squaredNorm();
  };
  double damping = 1e-6;  // of the square of the largest slope on the way, or of 1 where that is less
  double steepest = 0;
  for (int i = 0; i < kMostSteps; ++i) {
    if (stops()) return RestorationEnd::kStopped;
    if (i > 0 && point.sum <= unreached && takes(point)) return RestorationEnd::kRestored;
    if (point.largest <= small) return takes(point) ? RestorationEnd::kRestored : RestorationEnd::kFailed;
    if (!nlp_.hessian(point.w.data(), 0, point.c.data(), hessian.data()) ||
        !nlp_.jacobian(point.w.data(), jacobian.data()))
      return RestorationEnd::kFailed;
    kkt_.set(jacobian.data(), hessian.data());

    // The slope of what is lacked, and of the barrier.
    right.x.setZero();
    kkt_.add_transposed(point.c, right.x);
    of_c << right.x, -point.c;
    barrier_.slope(point.w, mu, slope);
    bound_multipliers.curve(barrier_, point.w, diagonal);
    for (Eigen::Index j = 0; j < n + m; ++j) {
      if (!barrier_.moves(j)) of_c[j] = slope[j] = 0;
    }
    // No direction lessens what is lacked, but for what the bounds hold back.
    const double size = point.largest;
    if (jacobian.size() > 0) steepest = std::max(steepest, jacobian.cwiseAbs().maxCoeff());
    if ((of_c + slope).cwiseAbs().maxCoeff() <= kFlatPart * size * std::min(1.0, steepest)) {
      if (mu <= 1e-3 * kFlatPart * size * size || mu < 1e-16) return RestorationEnd::kInfeasible;
      mu *= 0.1;
      continue;
    }
    right.x = -slope.head(n), right.s = -slope.tail(m), right.c = -point.c;
    const double before = merit(point);
    bool is_better = false;
    for (; !is_better && damping <= kMostShift; damping *= kRaise) {
      diagonal.shift = damping * std::min(1.0, steepest * steepest);
      // With the curvature of what is lacked, where that leaves a minimum.
      diagonal.with_hessian = true;
      if (!kkt_.factor(diagonal)) {
        diagonal.with_hessian = false;
        if (!kkt_.factor(diagonal)) continue;
      }
      kkt_.solve(right, change);
      step << change.x, change.s;
      const double along = (of_c + slope).dot(step);
      if (!(along < 0)) continue;
      bound_multipliers.step(barrier_, point.w, step, mu);
      const double longest = barrier_.longest(point.w, step, kTau);
      for (double length = longest; length > kShortest * longest; length /= 2) {
        trial.w = point.w + length * step;
        if (!evaluate(trial)) continue;
        const double after = merit(trial);
        if (!(after <= before + kArmijo * length * along + 1e-15 * std::abs(before))) continue;
        is_better = true;
        // Steps that are taken by a small part were too long: the next one is damped.
        damping = std::max(kLeastShift, damping * (length < kShort * longest ? kRaise : kLower));
        break;
      }
      if (is_better) break;
      if (stops()) return RestorationEnd::kStopped;
    }
    if (!is_better) return RestorationEnd::kFailed;
    std::swap(point, trial);
    mu = std::min(mu, share * point.c.squaredNorm());
    bound_multipliers.move(barrier_, point.w, bound_multipliers.longest(kTau), mu);
  }
  return RestorationEnd::kFailed;
}

}  // namespace dyntape
