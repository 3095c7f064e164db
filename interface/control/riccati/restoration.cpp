// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/riccati/restoration.h>

#include <algorithm>
#include <cmath>

namespace dyntape {

namespace {

using Eigen::VectorXd;

// Ten times as many find no more: of an arm's goals that end so they lessen the squares by a fiftieth, and the sum not at all.
constexpr int kMostRestorationSteps = 300;
constexpr double kEnough = 0.9, kArmijo = 1e-4, kShortest = 1e-12, kRestorationTau = 0.99, kFlatPart = 1e-6;
constexpr double kLeastRestorationDamping = 1e-10, kShort = 0.3, kRaise = 10, kLower = 0.2,
                 kMostRestorationDamping = 1e12;
constexpr double kLogarithms = 0.1;  // of what is lacked, all of them together

std::ptrdiff_t finite_bounds(const Barrier& barrier) {
  const auto is_bound = [](double bound) { return std::abs(bound) < HUGE_VAL; };
  return std::count_if(barrier.lower().begin(), barrier.lower().end(), is_bound) +
         std::count_if(barrier.upper().begin(), barrier.upper().end(), is_bound);
}

}  // namespace

Restoration::Restoration(Nlp& nlp, StagewiseKkt& kkt, const Barrier& barrier)
    : nlp_(nlp),
      kkt_(kkt),
      barrier_(barrier),
      n_(barrier.n()),
      m_(barrier.m()),
      share_(kLogarithms / double(std::max<std::ptrdiff_t>(finite_bounds(barrier), 1))),
      jacobian_(Eigen::Index(nlp.shape().jacobian.nnz())),
      hessian_(Eigen::Index(nlp.shape().hessian.nnz())),
      of_c_(n_ + m_),
      step_(n_ + m_),
      diagonal_{VectorXd::Zero(n_), VectorXd::Zero(m_), 0, 1, false},
      right_{VectorXd::Zero(n_), VectorXd::Zero(m_), VectorXd::Zero(m_)} {}

RestorationEnd Restoration::run(BarrierPoint& point, double mu, double small, const Method& method) {
  const double unreached = kEnough * point.sum;
  mu_ = mu;
  lower_barrier(point);
  // Small ones let a point leave a bound that it is stuck at.
  bound_multipliers_.begin(barrier_, point.w, mu_, 1);
  for (int i = 0; i < kMostRestorationSteps; ++i) {
    if (method.stops()) return RestorationEnd::kStopped;
    if (i > 0 && point.sum <= unreached && method.takes(point)) return RestorationEnd::kRestored;
    if (point.largest <= small)
      return method.takes(point) ? RestorationEnd::kRestored : RestorationEnd::kFailed;
    if (!linearise(point)) return RestorationEnd::kFailed;
    if (is_flat(point)) {
      if (mu_ <= 1e-3 * kFlatPart * point.largest * point.largest || mu_ < 1e-16)
        return RestorationEnd::kInfeasible;
      mu_ *= 0.1;
    } else if (const auto end = improve(point, method)) {
      return *end;
    }
  }
  return RestorationEnd::kFailed;
}

// The slopes of what is lacked and of the barrier; false: not finite.
bool Restoration::linearise(const BarrierPoint& point) {
  if (!nlp_.hessian(point.w.data(), 0, point.c.data(), hessian_.data()) ||
      !nlp_.jacobian(point.w.data(), jacobian_.data()))
    return false;
  kkt_.set(jacobian_.data(), hessian_.data());
  right_.x.setZero();
  kkt_.add_transposed(point.c, right_.x);
  of_c_ << right_.x, -point.c;
  barrier_.slope(point.w, mu_, slope_);
  bound_multipliers_.curve(barrier_, point.w, diagonal_);
  for (Eigen::Index j = 0; j < n_ + m_; ++j) {
    if (!barrier_.moves(j)) of_c_[j] = slope_[j] = 0;
  }
  if (jacobian_.size() > 0) steepest_ = std::max(steepest_, jacobian_.cwiseAbs().maxCoeff());
  return true;
}

// Whether no direction lessens what is lacked, but for what the bounds hold back.
bool Restoration::is_flat(const BarrierPoint& point) const {
  return (of_c_ + slope_).cwiseAbs().maxCoeff() <= kFlatPart * point.largest * std::min(1.0, steepest_);
}

// A step to a better point, damped as much as it needs; or why there is none.
std::optional<RestorationEnd> Restoration::improve(BarrierPoint& point, const Method& method) {
  right_.x = -slope_.head(n_), right_.s = -slope_.tail(m_), right_.c = -point.c;
  for (; damping_ <= kMostRestorationDamping; damping_ *= kRaise) {
    if (!find_step(point)) continue;
    if (const auto part = search(point, method)) {
      // Steps that are taken by a small part were too long: the next one is damped.
      damping_ = std::max(kLeastRestorationDamping, damping_ * (*part < kShort ? kRaise : kLower));
      std::swap(point, trial_);
      lower_barrier(point);
      bound_multipliers_.move(barrier_, point.w, bound_multipliers_.longest(kRestorationTau), mu_);
      return {};
    }
    if (method.stops()) return RestorationEnd::kStopped;
  }
  return RestorationEnd::kFailed;
}

// With the curvature of what is lacked, where that leaves a minimum; false: it does not lead down.
bool Restoration::find_step(const BarrierPoint& point) {
  diagonal_.shift = damping_ * std::min(1.0, steepest_ * steepest_);
  diagonal_.with_hessian = true;
  if (!kkt_.factor(diagonal_)) {
    diagonal_.with_hessian = false;
    if (!kkt_.factor(diagonal_)) return false;
  }
  kkt_.solve(right_, change_);
  step_ << change_.x, change_.s;
  if (!((of_c_ + slope_).dot(step_) < 0)) return false;
  bound_multipliers_.step(barrier_, point.w, step_, mu_);
  return true;
}

// The part of the longest step that leads to a better point, which is trial_ then.
std::optional<double> Restoration::search(const BarrierPoint& point, const Method& method) {
  const double along = (of_c_ + slope_).dot(step_), before = merit(point);
  const double longest = barrier_.longest(point.w, step_, kRestorationTau);
  for (double length = longest; length > kShortest * longest; length /= 2) {
    trial_.w = point.w + length * step_;
    if (!method.evaluate(trial_)) continue;
    if (merit(trial_) <= before + kArmijo * length * along + 1e-15 * std::abs(before))
      return length / longest;
  }
  return {};
}

double Restoration::merit(const BarrierPoint& at) const {
  BarrierPoint without;
  without.w = at.w;
  return barrier_.value(without, mu_) + 0.5 * at.c.squaredNorm();
}

void Restoration::lower_barrier(const BarrierPoint& point) {
  mu_ = std::min(mu_, share_ * point.c.squaredNorm());
}

}  // namespace dyntape
