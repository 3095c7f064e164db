// SPDX-License-Identifier: BSD-3-Clause
#include "policy.h"

#include <dyntape/autodiff/error.h>

namespace dyntape::python {
namespace {

auto workspace_of(const Kernels& kernels) {
  return const_cast<Kernels&>(kernels).pool.take(
      [&] { return std::make_unique<CompiledFunction::Workspace>(kernels.function); });
}

}  // namespace

Policy::Policy(std::shared_ptr<const RecordedFunction> f, nb::handle parameters, const std::string& call,
               int nx, int n_u)
    : f_(std::move(f)) {
  const std::string name = call + ": policy \"" + f_->function.name + "\"";
  if (f_->n_x() != static_cast<std::size_t>(nx) || f_->n_y() != static_cast<std::size_t>(n_u))
    throw ArgumentError(name + " takes " + std::to_string(f_->n_x()) + " values and returns " +
                        std::to_string(f_->n_y()) + "; expected a function of the state (" +
                        std::to_string(nx) + ",) that returns the commands (" + std::to_string(n_u) + ",)");
  if (n_p() == 0 && !parameters.is_none())
    throw ArgumentError(name + " was recorded without parameters; expected no parameters");
  if (n_p() > 0 && parameters.is_none())
    throw ArgumentError(name + " has " + std::to_string(n_p()) + " parameters; expected parameters (" +
                        std::to_string(n_p()) + ",) or (worlds, " + std::to_string(n_p()) + ")");
  values_ = kernels_of(*f_, Order::kValue);
  if (n_p() == 0) return;
  parameters_ = numbers(parameters, call + ": parameters");
  const auto columns = static_cast<std::ptrdiff_t>(n_p());
  const Shape& shape = parameters_.shape;
  if ((shape.size() != 1 && shape.size() != 2) || shape.back() != columns)
    throw ArgumentError(call + ": expected parameters of shape (" + std::to_string(n_p()) +
                        ",) or (worlds, " + std::to_string(n_p()) + "), got " + shape_text(shape));
  if (shape.size() == 2) worlds_ = static_cast<std::size_t>(shape[0]);
}

void Policy::prepare_derivatives() {
  CodegenOptions options;
  options.order = Order::kFirst;
  options.route = Route::kTiered;
  slopes_ = std::make_shared<Kernels>(CompiledFunction::make(all_as_variables(f_->function), options));
}

void Policy::commands(const WorldRows& at, double* u) const {
  Points points;
  points.count = at.count, points.x = at.x, points.y = u;
  points.p = parameters(at.first);
  const Strides strides{
      .x = at.stride, .p = worlds_ ? n_p() : 0, .w = 0, .y = f_->n_y(), .jacobian = 0, .hessian = 0};
  evaluate_law(values_->function, *workspace_of(*values_), Order::kValue, points, strides, f_->n_x());
}

void Policy::derivatives(const dynamics::Model<double>& model, const double* x, std::size_t world,
                         LawSlopes& slopes) const {
  law_slopes(slopes_->function, *workspace_of(*slopes_), model, {x, parameters(world), f_->n_x(), n_p()},
             slopes);
}

}  // namespace dyntape::python
