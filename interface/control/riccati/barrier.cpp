// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/riccati/barrier.h>

#include <algorithm>
#include <cmath>

#include <dyntape/interface/control/nlp/bound_widening.h>

namespace dyntape {

namespace {

double inside(double value, double lower, double upper, double push) {
  const double from_lower = push * std::max(1.0, std::abs(lower)),
               from_upper = push * std::max(1.0, std::abs(upper));
  const double room = upper - lower;
  if (lower > -HUGE_VAL) value = std::max(value, lower + std::min(from_lower, push * room));
  if (upper < HUGE_VAL) value = std::min(value, upper - std::min(from_upper, push * room));
  return value;
}

}  // namespace

Barrier::Barrier(Nlp& nlp, const StagewiseKkt& kkt)
    : nlp_(nlp), kkt_(kkt), n_(Eigen::Index(nlp.shape().n())), m_(Eigen::Index(nlp.shape().m())) {
  for (Eigen::Index i = 0; i < n_ + m_; ++i) {
    if (!moves(i)) still_.push_back(i);
  }
}

void Barrier::set_bounds(double relaxation) {
  const NlpShape& shape = nlp_.shape();
  lower_.setConstant(n_ + m_, -HUGE_VAL), upper_.setConstant(n_ + m_, HUGE_VAL);
  const auto set = [&](Eigen::Index at, double lower, double upper) {
    if (lower > -HUGE_VAL) lower_[at] = lower - widening(relaxation, lower);
    if (upper < HUGE_VAL) upper_[at] = upper + widening(relaxation, upper);
  };
  for (std::size_t i = 0; i < shape.n(); ++i) {
    if (!kkt_.is_fixed(i)) set(Eigen::Index(i), shape.x_lower[i], shape.x_upper[i]);
  }
  for (std::size_t j = 0; j < shape.m(); ++j) {
    if (kkt_.kind(j) == RowKind::kInequality) set(n_ + Eigen::Index(j), shape.g_lower[j], shape.g_upper[j]);
  }
  bounded_.clear();
  for (Eigen::Index i = 0; i < n_ + m_; ++i) {
    if (lower_[i] > -HUGE_VAL || upper_[i] < HUGE_VAL) bounded_.push_back(i);
  }
}

bool Barrier::begin(const std::vector<double>& x, double push, BarrierPoint& point) {
  point.w.setZero(n_ + m_), point.c.setZero(m_);
  for (Eigen::Index i = 0; i < n_; ++i) {
    const auto at = std::size_t(i);
    point.w[i] = kkt_.is_fixed(at) ? nlp_.shape().x_lower[at] : inside(x[at], lower_[i], upper_[i], push);
  }
  if (!nlp_.constraints(point.w.data(), point.c.data())) return false;
  for (Eigen::Index j = 0; j < m_; ++j) {
    if (kkt_.kind(std::size_t(j)) == RowKind::kInequality)
      point.w[n_ + j] = inside(point.c[j], lower_[n_ + j], upper_[n_ + j], push);
  }
  return evaluate(point);
}

bool Barrier::evaluate(BarrierPoint& point) {
  point.c.resize(m_);
  if (!nlp_.constraints(point.w.data(), point.c.data()) || !nlp_.objective(point.w.data(), point.f))
    return false;
  point.sum = point.largest = 0;
  for (Eigen::Index j = 0; j < m_; ++j) {
    switch (kkt_.kind(std::size_t(j))) {
      case RowKind::kEquality:
        point.c[j] -= nlp_.shape().g_lower[std::size_t(j)];
        break;
      case RowKind::kInequality:
        point.c[j] -= point.w[n_ + j];
        break;
      case RowKind::kFree:
        point.c[j] = 0;
    }
    point.sum += std::abs(point.c[j]);
    point.largest = std::max(point.largest, std::abs(point.c[j]));
  }
  return std::isfinite(point.f) && std::isfinite(point.sum);
}

double Barrier::value(const BarrierPoint& point, double mu) const {
  double sum = 0;
  for (const Eigen::Index i : bounded_) {
    if (lower_[i] > -HUGE_VAL) sum += std::log(point.w[i] - lower_[i]);
    if (upper_[i] < HUGE_VAL) sum += std::log(upper_[i] - point.w[i]);
  }
  return point.f - mu * sum;
}

void Barrier::slope(const Eigen::VectorXd& w, double mu, Eigen::VectorXd& slope) const {
  slope.setZero(n_ + m_);
  for (const Eigen::Index i : bounded_) {
    if (lower_[i] > -HUGE_VAL) slope[i] -= mu / (w[i] - lower_[i]);
    if (upper_[i] < HUGE_VAL) slope[i] += mu / (upper_[i] - w[i]);
  }
}

double Barrier::longest(const Eigen::VectorXd& w, const Eigen::VectorXd& step, double tau) const {
  double length = 1;
  for (const Eigen::Index i : bounded_) {
    if (step[i] < 0 && lower_[i] > -HUGE_VAL) length = std::min(length, tau * (lower_[i] - w[i]) / step[i]);
    if (step[i] > 0 && upper_[i] < HUGE_VAL) length = std::min(length, tau * (upper_[i] - w[i]) / step[i]);
  }
  return length;
}

void BoundMultipliers::begin(const Barrier& barrier, const Eigen::VectorXd& w, double mu, double most) {
  lower.setZero(w.size()), upper.setZero(w.size());
  for (const Eigen::Index i : barrier.bounded()) {
    if (barrier.lower()[i] > -HUGE_VAL) lower[i] = std::min(most, mu / (w[i] - barrier.lower()[i]));
    if (barrier.upper()[i] < HUGE_VAL) upper[i] = std::min(most, mu / (barrier.upper()[i] - w[i]));
  }
}

void BoundMultipliers::set_ones(const Barrier& barrier) {
  lower = (barrier.lower().array() > -HUGE_VAL).cast<double>();
  upper = (barrier.upper().array() < HUGE_VAL).cast<double>();
}

void BoundMultipliers::reset_above(double most, const Barrier& barrier) {
  if ((lower.array() > most).any() || (upper.array() > most).any()) set_ones(barrier);
}

double BoundMultipliers::take_over(const Barrier& barrier, const Eigen::VectorXd& w,
                                   const NlpSolution& earlier, double least) {
  begin(barrier, w, 1, 0);
  const auto take = [&](double& bound_multiplier, double value, double distance) {
    bound_multiplier = std::max(value, least / std::max(1.0, distance));
  };
  const auto n = std::size_t(barrier.n());
  for (const Eigen::Index i : barrier.bounded()) {
    const auto at = std::size_t(i);
    if (barrier.lower()[i] > -HUGE_VAL)
      take(lower[i], at < n ? earlier.lower_multiplier[at] : -earlier.lambda[at - n],
           w[i] - barrier.lower()[i]);
    if (barrier.upper()[i] < HUGE_VAL)
      take(upper[i], at < n ? earlier.upper_multiplier[at] : earlier.lambda[at - n],
           barrier.upper()[i] - w[i]);
  }
  return mean_product(barrier, w);
}

void BoundMultipliers::curve(const Barrier& barrier, const Eigen::VectorXd& w, KktDiagonal& diagonal) const {
  const Eigen::Index n = barrier.n();
  diagonal.sigma_x.setZero(n), diagonal.sigma_s.setZero(barrier.m());
  for (const Eigen::Index i : barrier.bounded()) {
    double sigma = 0;
    if (barrier.lower()[i] > -HUGE_VAL) sigma += lower[i] / (w[i] - barrier.lower()[i]);
    if (barrier.upper()[i] < HUGE_VAL) sigma += upper[i] / (barrier.upper()[i] - w[i]);
    (i < n ? diagonal.sigma_x[i] : diagonal.sigma_s[i - n]) = sigma;
  }
}

void BoundMultipliers::step(const Barrier& barrier, const Eigen::VectorXd& w, const Eigen::VectorXd& w_step,
                            double mu) {
  lower_step.setZero(w.size()), upper_step.setZero(w.size());
  for (const Eigen::Index i : barrier.bounded()) {
    if (barrier.lower()[i] > -HUGE_VAL)
      lower_step[i] = (mu - lower[i] * w_step[i]) / (w[i] - barrier.lower()[i]) - lower[i];
    if (barrier.upper()[i] < HUGE_VAL)
      upper_step[i] = (mu + upper[i] * w_step[i]) / (barrier.upper()[i] - w[i]) - upper[i];
  }
}

double BoundMultipliers::mean_product(const Barrier& barrier, const Eigen::VectorXd& w) const {
  double sum = 0;
  int bounds = 0;
  for (const Eigen::Index i : barrier.bounded()) {
    if (barrier.lower()[i] > -HUGE_VAL) sum += lower[i] * (w[i] - barrier.lower()[i]), ++bounds;
    if (barrier.upper()[i] < HUGE_VAL) sum += upper[i] * (barrier.upper()[i] - w[i]), ++bounds;
  }
  return bounds > 0 ? sum / bounds : 0;
}

double BoundMultipliers::longest(double tau) const {
  double length = 1;
  for (Eigen::Index i = 0; i < lower.size(); ++i) {
    if (lower_step[i] < 0) length = std::min(length, -tau * lower[i] / lower_step[i]);
    if (upper_step[i] < 0) length = std::min(length, -tau * upper[i] / upper_step[i]);
  }
  return length;
}

void BoundMultipliers::move(const Barrier& barrier, const Eigen::VectorXd& w, double length, double mu) {
  constexpr double kKappaSigma = 1e10;
  lower += length * lower_step, upper += length * upper_step;
  for (const Eigen::Index i : barrier.bounded()) {
    const auto keep = [&](double& bound_multiplier, double distance) {
      bound_multiplier =
          std::clamp(bound_multiplier, mu / distance / kKappaSigma, mu / distance * kKappaSigma);
    };
    if (barrier.lower()[i] > -HUGE_VAL) keep(lower[i], w[i] - barrier.lower()[i]);
    if (barrier.upper()[i] < HUGE_VAL) keep(upper[i], barrier.upper()[i] - w[i]);
  }
}

}  // namespace dyntape
