// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/function/robot_differences.h>

#include <cmath>
#include <limits>

#include <dyntape/dynamics/configuration.h>
#include <dyntape/interface/function/robot_plain.h>

namespace dyntape::detail {
namespace {

// The step that is really taken from x: x + h rounds.
double rounded_step(double x, double step) {
  const volatile double moved = x + step * std::max(1.0, std::abs(x));
  return moved - x;
}

}  // namespace

RobotDifferences::RobotDifferences(const dynamics::Model<double>& model, RobotFunction function, bool central,
                                   double step)
    : model_(model),
      data_(model),
      function_(is_forward(function) ? RobotFunction::kAba : RobotFunction::kRnea),
      central_(central),
      step_(step),
      scaled_by_(static_cast<std::size_t>(model.nv), -1) {
  const double eps = std::numeric_limits<double>::epsilon();
  if (step_ == 0) step_ = central ? std::cbrt(eps) : std::sqrt(eps);
  for (const auto& joint : model.joints) {
    const bool on_a_line =
        joint.type == dynamics::JointType::kRevolute || joint.type == dynamics::JointType::kPrismatic;
    if (on_a_line) scaled_by_[static_cast<std::size_t>(joint.idx_v)] = joint.idx_q;
  }
}

Eigen::VectorXd RobotDifferences::value(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                        const Eigen::VectorXd& w) {
  Eigen::VectorXd y(model_.nv);
  run<double>(model_, data_, function_, q, v, w, y.data());
  return y;
}

void RobotDifferences::operator()(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                  const Eigen::VectorXd& w, double* blocks) {
  const int n = model_.nv;
  const Eigen::VectorXd here = value(q, v, w);
  const auto write = [&](int block, int column, const Eigen::VectorXd& slope) {
    for (int i = 0; i < n; ++i) blocks[(block * n + i) * n + column] = slope[i];
  };
  // `at(h)` is the value with one entry moved by h.
  const auto difference = [&](double h, auto at) -> Eigen::VectorXd {
    if (central_) return (at(h) - at(-h)) / (2 * h);
    return (at(h) - here) / h;
  };
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(n);
  for (int k = 0; k < n; ++k) {
    const int entry = scaled_by_[static_cast<std::size_t>(k)];
    const double h_q = entry < 0 ? step_ : rounded_step(q[entry], step_);
    write(0, k, difference(h_q, [&](double h) {
            Eigen::VectorXd d = zero;
            d[k] = h;
            return value(dynamics::integrate<double>(model_, q, d), v, w);
          }));
    const auto moved = [k](Eigen::VectorXd x, double h) {
      x[k] += h;
      return x;
    };
    write(1, k, difference(rounded_step(v[k], step_), [&](double h) { return value(q, moved(v, h), w); }));
    write(2, k, difference(rounded_step(w[k], step_), [&](double h) { return value(q, v, moved(w, h)); }));
  }
}

}  // namespace dyntape::detail
