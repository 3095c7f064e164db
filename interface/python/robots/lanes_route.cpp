// SPDX-License-Identifier: BSD-3-Clause
#include "lanes_route.h"

#include <Eigen/Core>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/graph/nonzero_outputs.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/io/stopwatch.h>
#include <dyntape/interface/robot/packs/packed_robot.h>
#include <dyntape/interface/robot/workspace_pool.h>

namespace dyntape::python {
namespace {

// Functions whose recording has the operations of the plain code (tests/python/test_lanes.py).
bool has_same_operations(const RobotFunction& function) {
  static const std::set<std::string> kNames = {"rnea",
                                               "aba",
                                               "crba",
                                               "minverse",
                                               "nonlinear-effects",
                                               "gravity",
                                               "energy",
                                               "energy-gradients",
                                               "id-derivatives",
                                               "fd-derivatives",
                                               "gravity-derivatives",
                                               "nonlinear-effects-derivatives",
                                               "frame-placement",
                                               "frame-velocity",
                                               "frame-acceleration",
                                               "frame-jacobian",
                                               "com",
                                               "com-jacobian",
                                               "centroidal-momentum",
                                               "centroidal-momentum-rate",
                                               "centroidal-matrix"};
  return function.mimics.empty() && kNames.contains(to_string(function));
}

class LanesRoute final : public RobotPath {
 public:
  LanesRoute(const dynamics::Model<double>& model, const RobotFunction& function)
      : model_(model), function_(function) {
    const auto packed = packs_.take([&] { return made(); });
    n_in = packed->n_in();
    n_out = packed->n_out();
    if (!has_same_operations(function)) phase_ = Phase::kPacks;
  }

  void evaluate(const double* states, std::size_t count, double* results) override {
    const Phase phase = phase_.load(std::memory_order_acquire);
    if (phase == Phase::kMachineCode) return by_machine_code(states, count, results);
    by_packs(states, count, results);
    if (phase == Phase::kNew) consider(states, count, results);
  }

 private:
  enum class Phase { kNew, kMachineCode, kPacks };

  static constexpr std::size_t kEnough = 16384;  // states that take about as long as recording
  static constexpr int kMostTrials = 4, kRuns = 4;
  static constexpr std::size_t kTimed = 256;  // states
  static constexpr std::size_t kTooMany = 4;  // every fourth state evaluated twice: machine code is no faster
  static constexpr double kLargest = 1e30;    // of an input; products of several do not overflow
  static constexpr std::size_t kBlock = 1024;  // results that are looked at together

  std::unique_ptr<PackedRobot> made() const { return std::make_unique<PackedRobot>(model_, function_); }

  void by_packs(const double* states, std::size_t count, double* results) {
    packs_.take([&] { return made(); })->evaluate(states, count, results);
  }

  // Counts states; after enough of them makes machine code, which serves if it is quicker and not many results are zero.
  // Other threads continue with packs.
  void consider(const double* states, std::size_t count, const double* results) {
    if (seen_.fetch_add(count, std::memory_order_relaxed) + count < kEnough) return;
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock || phase_.load() != Phase::kNew) return;
    if (!code_ && !make_machine_code()) return phase_.store(Phase::kPacks, std::memory_order_release);
    std::size_t with_zeros = 0;
    for (std::size_t i = 0; i < count; ++i) with_zeros += !are_plain(results + i * n_out, 1);
    if (kTooMany * with_zeros < count) {
      const bool is_better = is_machine_code_quicker(states, std::min(count, kTimed));
      phase_.store(is_better ? Phase::kMachineCode : Phase::kPacks, std::memory_order_release);
    } else if (++trials_ == kMostTrials) {
      phase_.store(Phase::kPacks, std::memory_order_release);
    } else {
      seen_ = 0;
    }
  }

  // By the least processor time of some alternating runs.
  bool is_machine_code_quicker(const double* states, std::size_t count) {
    std::vector<double> results(count * n_out);
    double by_code = HUGE_VAL, by_packed = HUGE_VAL;
    for (int run = 0; run < kRuns; ++run) {
      const double begin = thread_seconds();
      by_packs(states, count, results.data());
      const double middle = thread_seconds();
      by_machine_code(states, count, results.data());
      by_packed = std::min(by_packed, middle - begin);
      by_code = std::min(by_code, thread_seconds() - middle);
    }
    return by_code < by_packed;
  }

  // Returns false if there is none on this machine.
  bool make_machine_code() {
    try {
      const Function recorded = record_robot_function(model_, function_, RobotSource::kAnalytic);
      const NonzeroOutputs nonzero = nonzero_outputs(recorded);
      Eigen::ArrayXd always_zero(static_cast<Eigen::Index>(n_out));
      for (std::size_t i = 0; i < n_out; ++i) always_zero[Eigen::Index(i)] = nonzero.place[i] < 0 ? 1 : 0;
      const std::size_t states = std::max<std::size_t>(1, kBlock / std::max<std::size_t>(1, n_out));
      always_zero_ = always_zero.replicate(Eigen::Index(states), 1);
      CodegenOptions options;
      options.order = Order::kValue;
      options.route = Route::kMachineCode;
      options.lanes = Lanes::kNative;
      code_.emplace(CompiledFunction::make(recorded, options));
      return code_->route() == Route::kMachineCode;
    } catch (const Error&) {
      return false;
    }
  }

  void by_machine_code(const double* states, std::size_t count, double* results) {
    thread_local std::vector<std::uint32_t> status;
    status.assign(count, 0);
    Points points;
    points.count = count, points.x = states, points.y = results, points.status = status.data();
    {
      const auto workspace =
          workspaces_.take([&] { return std::make_unique<CompiledFunction::Workspace>(*code_); });
      static_cast<void>(code_->run(Order::kValue, points, *workspace));
    }
    const bool are_equal = are_small(states, count * n_in) && are_plain(results, count) &&
                           std::all_of(status.begin(), status.end(), [](auto word) { return word == 0; });
    if (!are_equal) evaluate_again(states, count, results, status);
  }

  // The states whose results machine code may not have to the last bit.
  void evaluate_again(const double* states, std::size_t count, double* results,
                      const std::vector<std::uint32_t>& status) {
    const auto is_equal = [&](std::size_t i) {
      return status[i] == 0 && are_small(states + i * n_in, n_in) && are_plain(results + i * n_out, 1);
    };
    std::size_t again = 0;
    for (std::size_t first = 0; first < count; ++first) {
      std::size_t end = first;
      while (end < count && !is_equal(end)) ++end;
      if (end > first) by_packs(states + first * n_in, end - first, results + first * n_out);
      again += end - first;
      first = end;  // which is equal
    }
    if (kTooMany * again >= count && ++poor_ > kMostPoor)
      phase_.store(Phase::kPacks, std::memory_order_release);
  }

  using Entries = Eigen::Map<const Eigen::ArrayXd>;
  static bool are_small(const double* x, std::size_t n) {
    return Entries(x, Eigen::Index(n)).abs().maxCoeff<Eigen::PropagateNaN>() <= kLargest;
  }
  // Whether results of some states are finite, and those that are not always zero are not zero.
  bool are_plain(const double* y, std::size_t states) const {
    const auto n = Eigen::Index(states * n_out), block = always_zero_.size();
    for (Eigen::Index i = 0; i < n; i += block) {
      const Entries some(y + i, std::min(block, n - i));
      const bool are_zero = !((some.abs() + always_zero_.head(some.size())).minCoeff() > 0);
      if (are_zero || (some * 0.0).sum() != 0) return false;  // the product of what is not finite is NaN
    }
    return true;
  }

  static constexpr int kMostPoor = 64;  // calls in which machine code was no faster

  const dynamics::Model<double>& model_;
  const RobotFunction function_;
  dyntape::detail::WorkspacePool<PackedRobot> packs_;
  std::atomic<Phase> phase_ = Phase::kNew;
  std::atomic<std::size_t> seen_ = 0;
  std::atomic<int> poor_ = 0;
  std::mutex mutex_;
  int trials_ = 0;
  std::optional<CompiledFunction> code_;  // not changed once phase_ is kMachineCode
  // (n_out of some states) 1 for results that are zero for all states, else 0.  In one block a pass takes 0.7 ns per result; by
  // columns of n_out it took 2.5 ns, longer than the results of crba.
  Eigen::ArrayXd always_zero_;
  dyntape::detail::WorkspacePool<CompiledFunction::Workspace> workspaces_;
};

}  // namespace

std::shared_ptr<RobotPath> make_lanes_route(const dynamics::Model<double>& model,
                                            const RobotFunction& function) {
  return std::make_shared<LanesRoute>(model, function);
}

}  // namespace dyntape::python
