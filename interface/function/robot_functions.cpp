// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/function/robot_functions.h>

#include <dyntape/autodiff/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record.h>
#include <dyntape/dynamics/configuration.h>
#include <dyntape/interface/function/robot_plain.h>

namespace dyntape {
namespace {

using dynamics::Data;
using dynamics::Model;
using dynamics::VectorX;

template <class T>
VectorX<T> run(const Model<T>& model, RobotFunction function, const VectorX<T>& q, const VectorX<T>& rest) {
  Data<T> data(model);
  const Eigen::Index n = rest.size() / 2;
  const VectorX<T> v = rest.head(n), w = rest.tail(n);
  VectorX<T> y(static_cast<Eigen::Index>(detail::size_of_result(model.nv, function)));
  detail::run<T>(model, data, function, q, v, w, y.data());
  return y;
}

Function record_analytic(const Model<double>& model, RobotFunction function) {
  const Model<AD> taped = model.cast<AD>();
  const Eigen::Index rest = detail::rest_of_state(model.nv, function);
  return record(to_string(function), static_cast<std::size_t>(model.nq + rest),
                [&](const VectorXad& x) { return run<AD>(taped, function, x.head(model.nq), x.tail(rest)); });
}

// Above so many operations the analytic recording is taken without a look at the other: on every robot of
// config/ with two joints or more it has 0.3 to 0.9 times as many operations (the tests print the table), and
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

// Three square blocks, row by row, from the non-zeros of a Jacobian with respect to (d, v, w).
std::vector<NodeId> dense_blocks(Graph& graph, const std::vector<NodeId>& entries, const Pattern& pattern) {
  const std::size_t n = pattern.rows;
  std::vector<NodeId> dense(3 * n * n, graph.constant(0));
  for (std::size_t k = 0; k < entries.size(); ++k) {
    dense[(pattern.col[k] / n) * n * n + pattern.row[k] * n + pattern.col[k] % n] = entries[k];
  }
  return dense;
}

Function record_differentiated(const Model<double>& model, RobotFunction function) {
  const RobotFunction value = is_forward(function) ? RobotFunction::kAba : RobotFunction::kRnea;
  const Model<AD> taped = model.cast<AD>();
  const auto nq = static_cast<std::uint32_t>(model.nq), nv = static_cast<std::uint32_t>(model.nv);
  const Function moved = record(to_string(function), 3 * nv, nq, [&](const VectorXad& x, const VectorXad& q) {
    const VectorXad d = x.head(nv);
    return run<AD>(taped, value, dynamics::integrate<AD>(taped, q, d), x.tail(2 * nv));
  });
  const SparseFunction jacobian = sparse_jacobian(moved);
  Function result = at_zero_increment(jacobian.function, nq, nv);
  result.name = to_string(function);
  result.outputs = dense_blocks(result.graph, result.outputs, jacobian.pattern);
  return compact(result);
}

Function named(Function f, const Model<double>& model, RobotFunction function) {
  f.name = model.name + "_" + to_string(function);
  f.input_names[0] = input_names(model, function);
  f.output_names = output_names(model, function);
  return f;
}

VectorX<AD> cast(const VectorX<double>& v) { return v.cast<AD>(); }

template <class Algorithm>
Function record_with_effects(const Model<double>& model, const dynamics::Effects<double>& effects,
                             RobotFunction like, const char* suffix, Algorithm algorithm) {
  const Model<AD> taped = model.cast<AD>();
  const dynamics::Effects<AD> acting = recorded_effects(effects);
  Function f = record(suffix, static_cast<std::size_t>(model.nq + 2 * model.nv), [&](const VectorXad& x) {
    Data<AD> data(taped);
    const VectorXad q = x.head(model.nq), v = x.segment(model.nq, model.nv), w = x.tail(model.nv);
    return VectorXad(algorithm(taped, data, acting, q, v, w));
  });
  f.name = model.name + "_" + suffix;
  f.input_names[0] = input_names(model, like);
  f.output_names = output_names(model, like);
  return f;
}

}  // namespace

Eigen::VectorXd evaluate_analytic(const Model<double>& model, RobotFunction function,
                                  const Eigen::Ref<const Eigen::VectorXd>& state) {
  const Eigen::Index rest = detail::rest_of_state(model.nv, function);
  if (state.size() != model.nq + rest) {
    throw ArgumentError(std::string(to_string(function)) + ": the state has " + std::to_string(state.size()) +
                        " entries, model \"" + model.name + "\" expects " + std::to_string(model.nq + rest));
  }
  return run<double>(model, function, state.head(model.nq), state.tail(rest));
}

Function record_robot_function(const Model<double>& model, RobotFunction function, RobotSource source) {
  if (!is_derivative(function) || source == RobotSource::kAnalytic) {
    return named(record_analytic(model, function), model, function);
  }
  if (source == RobotSource::kDifferentiated) {
    return named(record_differentiated(model, function), model, function);
  }
  const Function analytic = record_analytic(model, function);
  if (total_operations(analytic) > kWorthTrying) return named(analytic, model, function);
  const Function differentiated = record_differentiated(model, function);
  const bool is_analytic = total_operations(analytic) <= total_operations(differentiated);
  return named(is_analytic ? analytic : differentiated, model, function);
}

dynamics::Effects<AD> recorded_effects(const dynamics::Effects<double>& effects) {
  dynamics::Effects<AD> result;
  result.gravity = effects.gravity;
  if (effects.armature) result.armature = cast(*effects.armature);
  if (effects.damping) result.damping = cast(*effects.damping);
  if (effects.friction) result.friction = {cast(effects.friction->torque), AD(effects.friction->smoothing)};
  if (effects.springs) result.springs = {cast(effects.springs->stiffness), cast(effects.springs->rest)};
  for (const auto& wrench : effects.wrenches) result.wrenches.push_back(wrench.cast<AD>());
  return result;
}

Function record_forward_dynamics(const Model<double>& model, const dynamics::Effects<double>& effects) {
  return record_with_effects(model, effects, RobotFunction::kAba, "forward_dynamics",
                             dynamics::forward_dynamics<AD>);
}

Function record_inverse_dynamics(const Model<double>& model, const dynamics::Effects<double>& effects) {
  return record_with_effects(model, effects, RobotFunction::kRnea, "inverse_dynamics",
                             dynamics::inverse_dynamics<AD>);
}

}  // namespace dyntape
