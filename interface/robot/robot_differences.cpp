// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/robot_differences.h>

#include <cmath>
#include <limits>

#include <dyntape/dynamics/model/configuration.h>

namespace dyntape::detail {
namespace {

// The step that is really taken from x: x + h rounds.
double rounded_step(double x, double step) {
  const volatile double moved = x + step * std::max(1.0, std::abs(x));
  return moved - x;
}

}  // namespace

RobotDifferences::RobotDifferences(const dynamics::Model<double>& model, const RobotFunction& derivative,
                                   bool central, double step)
    : work_(model, value_of(derivative)),
      values_(outputs(model, value_of(derivative))),
      by_(derived_by(derivative)),
      central_(central),
      step_(step),
      scaled_by_(static_cast<std::size_t>(work_.sizes.nv), -1) {
  const double eps = std::numeric_limits<double>::epsilon();
  if (step_ == 0) step_ = central ? std::cbrt(eps) : std::sqrt(eps);
  for (const auto& joint : model.joints) {
    if (!dynamics::traits(joint.type).on_a_line) continue;
    const auto* mimic = work_.mimic();
    const auto idx_q = static_cast<std::size_t>(joint.idx_q), idx_v = static_cast<std::size_t>(joint.idx_v);
    const int q = mimic ? mimic->q_entries[idx_q].index : joint.idx_q;
    const int v = mimic ? mimic->v_entries[idx_v].index : joint.idx_v;
    scaled_by_[static_cast<std::size_t>(v)] = q;  // a follower's are its leader's
  }
}

Eigen::VectorXd RobotDifferences::value() {
  Eigen::VectorXd y(static_cast<Eigen::Index>(work_.n_out()));
  work_.run();
  work_.write(y.data());
  return y;
}

void RobotDifferences::operator()(const double* state, double* blocks) {
  const int n = work_.sizes.nv;
  work_.read(state);
  const Eigen::VectorXd here = value(), q = work_.state.q;
  // `place(h)` moves one entry of the state by h.
  const auto difference = [&](double h, auto place) -> Eigen::VectorXd {
    place(h);
    const Eigen::VectorXd ahead = value();
    if (!central_) return (ahead - here) / h;
    place(-h);
    return (ahead - value()) / (2 * h);
  };
  const auto slope = [&](int input, int k) {
    if (input == 0) {
      const int entry = scaled_by_[static_cast<std::size_t>(k)];
      const Eigen::VectorXd s = difference(entry < 0 ? step_ : rounded_step(q[entry], step_), [&](double h) {
        work_.state.q = work_.integrate(q, h * Eigen::VectorXd::Unit(n, k));
      });
      work_.state.q = q;
      return s;
    }
    double& x = (input == 1 ? work_.state.v : work_.state.w)[k];
    const double there = x;
    const Eigen::VectorXd s = difference(rounded_step(x, step_), [&](double h) { x = there + h; });
    x = there;
    return s;
  };

  for (std::size_t j = 0; j < by_.size(); ++j) {
    for (int k = 0; k < n; ++k) {
      const Eigen::VectorXd column = slope(by_[j], k);
      int first = 0;
      for (const RobotBlock& value : values_) {
        const int block = first * static_cast<int>(by_.size()) + static_cast<int>(j) * value.size();
        for (int i = 0; i < value.size(); ++i) blocks[(block + i) * n + k] = column[first + i];
        first += value.size();
      }
    }
  }
}

}  // namespace dyntape::detail
