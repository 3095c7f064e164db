// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/player/frames.h>

#include <algorithm>
#include <cmath>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/configuration.h>

namespace dyntape {

namespace {

constexpr double kFramesPerSecond = 60;
constexpr int kMostFrames = 6000;

std::vector<double> frame_times(double first, double last) {
  const double wanted = std::ceil((last - first) * kFramesPerSecond - 1e-9);
  const int steps = int(std::clamp(wanted, 0.0, kMostFrames - 1.0));
  std::vector<double> times(std::size_t(steps) + 1, first);
  for (int k = 1; k <= steps; ++k) times[std::size_t(k)] = first + (last - first) * k / steps;
  return times;
}

// Between which samples a time lies, and how far: 0 at `sample`, 1 at the next.
struct Between {
  Eigen::Index sample;
  double part;
};

Between between(const Eigen::VectorXd& t, double time) {
  const auto next = std::upper_bound(t.begin(), t.end(), time);
  const Eigen::Index sample = std::max<Eigen::Index>(0, next - t.begin() - 1);
  if (sample + 1 >= t.size()) return {t.size() - 1, 0};
  return {sample, (time - t[sample]) / (t[sample + 1] - t[sample])};
}

Eigen::VectorXd configuration(const PlayerInput& input, const Between& at) {
  const Eigen::VectorXd q = input.q.col(at.sample);
  if (at.part == 0) return q;
  const Eigen::VectorXd step = dynamics::difference<double>(input.model, q, input.q.col(at.sample + 1));
  return dynamics::integrate<double>(input.model, q, Eigen::VectorXd(step * at.part));
}

double value_at(const Eigen::VectorXd& samples, const Between& at) {
  if (at.part == 0) return samples[at.sample];
  return (1 - at.part) * samples[at.sample] + at.part * samples[at.sample + 1];
}

}  // namespace

PlayerFrames player_frames(const PlayerInput& input) {
  PlayerFrames frames;
  frames.t = frame_times(input.t[0], input.t[input.t.size() - 1]);
  frames.traces.resize(input.traces.size());
  frames.values.resize(input.values.size());
  dynamics::Data<double> data(input.model);
  for (double time : frames.t) {
    const Between at = between(input.t, time);
    dynamics::forward_kinematics<double>(input.model, data, configuration(input, at));
    frames.X_WB.push_back(data.X_WB);
    if (!input.contacts.empty()) frames.contacts.push_back(input.contacts[std::size_t(at.sample)]);
    for (std::size_t i = 0; i < input.traces.size(); ++i) {
      const int frame = input.model.frame_index(input.traces[i]);
      frames.traces[i].push_back(frame_placement(input.model, data, frame).p);
    }
    for (std::size_t i = 0; i < input.values.size(); ++i)
      frames.values[i].push_back(value_at(input.values[i].values, at));
  }
  return frames;
}

}  // namespace dyntape
