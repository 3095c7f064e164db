// SPDX-License-Identifier: BSD-3-Clause
//
// The functions of a stage on a mesh, made ready: one at every point and one at the end, evaluated together.
//
//   StageFunctions f(stage.node, stage.terminal, {.order = Order::kSecond, .lanes = Lanes::kNative}, 81);
//   f.run(Order::kValue, {.x = z, .p = p, .y = y}, z_end, p_end);      // y (81 x n_y of a point, then n_y of the end)
//
// p (81 x n_p of a point): time and parameters, as they are recorded (record_stage.h).
//
// Nothing is allocated after construction; one call at a time.
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/compiled_function.h>

namespace dyntape {

// What it took to make functions ready, summed over them.
struct BuildReport {
  Timings seconds;
  int compiled = 0, from_cache = 0, interpreted = 0;  // functions
  std::vector<std::string> sources = {};              // C files, where there are any
};

void add_to(BuildReport& report, const CompiledFunction& function);

class StageFunctions {
 public:
  // options.order is the highest that will be asked for; threads: as of a workspace, for the points.
  StageFunctions(const Function& node, const Function& end, const CodegenOptions& options, std::size_t points,
                 unsigned threads = 1);
  // The same functions on another mesh.
  StageFunctions(const StageFunctions& ready, std::size_t points, unsigned threads = 1);

  const CompiledFunction& node() const { return node_; }
  const CompiledFunction& end() const { return end_; }

  // Entries of all points and the end.
  std::size_t values() const { return points_ * node_.n_y() + end_.n_y(); }
  std::size_t jacobians() const;
  std::size_t hessians() const;  // 0 where they will not be asked for

  // False where a recorded branch is left; whether results are finite is for the caller to see.
  bool run(Order order, Points points, const double* z_end, const double* p_end);

  void add_to(BuildReport& report) const;

 private:
  CompiledFunction node_, end_;
  CompiledFunction::Workspace of_nodes_, of_end_;
  std::size_t points_;
};

}  // namespace dyntape
