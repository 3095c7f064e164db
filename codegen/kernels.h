// SPDX-License-Identifier: BSD-3-Clause
//
// One tier of a CompiledFunction: a function's evaluation, compiled or interpreted, that does not change.  Internal.
//
//   const Kernels kernels(produce(recorded, options), options);
//   Kernels::Room room(kernels);                                  // of one evaluation at a time
//   Violation violation = kernels.run(Order::kFirst, points, room);
#pragma once

#include <string>
#include <vector>

#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/codegen/machine/called_functions.h>
#include <dyntape/codegen/pipeline_stages.h>
#include <dyntape/codegen/run/lanes.h>

namespace dyntape::codegen {

class Kernels {
 public:
  class Room {
   public:
    explicit Room(const Kernels& kernels);

   private:
    friend class Kernels;
    std::vector<double> work_;
    AlignedRoom lanes_;
    std::vector<std::uint32_t> status_;
    std::vector<Interpreter::Workspace> interpreters_;
  };

  Kernels(Product product, const CodegenOptions& options);

  // `order` must exist.  Evaluates lane_width() points that lie side by side, or one.
  Violation run(Order order, const Points& points, Room& room) const {
    return runs_one(points) ? run_one(order, points, room.work_.data()) : run_many(order, points, room);
  }
  // One point with memory on the stack.  Returns false if there is no code, or it needs more memory.
  bool run_on_stack(Order order, const Points& point, Violation& violation) const {
    if (code_.empty() || code_[static_cast<std::size_t>(order)].work > kStackDoubles) return false;
    double work[kStackDoubles];
    violation = run_one(order, point, work);
    return true;
  }
  // The kernel that does so; null also for machine code, which may call code that throws.
  dyntape_run kernel_on_stack(Order order) const {
    if (code_.empty() || product.machine) return nullptr;
    const dyntape_kernel& kernel = code_[static_cast<std::size_t>(order)];
    return kernel.work > kStackDoubles ? nullptr : kernel.run;
  }
  static constexpr std::size_t kStackDoubles = 256;  // of memory on the stack

  Tier tier() const;  // kFinal if made by a compiler
  std::size_t lane_width() const { return wide_.empty() ? 1 : wide_.front().lane_width; }
  // Doubles of one point in each array.
  Strides sizes(Order order) const;

  Product product;
  const std::string name;
  const Order order;  // the highest order
  Pattern jacobian, hessian;
  std::vector<std::size_t> operations;  // by order

 private:
  void take_kernels(const dyntape_descriptor& descriptor, std::size_t widest);
  void take_interpreters(std::vector<Derivatives> derivatives, Functions functions);
  // A single point, for which nothing is laid out.
  Violation run_one(Order order, const Points& point, double* work) const {
    std::uint32_t own = 0;
    std::uint32_t* const status = point.status ? point.status : &own;
    code_[static_cast<std::size_t>(order)].run(point.x, point.p, point.w, point.y, point.jacobian,
                                               point.hessian, work, 1, nullptr, status);
    if (product.machine) rethrow_thrown();
    return {*status, 0};
  }
  bool runs_one(const Points& points) const { return points.count == 1 && !code_.empty(); }
  Violation run_many(Order order, const Points& points, Room& room) const;
  void run_code(Order order, const Points& points, const Strides& sizes, Room& room) const;
  void run_interpreted(Order order, const Points& points, const Strides& sizes, Room& room) const;

  std::vector<Interpreter> interpreters_;  // by order; empty if there is code
  std::vector<dyntape_kernel> code_;       // by order; empty if interpreted
  std::vector<dyntape_kernel> wide_;       // the same for several lanes; empty if there are none
};

}  // namespace dyntape::codegen
