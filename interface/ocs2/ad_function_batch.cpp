// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluation into the caller's memory, and the derivatives that are made on request.
#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>
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

TieredFunction made(const Function& f, CodegenOptions options, Order order) {
  options.order = order;
  options.label = f.name;
  return detail::made(f, options);
}

// One evaluation at (x, p) with `order`; what is wanted of it is in `points`.
void run_one(const detail::SharedFunction& shared, Order order, Points points,
             TieredFunction::Workspace& workspace) {
  shared.tiers.check(shared.tiers.run(order, points, workspace));
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
  const auto room = shared.room();
  vector_t result(static_cast<Eigen::Index>(shared.compiled().n_y()));
  Points points;
  points.x = x.data(), points.p = p.data(), points.w = w.data(), points.y = result.data();
  run_one(shared, Order::kValue, points, room->workspace);
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
  if (hessian && !weights && m.compiled().n_y() > 0) {
    throw ArgumentError("evaluate of \"" + name() + "\": a Hessian is asked for without weights");
  }
  Points points;
  points.lanes = count;
  points.x = x, points.p = p, points.w = hessian ? weights : nullptr;
  points.y = y, points.jacobian = jacobian, points.hessian = hessian;
  const auto room = m.shared.room();
  const TieredFunction& f = m.shared.tiers;
  f.check(f.run(order, points, room->workspace), count);
}

matrix_t AdFunction::getParameterJacobian(const VectorRef& x, const VectorRef& p) const {
  constexpr const char* kAsked = "getParameterJacobian";
  const Model& m = model(kAsked);
  check_inputs(kAsked, x, p);
  const auto& shared = m.parameter_jacobian.get(
      [&] { return made(of_parameters(m.compiled().function()), m.options, Order::kFirst); });
  const auto room = shared.room();
  Points points;
  points.x = p.data(), points.p = x.data(), points.jacobian = room->jacobian.data();
  run_one(shared, Order::kFirst, points, room->workspace);
  check_finite(settings_.checkFinite, kAsked, name(), room->jacobian.data(), room->jacobian.size());
  return detail::dense(shared.compiled().jacobian_pattern(), room->jacobian, false);
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
