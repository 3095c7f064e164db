// SPDX-License-Identifier: BSD-3-Clause
//
// Iterates a recorded function on a device of OpenCL, x <- f(x, p): one kernel takes many steps of thousands of states.
// Use it where one call a step (device_function.h) would mostly send states to and fro.
//
//   const Function step = record("step", 2, 1, [](const VectorXad& x, const VectorXad& p) { ... });   // 2 outputs
//   const DeviceLoop loop = DeviceLoop::make(step, {}, {}, {.device = "opencl:0"});
//   loop.run({.count = 1000, .steps = 500, .every = 100, .x = x, .p = p, .states = y});          // 5 states of each
//
// Parameters are, in this order, `shared` ones of each step, the same for all states; those of each step and state; and
// `constants` of each state, the same in all steps.  The first outputs are the next state; others only have to be
// finite.  Every `every`-th state is returned.  Numbers and bits are those of DeviceFunction.  If a step violates a
// guard, or its arguments or its results are not finite, the state is NaN from there on; others continue.
//
// A copy is cheap and shares the program; any number of threads may use it, one at a time runs.
//
// Errors: those of DeviceFunction, without GuardViolation.  ArgumentError: a function with fewer outputs than variables.
#pragma once

#include <memory>
#include <stop_token>

#include <dyntape/codegen/device/print_device.h>
#include <dyntape/codegen/device_function.h>

namespace dyntape {

class DeviceLoop {
 public:
  static DeviceLoop make(const Function& step, const codegen::LoopParameters& parameters,
                         const CodegenOptions& options = {}, const DeviceRunOptions& how = {});

  // Strides are in doubles, from state to state; 0: one row for all.
  struct Run {
    std::size_t count = 0, steps = 0, every = 1;
    const double* x = nullptr;       // (n_x) of each state
    const double* shared = nullptr;  // (steps x shared)
    const double* p = nullptr;       // (steps x (n_p - shared - constants)) of each state
    const double* constants = nullptr;
    double* states = nullptr;  // (steps / every x n_x) of each state, dense
    std::size_t stride_x = 0, stride_p = 0, stride_constants = 0;
  };
  // Ends early, between two launches, if it is stopped.
  void run(const Run& all, const std::stop_token& stop = {}) const;

  const codegen::OpenClDevice& device() const;
  const std::string& text() const;  // OpenCL C

 private:
  struct State;
  explicit DeviceLoop(std::shared_ptr<State> state) : state_(std::move(state)) {}

  std::shared_ptr<State> state_;
};

}  // namespace dyntape
