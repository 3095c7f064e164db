// SPDX-License-Identifier: BSD-3-Clause
//
// A recorded function with its derivatives on a device of OpenCL, a graphics card or the processor: thousands of states
// a call.  Use it for large batches on a card; on a processor CompiledFunction (compiled_function.h) is quicker.
//
//   const DeviceFunction f = DeviceFunction::make(recorded, {.order = Order::kFirst}, {.device = "opencl:0"});
//   f.check(f.run(Order::kFirst, {.count = n, .x = x, .y = y, .jacobian = J}), n);
//   const auto [values, jacobians, hessians] = f.evaluate(Order::kFirst, n, x);      // with checked sizes
//
// Arrays are those of CompiledFunction::run: state after state, derivatives as non-zeros in the order of their patterns.
// They are transposed, sent and fetched in parts that the device has room for.
//
// Double precision has the interpreter's bits, if the function calls none but square roots, sines, cosines and the exact
// ones (floor, fmod, ...); the other elementary functions are the device's (device/print_device.h).  Single precision:
// numbers are rounded to floats on their way to the device.
//
// The program of the device is kept in the cache, by device, driver and text.  A copy is cheap and shares it; any number
// of threads may use it, one at a time runs.
//
// Errors:
//
// - ArgumentError: a name that is no device, a device without double precision, an order above options.order,
// portable functions, sizes of evaluate().
// - ToolError: no loader of OpenCL, no device, no room on it, or its compiler fails.
// - GuardViolation, from check() and evaluate().
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <dyntape/autodiff/evaluate/numbers.h>
#include <dyntape/codegen/device/opencl.h>
#include <dyntape/codegen/options/options.h>
#include <dyntape/codegen/run/points.h>

namespace dyntape {

struct DeviceRunOptions {
  std::string device = "opencl:0";      // by number, as opencl_devices() lists them
  bool single = false;                  // float instead of double
  std::size_t piece_statements = 4000;  // device/print_device.h
  std::size_t most_states = 0;          // sent at a time; 0: as many as fit
  std::size_t most_steps = 0;           // of a loop (device_loop.h), likewise
};

class DeviceFunction {
 public:
  // Of options: order, functions, label, use_cache and cache_folder.
  static DeviceFunction make(const Function& function, const CodegenOptions& options = {},
                             const DeviceRunOptions& how = {});

  [[nodiscard]] Violation run(Order order, const Points& points) const;
  // Throws GuardViolation if `violation` is one; the message names the comparison and, of several points, the point.
  void check(const Violation& violation, std::size_t points = 1) const;

  // Of `count` states.  Blocks of parameters and weights: of every state, or one for all.
  struct Evaluation {
    std::vector<double> y, jacobian, hessian;
  };
  Evaluation evaluate(Order order, std::size_t count, Numbers x, Numbers p = {}, Numbers w = {}) const;

  const Function& function() const;
  Order order() const;
  const Pattern& jacobian_pattern() const;
  const Pattern& hessian_pattern() const;
  const codegen::OpenClDevice& device() const;
  const std::string& text() const;  // OpenCL C
  bool was_cached() const;          // whether the cache had the device's program

 private:
  struct State;
  explicit DeviceFunction(std::shared_ptr<State> state) : state_(std::move(state)) {}
  void require(Order order) const;

  std::shared_ptr<State> state_;
};

}  // namespace dyntape
