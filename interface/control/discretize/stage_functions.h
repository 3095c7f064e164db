// SPDX-License-Identifier: BSD-3-Clause
//
// The functions of a stage on a mesh, made ready: one at every point and those of single instants, evaluated together.
//
//   StageFunctions f(node, {via, end}, {.order = Order::kSecond, .lanes = Lanes::kNative}, 81);
//   const StageFunctions::At at[] = {{z_via, p_via}, {z_end, p_end}};
//   f.run(Order::kValue, {.x = z, .p = p, .y = y}, at);                 // y: 81 x n_y of a point, then those of the instants
//
// p (81 x n_p of a point): time and parameters, as they are recorded (record_stage.h).
//
// Nothing is allocated after construction; one call at a time.
#pragma once

#include <span>
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
  StageFunctions(const Function& node, const std::vector<Function>& instants, const CodegenOptions& options,
                 std::size_t points, unsigned threads = 1);
  // The same functions on another mesh.
  StageFunctions(const StageFunctions& ready, std::size_t points, unsigned threads = 1);

  const CompiledFunction& node() const { return node_; }
  // Of a single instant, and where its entries begin behind those of the points.
  struct Instant {
    CompiledFunction function;
    std::size_t y, jacobian, hessian;
  };
  const std::vector<Instant>& instants() const { return instants_; }

  // Entries of all points and instants.
  std::size_t values() const { return values_; }
  std::size_t jacobians() const { return jacobians_; }  // 0 where they will not be asked for
  std::size_t hessians() const { return hessians_; }    // likewise

  struct At {
    const double *z, *p;
  };
  // False where a recorded branch is left; whether results are finite is for the caller to see.
  bool run(Order order, Points points, std::span<const At> instants);

  void add_to(BuildReport& report) const;

 private:
  void place();

  CompiledFunction node_;
  CompiledFunction::Workspace of_nodes_;
  std::vector<Instant> instants_;
  std::vector<CompiledFunction::Workspace> of_instants_;
  std::size_t points_, values_ = 0, jacobians_ = 0, hessians_ = 0;
};

}  // namespace dyntape
