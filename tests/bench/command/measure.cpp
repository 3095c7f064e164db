// SPDX-License-Identifier: BSD-3-Clause
#include "measure.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/algorithms/mimic.h>
#include <dyntape/interface/robot/robot_rows.h>

namespace dyntape::tools {

std::vector<Eigen::VectorXd> random_states(const dynamics::Model<double>& model,
                                           const RobotFunction& function, int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Eigen::Index width = 0;
  for (const RobotBlock& block : inputs(model, function)) width += block.size();
  std::vector<Eigen::VectorXd> states;
  for (int i = 0; i < count; ++i) {
    Eigen::VectorXd q = Eigen::VectorXd::Zero(model.nq);
    for (const auto& joint : model.joints) {
      using dynamics::JointType;
      auto entries = q.segment(joint.idx_q, dynamics::nq(joint.type));
      switch (joint.type) {
        case JointType::kFreeFlyer:
        case JointType::kSpherical:
          for (double& entry : entries) entry = normal(random);
          entries.tail<4>().normalize();
          break;
        case JointType::kPlanar:
        case JointType::kContinuous: {
          for (double& entry : entries.head(entries.size() - 2)) entry = normal(random);
          const double angle = std::uniform_real_distribution<double>(-1.5, 1.5)(random);
          entries.tail<2>() << std::cos(angle), std::sin(angle);
          break;
        }
        default: {
          const double low = std::max(-1.5, joint.limits.lower), high = std::min(1.5, joint.limits.upper);
          entries[0] =
              std::uniform_real_distribution<double>(std::min(low, high), std::max(low, high))(random);
        }
      }
    }
    if (!function.mimics.empty()) {
      const dynamics::MimicModel<double> mimic(model, function.mimics);
      q = Eigen::VectorXd(q(mimic.q_owners));
    }
    Eigen::VectorXd state(width);
    state.head(q.size()) = q;
    for (Eigen::Index k = q.size(); k < width; ++k) state[k] = normal(random);
    states.push_back(state);
  }
  return states;
}

std::vector<double> reference(const dynamics::Model<double>& model, const RobotFunction& function,
                              const Eigen::VectorXd& state) {
  using Quad = dynamics::Float128;
  const dynamics::Model<Quad> exact = model.cast<Quad>();
  detail::RobotWorkspace<Quad> work(exact, function);
  const dynamics::VectorX<Quad> x = state.cast<Quad>();
  std::vector<Quad> y(work.n_out());
  work.evaluate(x.data(), y.data());
  std::vector<double> rounded;
  for (const Quad& value : y) rounded.push_back(static_cast<double>(value));
  return rounded;
}

double relative_error(const std::vector<double>& expected, const double* got,
                      const std::vector<RobotBlock>& blocks) {
  constexpr double kNothing = 0x1p-80;  // of all: what 113 bits leave of zero
  double worst = 0, of_all = 0;
  for (const double value : expected) of_all = std::max(of_all, std::abs(value));
  std::size_t first = 0;
  for (const RobotBlock& block : blocks) {
    const std::size_t end = first + static_cast<std::size_t>(block.size());
    double error = 0, scale = 0;
    for (std::size_t i = first; i < end; ++i) {
      const double e = std::abs(got[i] - expected[i]);
      error = e <= error ? error : e;  // a NaN stays
      scale = std::max(scale, std::abs(expected[i]));
    }
    if (scale < kNothing * of_all) scale = of_all;
    const double relative = scale > 0 ? error / scale : error;
    worst = relative <= worst ? worst : relative;
    first = end;
  }
  return worst;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double median_seconds(const std::function<void(std::size_t)>& call, int repeats) {
  using Clock = std::chrono::steady_clock;
  const auto timed = [&](std::size_t calls) {
    const auto start = Clock::now();
    for (std::size_t i = 0; i < calls; ++i) call(i);
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  std::size_t calls = 1;
  while (timed(calls) < 1e-3 && calls < 1u << 24) calls *= 2;  // warms up as well
  std::vector<double> seconds;
  for (int i = 0; i < repeats; ++i) seconds.push_back(timed(calls) / static_cast<double>(calls));
  return median(std::move(seconds));
}

std::vector<Cost> alternate(const std::vector<Contender>& contenders, int batches) {
  constexpr int kCalls = 200;
  constexpr double kLongest = 1e-3;  // of a batch, s: shorter than what a scheduler grants
  using Clock = std::chrono::steady_clock;
  const auto timed = [](const Contender& run, int first, int calls) {
    const auto start = Clock::now();
    run(first, calls);
    return std::chrono::duration<double>(Clock::now() - start).count() / calls;
  };
  std::vector<int> calls;
  for (const Contender& run : contenders) {
    timed(run, 0, 48);  // warms up
    calls.push_back(std::clamp(static_cast<int>(kLongest / timed(run, 0, 8)) / 8 * 8, 8, kCalls));
  }
  std::vector<std::vector<double>> seconds(contenders.size());
  for (int batch = 0; batch < batches; ++batch) {
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      seconds[i].push_back(timed(contenders[i], batch * calls[i], calls[i]));
    }
  }
  std::vector<Cost> costs;
  for (const auto& s : seconds) costs.push_back({median(s), *std::min_element(s.begin(), s.end())});
  return costs;
}

}  // namespace dyntape::tools
