// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/riccati/barrier_parameter.h>

#include <algorithm>
#include <cmath>

namespace dyntape {

namespace {

constexpr std::size_t kMemory = 4;  // points that the error is compared with
constexpr int kMostVain = 15;       // adaptive steps without a new least error
constexpr double kProgress = 0.9999;
constexpr double kMostCentring = 100, kLeastCentring = 1e-6, kNearOne = 0.99;  // of mu over the mean product
constexpr int kSections = 8;

// Of a function of ln x with one minimum between the logarithms; the best of the points that were tried.
template <class F>
double golden_section(const F& f, double low, double high) {
  const double share = (3 - std::sqrt(5.0)) / 2;
  double a = std::log(low), b = std::log(high);
  double x = a + share * (b - a), y = b - share * (b - a);
  double at_a = f(low), at_b = f(high), at_x = f(std::exp(x)), at_y = f(std::exp(y));
  for (int i = 0; i < kSections; ++i) {
    if (at_x < at_y) {
      b = y, at_b = at_y, y = x, at_y = at_x, x = a + share * (b - a), at_x = f(std::exp(x));
    } else {
      a = x, at_a = at_x, x = y, at_x = at_y, y = b - share * (b - a), at_y = f(std::exp(y));
    }
  }
  const double least = std::min({at_a, at_b, at_x, at_y});
  return std::exp(least == at_a ? a : least == at_b ? b : least == at_x ? x : y);
}

}  // namespace

bool BarrierMode::update(double error, bool is_stalled) {
  if (!may_adapt_) return false;
  const bool is_better =
      errors_.size() < kMemory ||
      std::any_of(errors_.begin(), errors_.end(), [&](double before) { return error <= kProgress * before; });
  is_adaptive_ = is_better && !is_stalled;
  if (!is_adaptive_) return false;
  since_least_ = error < kProgress * least_ ? 0 : since_least_ + 1;
  least_ = std::min(least_, error);
  if (since_least_ > kMostVain) return may_adapt_ = is_adaptive_ = false;
  if (errors_.size() == kMemory) errors_.erase(errors_.begin());
  errors_.push_back(error);
  return true;
}

QualityFunction::QualityFunction(const Barrier& barrier, const Eigen::VectorXd& w,
                                 const BoundMultipliers& multipliers, const Eigen::VectorXd& affine,
                                 const Eigen::VectorXd& centring) {
  std::vector<double> numbers;
  const auto add = [&](double multiplier, double distance, double sign, Eigen::Index i) {
    const double a = sign * affine[i] / distance, c = sign * centring[i] / distance;
    // Parts of a distance and of a multiplier that a step takes.
    const double of_multiplier = 1 / (distance * multiplier) - c;
    numbers.insert(numbers.end(), {distance * multiplier, a, c, -a - 1, of_multiplier});
  };
  for (const Eigen::Index i : barrier.bounded()) {
    if (barrier.lower()[i] > -HUGE_VAL) add(multipliers.lower[i], w[i] - barrier.lower()[i], 1, i);
    if (barrier.upper()[i] < HUGE_VAL) add(multipliers.upper[i], barrier.upper()[i] - w[i], -1, i);
  }
  bounds_ =
      Eigen::Map<const Eigen::ArrayXXd>(numbers.data(), 5, Eigen::Index(numbers.size()) / 5).transpose();
  if (bounds_.rows() > 0) mean_ = bounds_.col(0).sum() / double(bounds_.rows());
}

double QualityFunction::value(double mu, double dual, double primal, double tau) const {
  const auto product = bounds_.col(0);
  const auto distance = bounds_.col(1) + mu * bounds_.col(2),
             multiplier = bounds_.col(3) + mu * bounds_.col(4);
  const auto step = [&](double shrinks) { return shrinks > tau ? tau / shrinks : 1.0; };
  const double primal_step = step(-distance.minCoeff()), dual_step = step(-multiplier.minCoeff());
  const double products =
      (product * (1 + primal_step * distance) * (1 + dual_step * multiplier)).square().sum();
  return (1 - dual_step) * (1 - dual_step) * dual + (1 - primal_step) * (1 - primal_step) * primal +
         products / double(bounds_.rows());
}

double QualityFunction::minimum(double dual, double primal, double tau, double least, double most) const {
  if (!(mean_ > 0)) return least;
  const auto of = [&](double mu) { return value(mu, dual, primal, tau); };
  const bool is_above = of(kNearOne * mean_) > of(mean_);
  const double low = is_above ? mean_ : std::max(kLeastCentring * mean_, least),
               high = is_above ? std::min(kMostCentring * mean_, most) : kNearOne * mean_;
  return std::clamp(high > low ? golden_section(of, low, high) : low, least, most);
}

}  // namespace dyntape
