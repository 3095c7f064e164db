// SPDX-License-Identifier: BSD-3-Clause
//
// A recorded function as Python holds it: its kernels, interpreted at first, by order of derivative.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/device_function.h>
#include <dyntape/codegen/run/workspace_pool.h>

#include "arrays.h"

namespace dyntape::python {

// What evaluates, with workspaces for any number of threads.
struct Kernels {
  explicit Kernels(CompiledFunction made, std::optional<DeviceFunction> on_device = {})
      : function(std::move(made)), device(std::move(on_device)) {}

  const CompiledFunction function;
  const std::optional<DeviceFunction> device;  // evaluates in its place
  dyntape::detail::WorkspacePool<CompiledFunction::Workspace> pool;
};

class RecordedFunction {
 public:
  RecordedFunction(Function function, Shape y_shape);

  const Function function;
  const Shape y_shape;  // of what the Python function returned

  std::size_t n_x() const { return function.n_x(); }
  std::size_t n_p() const { return function.n_p(); }
  std::size_t n_y() const { return function.n_y(); }

  // What serves up to this order: compiled if it is, else the interpreter, made at the first call.
  std::shared_ptr<Kernels> kernels(Order order) const;
  std::shared_ptr<Kernels> made_kernels(Order order) const;  // the same; null if they are not made
  // From now on; evaluations that run go on with what they have.
  void compile(const CodegenOptions& options);
  void compile_for(const DeviceRunOptions& how, CodegenOptions options);
  std::shared_ptr<Kernels> compiled() const;

  // Called in other recordings, made once: of variables and parameters.
  std::shared_ptr<const Callee> callee() const;

 private:
  mutable std::mutex mutex_;
  mutable std::shared_ptr<Kernels> interpreted_[3];
  std::shared_ptr<Kernels> compiled_;
  mutable std::shared_ptr<const Callee> callee_;
};

// The kernels of a function that Python has, called with its lock.  Ctrl-C ends the wait for a derivation.
std::shared_ptr<Kernels> kernels_of(const RecordedFunction& f, Order order);

// Results of a chunk, as the kernels write them.
struct ChunkResults {
  std::vector<double> y, jacobian, hessian;
};
using Write = std::function<void(std::size_t first, std::size_t count, const ChunkResults& results)>;

void evaluate_on_device(const RecordedFunction& f, const DeviceFunction& device, Order order,
                        const Rows& rows,
                        const Write& write);                // devices.cpp
void bind_devices(nb::module_& module);                     // devices.cpp
void bind_function_state(nb::class_<RecordedFunction>& f);  // function_state.cpp
void bind_casadi(nb::class_<RecordedFunction>& f);          // bridges/casadi.cpp

}  // namespace dyntape::python
