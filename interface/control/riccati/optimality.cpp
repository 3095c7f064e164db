// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/riccati/optimality.h>

#include <algorithm>
#include <cmath>

namespace dyntape {

namespace {
constexpr double kMostScale = 100;
}

void Optimality::look(const Eigen::VectorXd& gradient, const Eigen::VectorXd& lambda,
                      const BoundMultipliers& multipliers) {
  const Eigen::Index n = barrier_.n(), m = barrier_.m();
  stationarity_.setZero(n + m);
  lagrangian_ = gradient;
  kkt_.add_transposed(lambda, lagrangian_);
  stationarity_.head(n) = lagrangian_;
  stationarity_.tail(m) = -lambda;
  stationarity_ += multipliers.upper - multipliers.lower;
  double sum = 0;
  int bounds = 0;
  for (const Eigen::Index i : barrier_.still()) stationarity_[i] = 0;
  for (const Eigen::Index i : barrier_.bounded()) {
    if (barrier_.lower()[i] > -HUGE_VAL) sum += multipliers.lower[i], ++bounds;
    if (barrier_.upper()[i] < HUGE_VAL) sum += multipliers.upper[i], ++bounds;
  }
  const auto scale = [](double total, double count) {
    return std::max(kMostScale, count > 0 ? total / count : 0) / kMostScale;
  };
  dual_ = stationarity_.size() > 0 ? stationarity_.cwiseAbs().maxCoeff() : 0;
  dual_scale_ = scale(sum + lambda.cwiseAbs().sum(), double(bounds) + double(m));
  multiplier_scale_ = scale(sum, bounds);
}

OptimalityErrors Optimality::errors(const BarrierPoint& point, const BoundMultipliers& multipliers,
                                    double mu) const {
  double complementarity = 0;
  for (const Eigen::Index i : barrier_.bounded()) {
    const auto of = [&](double multiplier, double distance) {
      complementarity = std::max(complementarity, std::abs(multiplier * distance - mu));
    };
    if (barrier_.lower()[i] > -HUGE_VAL) of(multipliers.lower[i], point.w[i] - barrier_.lower()[i]);
    if (barrier_.upper()[i] < HUGE_VAL) of(multipliers.upper[i], barrier_.upper()[i] - point.w[i]);
  }
  const double all = std::max({dual_ / dual_scale_, point.largest, complementarity / multiplier_scale_});
  return {dual_, point.largest, complementarity, all};
}

}  // namespace dyntape
