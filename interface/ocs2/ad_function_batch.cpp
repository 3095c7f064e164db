// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluation into the caller's memory, and the derivatives that are made on request.
#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/run/stack_doubles.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/ocs2/ad_function.h>
#include <dyntape/interface/ocs2/ad_function_model.h>

namespace dyntape {
namespace {

// The function of its parameters: variables and parameters change places.
Function of_parameters(const Function& f) {
  Function swapped;
  swapped.name = f.name + "_parameters";
  swapped.inputs = {f.n_p(), f.n_x(), 0};
  std::vector<NodeId> roots = f.outputs;
  for (const Guard& guard : f.guards) roots.push_back(guard.condition);
  std::vector<NodeId> images = splice(f.graph, roots, swapped.graph, [&](Block block, std::uint32_t i) {
    return swapped.graph.input(block == Block::kVariables ? Block::kParameters : Block::kVariables, i);
  });
  const auto outputs = static_cast<std::ptrdiff_t>(f.n_y());
  swapped.outputs.assign(images.begin(), images.begin() + outputs);
  swapped.guards = f.guards;
  for (std::size_t g = 0; g < f.guards.size(); ++g) swapped.guards[g].condition = images[f.n_y() + g];
  return compact(swapped);
}

// A function made on request, with the options of its model.
CompiledFunction made(const Function& f, CodegenOptions options, Order order) {
  options.order = order;
  options.label = f.name;
  return CompiledFunction::make(f, options);
}

void check_finite(bool wanted, const char* asked, const std::string& name, const double* values,
                  std::size_t count) {
  const std::ptrdiff_t k = wanted ? detail::first_not_finite(values, count) : -1;
  if (k < 0) return;
  throw NumericalError(std::string(asked) + " of \"" + name + "\": result " + std::to_string(k) + " is " +
                       io::shortest(values[k]));
}

// What a function of (x, p, w) gives, as a vector.
vector_t product(const detail::SharedFunction& shared, const AdFunction::VectorRef& x,
                 const AdFunction::VectorRef& p, const AdFunction::VectorRef& w) {
  vector_t result(static_cast<Eigen::Index>(shared.f.n_y()));
  shared.evaluate(Order::kValue, {.x = x.data(), .p = p.data(), .w = w.data(), .y = result.data()});
  return result;
}

}  // namespace

void AdFunction::evaluate(const double* x, const double* p, double* y, double* jacobian,
                          const double* weights, double* hessian) const {
  evaluateBatch(1, x, p, y, jacobian, weights, hessian);
}

void AdFunction::evaluateBatch(std::size_t count, const double* x, const double* p, double* y,
                               double* jacobian, const double* weights, double* hessian) const {
  const Order order = hessian ? Order::kSecond : jacobian ? Order::kFirst : Order::kValue;
  const Model& m = model("evaluate", order);
  if (hessian && !weights && m.compiled().n_y() > 0)
    throw ArgumentError("evaluate of \"" + name() + "\": a Hessian is asked for without weights");
  m.shared.evaluate(order, {.count = count,
                            .x = x,
                            .p = p,
                            .w = hessian ? weights : nullptr,
                            .y = y,
                            .jacobian = jacobian,
                            .hessian = hessian});
}

matrix_t AdFunction::getParameterJacobian(const VectorRef& x, const VectorRef& p) const {
  constexpr const char* kAsked = "getParameterJacobian";
  const Model& m = model(kAsked);
  check_inputs(kAsked, x, p);
  const auto& shared = m.parameter_jacobian.get(
      [&] { return made(of_parameters(m.compiled().function()), m.options, Order::kFirst); });
  codegen::StackDoubles values(shared.f.jacobian_pattern().nnz());
  shared.evaluate(Order::kFirst, {.x = p.data(), .p = x.data(), .jacobian = values.data()});
  check_finite(settings_.checkFinite, kAsked, name(), values.data(), values.size());
  return detail::dense(shared.f.jacobian_pattern(), values.data(), false);
}

vector_t AdFunction::jvp(const VectorRef& x, const VectorRef& p, const VectorRef& direction) const {
  const Model& m = model("jvp");
  check_inputs("jvp", x, p);
  detail::check_size("jvp", name(), "direction", direction.size(), variable_dim_);
  const vector_t result = product(
      m.jvp.get([&] { return made(dyntape::jvp(m.compiled().function()), m.options, Order::kValue); }), x, p,
      direction);
  check_finite(settings_.checkFinite, "jvp", name(), result.data(), m.compiled().n_y());
  return result;
}

vector_t AdFunction::vjp(const VectorRef& x, const VectorRef& p, const VectorRef& weights) const {
  const Model& m = model("vjp");
  check_inputs("vjp", x, p);
  detail::check_size("vjp", name(), "weights", weights.size(), m.compiled().n_y());
  const vector_t result = product(
      m.vjp.get([&] { return made(dyntape::vjp(m.compiled().function()), m.options, Order::kValue); }), x, p,
      weights);
  check_finite(settings_.checkFinite, "vjp", name(), result.data(), variable_dim_);
  return result;
}

}  // namespace dyntape
