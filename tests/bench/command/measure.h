// SPDX-License-Identifier: BSD-3-Clause
//
// What `bench` and `study` have in common: random states, errors against 113 bits, times.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape::tools {

// Random states of a function, the same for the same seed: joints within +-1.5 and their limits, orientations
// uniform, everything behind q standard normal.
std::vector<Eigen::VectorXd> random_states(const dynamics::Model<double>& model,
                                           const RobotFunction& function, int count, std::uint64_t seed);

// The function in 113 bits, by the analytic code, rounded to double.
std::vector<double> reference(const dynamics::Model<double>& model, const RobotFunction& function,
                              const Eigen::VectorXd& state);

// Largest difference over largest entry, block by block, the worst block.
double relative_error(const std::vector<double>& expected, const double* got,
                      const std::vector<RobotBlock>& blocks);

// Median seconds of one call, over at least `repeats` timings, each of as many calls as take a millisecond.
// `call(i)` evaluates state i of a cycle.
double median_seconds(const std::function<void(std::size_t i)>& call, int repeats = 31);

// Seconds of one evaluation.
struct Cost {
  double median = 0;  // over the batches
  double best = 0;    // of the quickest batch: what other programs on the machine disturb least
};

// `run(first, calls)` evaluates that many states from `first` on, cyclically; both are multiples of eight.
using Contender = std::function<void(int first, int calls)>;

// Runs the contenders in turn, a batch each, so that noise hits all alike.
std::vector<Cost> alternate(const std::vector<Contender>& contenders, int batches = 60);

double median(std::vector<double> values);

}  // namespace dyntape::tools
