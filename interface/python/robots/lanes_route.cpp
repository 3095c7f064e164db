// SPDX-License-Identifier: BSD-3-Clause
#include "lanes_route.h"

#include <Eigen/Core>
#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/run/workspace_pool.h>
#include <dyntape/interface/io/stopwatch.h>
#include <dyntape/interface/robot/packs/packed_robot.h>

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
    for (const auto& joint : model.joints) {
      const auto first = std::size_t(joint.idx_q);
      switch (joint.type) {
        case dynamics::JointType::kFreeFlyer:
          turns_.push_back({first + 3, 4});
          break;
        case dynamics::JointType::kSpherical:
          turns_.push_back({first, 4});
          break;
        case dynamics::JointType::kPlanar:
          turns_.push_back({first + 2, 2});
          break;
        case dynamics::JointType::kContinuous:
          turns_.push_back({first, 2});
          break;
        default:
          break;
      }
    }
  }

  void evaluate(const double* states, std::size_t count, double* results) override {
    const Phase phase = phase_.load(std::memory_order_acquire);
    if (phase == Phase::kMachineCode) return by_machine_code(states, count, results);
    by_packs(states, count, results);
    if (phase == Phase::kNew) consider(states, count);
  }

 private:
  enum class Phase { kNew, kMachineCode, kPacks };

  static constexpr std::size_t kEnough = 16384;  // states that take about as long as recording
  static constexpr int kRuns = 4;
  static constexpr std::size_t kTimed = 256;  // states
  static constexpr std::size_t kTooMany = 4;  // every fourth state evaluated twice: machine code is no faster
  static constexpr double kLargest = 1e30;    // of an input; products of several do not overflow

  std::unique_ptr<PackedRobot> made() const { return std::make_unique<PackedRobot>(model_, function_); }

  void by_packs(const double* states, std::size_t count, double* results) {
    packs_.take([&] { return made(); })->evaluate(states, count, results);
  }

  // Counts states; after enough of them makes machine code, which serves if it is quicker.  Other threads continue with packs.
  void consider(const double* states, std::size_t count) {
    if (seen_.fetch_add(count, std::memory_order_relaxed) + count < kEnough) return;
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock || phase_.load() != Phase::kNew) return;
    const bool is_better = make_machine_code() && is_machine_code_quicker(states, std::min(count, kTimed));
    phase_.store(is_better ? Phase::kMachineCode : Phase::kPacks, std::memory_order_release);
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
      const Graph& graph = recorded.graph;
      has_poles_ = false;
      for (std::size_t id = 0; id < graph.nodes().size(); ++id)
        has_poles_ = has_poles_ || has_pole(graph, NodeId(id));
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
    const bool are_equal = are_tame(states, count) && (!has_poles_ || are_finite(results, count * n_out)) &&
                           std::all_of(status.begin(), status.end(), [](auto word) { return word == 0; });
    if (!are_equal) evaluate_again(states, count, results, status);
  }

  // The states whose results machine code may not have to the last bit.
  void evaluate_again(const double* states, std::size_t count, double* results,
                      const std::vector<std::uint32_t>& status) {
    const auto is_equal = [&](std::size_t i) {
      return status[i] == 0 && are_tame(states + i * n_in, 1) && are_finite(results + i * n_out, n_out);
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

  // Inputs whose products do not overflow, and quaternions and pairs (cos, sin) that are no zeros: the plain code
  // divides by their norms even where a turn has no effect.
  bool are_tame(const double* x, std::size_t states) const {
    constexpr double kLeast = 1e-100;  // of a squared norm
    bool are_turns = true;
    for (const Turn& turn : turns_) {
      for (std::size_t i = 0; i < states; ++i) {
        const double* const of = x + i * n_in + turn.first;
        double square = of[0] * of[0] + of[1] * of[1];
        if (turn.entries == 4) square += of[2] * of[2] + of[3] * of[3];
        are_turns &= square > kLeast;
      }
    }
    return are_turns && are_at_most(kLargest, x, states * n_in);
  }
  // Whether all magnitudes are at most `most`, and none is NaN: by their bits, two at once, which takes 0.17 ns per
  // number.  A larger one turns the sign of the difference.
  static bool are_at_most(double most, const double* y, std::size_t n) {
    using Word = std::uint64_t;
    typedef Word Words __attribute__((vector_size(2 * sizeof(Word))));
    constexpr Word kNoSign = ~Word(0) >> 1;
    const Word limit = std::bit_cast<Word>(most);
    Words first{}, second{};
    std::size_t i = 0;
    for (; i + 4 <= n; i += 4) {
      Words a, b;
      std::memcpy(&a, y + i, sizeof a);
      std::memcpy(&b, y + i + 2, sizeof b);
      first |= limit - (a & kNoSign), second |= limit - (b & kNoSign);
    }
    first |= second;
    Word all = first[0] | first[1];
    for (; i < n; ++i) all |= limit - (std::bit_cast<Word>(y[i]) & kNoSign);
    return !(all >> 63);
  }
  static bool are_finite(const double* y, std::size_t n) {
    return are_at_most(std::numeric_limits<double>::max(), y, n);
  }

  static constexpr int kMostPoor = 64;  // calls in which machine code was no faster

  const dynamics::Model<double>& model_;
  const RobotFunction function_;
  dyntape::detail::WorkspacePool<PackedRobot> packs_;
  std::atomic<Phase> phase_ = Phase::kNew;
  std::atomic<std::size_t> seen_ = 0;
  std::atomic<int> poor_ = 0;
  std::mutex mutex_;
  std::optional<CompiledFunction> code_;  // not changed once phase_ is kMachineCode
  struct Turn {
    std::size_t first, entries;  // of a state
  };
  std::vector<Turn> turns_;
  bool has_poles_ = true;  // or results are finite wherever inputs are small
  dyntape::detail::WorkspacePool<CompiledFunction::Workspace> workspaces_;
};

}  // namespace

std::shared_ptr<RobotPath> make_lanes_route(const dynamics::Model<double>& model,
                                            const RobotFunction& function) {
  return std::make_shared<LanesRoute>(model, function);
}

}  // namespace dyntape::python
