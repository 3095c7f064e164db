// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluates a robot's function in packs, behind an interface without the number of lanes.  Internal.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include <dyntape/autodiff/scalars/pack_eigen.h>
#include <dyntape/autodiff/scalars/pack_lanes.h>
#include <dyntape/interface/robot/robot_rows.h>

namespace dyntape::detail {

struct PackedPath {
  virtual ~PackedPath() = default;
  // At most `lanes` states.
  virtual void evaluate(const double* states, int count, double* results) = 0;

  std::size_t n_in = 0, n_out = 0;
  int lanes = 0;
};

template <class Pack>
struct PathOf final : PackedPath {
  // Stores results in parts that stay in the cache, unless joints follow others.
  static constexpr std::size_t kPart = 128;

  PathOf(const dynamics::Model<double>& robot, const RobotFunction& function)
      : model(robot.cast<Pack>()), work(model, function), x(work.n_in()) {
    n_in = x.size();
    n_out = work.n_out();
    lanes = Pack::kLanes;
    y.resize(work.mimic() ? n_out : std::min(n_out, kPart));
  }

  void evaluate(const double* states, int count, double* results) override {
    gather_lanes(states, n_in, count, x.data(), n_in);
    work.read(x.data());
    work.run();
    const auto take = [&](const Pack* part, std::size_t n) {
      scatter_lanes(part, n, results, n_out, count);
      results += n;
    };
    if (!work.mimic()) return work.write(y, std::ref(take));
    work.write(y.data());
    take(y.data(), n_out);
  }

  const dynamics::Model<Pack> model;
  RobotWorkspace<Pack> work;
  std::vector<Pack> x, y;
};

// A path with the lanes of a register, at least four.
std::unique_ptr<PackedPath> best_packed_path(const dynamics::Model<double>& model,
                                             const RobotFunction& function);

}  // namespace dyntape::detail
