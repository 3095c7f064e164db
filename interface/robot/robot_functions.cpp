// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/robot_functions.h>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algorithms/check_forward_dynamics.h>
#include <dyntape/dynamics/effects/check.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/robot/check_accelerations.h>
#include <dyntape/interface/robot/factored_dynamics.h>
#include <dyntape/interface/robot/minverse_product.h>
#include <dyntape/interface/robot/robot_rows.h>

namespace dyntape {
namespace {

using dynamics::Data;
using dynamics::Model;
using dynamics::VectorX;

Function record_row(const Model<double>& model, const RobotFunction& function) {
  const Model<AD> taped = model.cast<AD>();
  detail::RobotWorkspace<AD> work(taped, function);
  return record(to_string(function), work.n_in(), [&](const VectorXad& x) {
    VectorXad y(static_cast<Eigen::Index>(work.n_out()));
    work.evaluate(x.data(), y.data());
    return y;
  });
}

// fd-derivatives with the product of the inverse inertia as a loop.
Function record_analytic_with_loop(const Model<double>& model) {
  const Model<AD> taped = model.cast<AD>();
  Data<AD> data(taped);
  const MinverseProduct product(data.tree);
  const auto n = static_cast<std::size_t>(model.nq + 2 * model.nv);
  return record(to_string(RobotFunction::kFdDerivatives), n, [&](const VectorXad& x) {
    dynamics::id_derivatives_under<AD>(taped, data, x.head(model.nq), x.segment(model.nq, model.nv),
                                       x.tail(model.nv));
    VectorXad y(3 * model.nv * model.nv);
    const VectorXad in = product.arguments(data.Minv, data.dtau_dq, data.dtau_dv);
    y << call(product.callee(), in), in.head(model.nv * model.nv);
    return y;
  });
}

Function record_analytic(const Model<double>& model, const RobotFunction& function) {
  const bool loops = function.row() == RobotFunction::kFdDerivatives.row() && function.mimics.empty() &&
                     MinverseProduct(dynamics::tree_of(model)).is_worth_a_loop();
  return loops ? record_analytic_with_loop(model) : record_row(model, function);
}

// Above so many operations the differentiated recording is not looked at: on every robot of
// config/ with two joints or more the analytic one has 0.3 to 0.9 times as many operations (the tests print the table), and
// deriving the other takes 0.1 to 0.3 s on a humanoid.
constexpr std::size_t kWorthTrying = 1000;

// The Jacobian at d = 0 with its inputs put back into the order of a state.
Function at_zero_increment(const Function& jacobian, std::uint32_t nq, std::uint32_t nv) {
  Function result;
  result.inputs = {nq + jacobian.n_x() - nv, 0, 0};
  Graph& graph = result.graph;
  result.outputs = splice(jacobian.graph, jacobian.outputs, graph, [&](Block block, std::uint32_t i) {
    if (block == Block::kParameters) return graph.input(Block::kVariables, i);
    return i < nv ? graph.constant(0) : graph.input(Block::kVariables, nq + i - nv);
  });
  return result;
}

// The dense blocks of a result from the non-zeros of a Jacobian with respect to (d, v, w): for each block of
// the value one for each input by which it is derived.
std::vector<NodeId> dense_blocks(Graph& graph, const std::vector<NodeId>& entries, const Pattern& pattern,
                                 const std::vector<RobotBlock>& values, const std::vector<int>& by, int nv) {
  const std::size_t n = static_cast<std::size_t>(nv);
  std::vector<NodeId> dense(pattern.rows * n * by.size(), graph.constant(0));
  std::vector<std::size_t> first, size;  // (rows) where the block of a row starts, how many rows it has
  for (const RobotBlock& value : values) {
    const std::size_t start = first.size();
    first.resize(start + static_cast<std::size_t>(value.size()), start);
    size.resize(first.size(), static_cast<std::size_t>(value.size()));
  }
  for (std::size_t k = 0; k < entries.size(); ++k) {
    const std::size_t row = pattern.row[k], input = pattern.col[k] / n;
    const auto at = std::find(by.begin(), by.end(), static_cast<int>(input));
    if (at == by.end()) continue;
    const std::size_t block = first[row] * by.size() + static_cast<std::size_t>(at - by.begin()) * size[row];
    dense[(block + row - first[row]) * n + pattern.col[k] % n] = entries[k];
  }
  return dense;
}

Function record_differentiated(const Model<double>& model, const RobotFunction& function) {
  const RobotFunction value = value_of(function);
  const Model<AD> taped = model.cast<AD>();
  detail::RobotWorkspace<AD> work(taped, value);
  const auto nq = static_cast<std::uint32_t>(work.sizes.nq), nv = static_cast<std::uint32_t>(work.sizes.nv);
  const auto n_in = static_cast<std::uint32_t>(work.n_in());
  const Function moved =
      record(to_string(function), n_in - nq + nv, nq, [&](const VectorXad& x, const VectorXad& q) {
        const VectorXad d = x.head(nv);
        VectorXad state(n_in), y(static_cast<Eigen::Index>(work.n_out()));
        state << work.integrate(q, d), x.tail(n_in - nq);
        work.evaluate(state.data(), y.data());
        return y;
      });
  const SparseFunction jacobian = sparse_jacobian(moved);
  Function result = at_zero_increment(jacobian.function, nq, nv);
  result.name = to_string(function);
  result.outputs = dense_blocks(result.graph, result.outputs, jacobian.pattern, outputs(model, value),
                                detail::derived_by(function), work.sizes.nv);
  return compact(result);
}

Function named(Function f, const Model<double>& model, const RobotFunction& function) {
  f.name = model.name + "_" + to_string(function);
  f.input_names[0] = input_names(model, function);
  f.output_names = output_names(model, function);
  return f;
}

template <class Algorithm>
Function record_with_effects(const Model<double>& model, const dynamics::Effects<double>& effects,
                             const RobotFunction& like, const char* suffix, Algorithm algorithm) {
  dynamics::check(model, effects);
  const Model<AD> taped = model.cast<AD>();
  const dynamics::Effects<AD> acting = effects.cast<AD>();
  Function f = record(suffix, static_cast<std::size_t>(model.nq + 2 * model.nv), [&](const VectorXad& x) {
    Data<AD> data(taped);
    dynamics::EffectTorques<AD> torques(taped);
    const VectorXad q = x.head(model.nq), v = x.segment(model.nq, model.nv), w = x.tail(model.nv);
    return VectorXad(algorithm(taped, data, torques, acting, q, v, w));
  });
  f.name = model.name + "_" + suffix;
  f.input_names[0] = input_names(model, like);
  f.output_names = output_names(model, like);
  return f;
}

}  // namespace

Eigen::VectorXd evaluate_analytic(const Model<double>& model, const RobotFunction& function,
                                  const Eigen::Ref<const Eigen::VectorXd>& state) {
  detail::RobotWorkspace<double> work(model, function);
  if (state.size() != static_cast<Eigen::Index>(work.n_in()))
    throw ArgumentError(std::string(to_string(function)) + ": the state has " + std::to_string(state.size()) +
                        " entries, model \"" + model.name + "\" expects " + std::to_string(work.n_in()));
  Eigen::VectorXd y(static_cast<Eigen::Index>(work.n_out()));
  work.evaluate(state.data(), y.data());
  return y;
}

Function record_robot_function(const Model<double>& model, const RobotFunction& function,
                               RobotSource source) {
  detail::check_accelerations(model, function);
  if (source == RobotSource::kDifferentiated && is_derivative(function)) {
    return named(record_differentiated(model, function), model, function);
  }
  Function best = record_analytic(model, function);
  if (source == RobotSource::kAnalytic) return named(std::move(best), model, function);
  std::size_t least = total_operations(best);
  const auto consider = [&](Function&& other) {
    const std::size_t operations = total_operations(other);
    if (operations < least) best = std::move(other), least = operations;
  };
  for (Function& other : detail::record_factored(model, function)) consider(std::move(other));
  if (is_derivative(function) && least <= kWorthTrying) consider(record_differentiated(model, function));
  return named(std::move(best), model, function);
}

Function record_forward_dynamics(const Model<double>& model, const dynamics::Effects<double>& effects) {
  dynamics::check_forward_dynamics(model, effects.acting());
  return record_with_effects(model, effects, RobotFunction::kAba, "forward_dynamics",
                             dynamics::forward_dynamics<AD>);
}

Function record_inverse_dynamics(const Model<double>& model, const dynamics::Effects<double>& effects) {
  return record_with_effects(model, effects, RobotFunction::kRnea, "inverse_dynamics",
                             dynamics::inverse_dynamics<AD>);
}

}  // namespace dyntape
