// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/derive/derive.h>

#include <algorithm>

#include <dyntape/autodiff/derive/jacobian_blocks.h>
#include <dyntape/autodiff/derive/sparsity.h>
#include <dyntape/autodiff/derive/sweep.h>

namespace dyntape {
namespace {

// `count` further weights, as nodes.
std::vector<NodeId> append_weights(Function& function, std::size_t count) {
  std::vector<NodeId> weights;
  for (std::size_t i = 0; i < count; ++i) {
    weights.push_back(function.graph.input(Block::kWeights, static_cast<std::uint32_t>(function.n_w() + i)));
  }
  function.inputs[2] += count;
  function.input_names[2].clear();
  return weights;
}

std::vector<Seed> as_weights(const std::vector<NodeId>& nodes) {
  std::vector<Seed> seeds;
  for (NodeId node : nodes) seeds.push_back(Seed::weight(node));
  return seeds;
}

// One weight for each seed that is there, and one more for each that is a weight itself.
std::vector<Seed> append_seeds(Function& function, const Seeds& kinds) {
  std::vector<Seed> seeds(kinds.size(), kNoNode);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i] != SeedKind::kNone) seeds[i].value = append_weights(function, 1)[0];
  }
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i] == SeedKind::kWeight) seeds[i].alive = append_weights(function, 1)[0];
  }
  return seeds;
}

std::vector<NodeId> or_zero(Function& function, std::vector<NodeId> nodes) {
  std::replace(nodes.begin(), nodes.end(), kNoNode, function.graph.constant(0));
  return nodes;
}

using Variables = Sweep::Variables;

std::vector<NodeId> append_tangents(Function& function, const std::vector<Seed>& seeds,
                                    Variables variables = Variables::kFinite) {
  return Sweep(function.graph, variables).forward(function.outputs, [&](std::uint32_t i) {
    return seeds[i];
  });
}

// Gradient of the weighted sum of outputs, appended to the graph: one node a variable, kNoNode for zero.
std::vector<NodeId> append_gradient(Function& function, const std::vector<Seed>& weights,
                                    Variables variables = Variables::kFinite) {
  std::vector<NodeId> gradient(function.n_x(), kNoNode);
  for (const auto& [variable, node] : Sweep(function.graph, variables).reverse(function.outputs, weights)) {
    gradient[variable] = node;
  }
  return gradient;
}

// Non-zeros of the lower triangle of the Jacobian of a gradient.
std::vector<NodeId> append_hessian(Function& function, const std::vector<NodeId>& gradient, Pattern& lower) {
  const std::vector<NodeId> outputs = or_zero(function, gradient);
  const Pattern full = jacobian_sparsity(function.graph, outputs, function.n_x());

  // Either triangle gives an entry: sweeping the variables with many entries first leaves the others few
  // outputs.
  std::vector<std::vector<std::uint32_t>> neighbours = columns_of_rows(full);
  for (std::size_t k = 0; k < full.nnz(); ++k) neighbours[full.col[k]].push_back(full.row[k]);
  for (auto& list : neighbours) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  std::vector<std::uint32_t> order(neighbours.size());
  for (std::size_t j = 0; j < order.size(); ++j) order[j] = static_cast<std::uint32_t>(j);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return neighbours[a].size() > neighbours[b].size();
  });

  struct Entry {
    std::uint32_t row, col;
    NodeId node;
  };
  std::vector<Entry> entries;
  std::vector<bool> swept(order.size(), false);
  Sweep sweep(function.graph);
  for (NodeId root : gradient) {
    if (root != kNoNode) sweep.watch(root);
  }
  for (std::uint32_t j : order) {
    std::vector<NodeId> roots;
    std::vector<std::uint32_t> rows;
    for (std::uint32_t i : neighbours[j]) {
      if (swept[i] || gradient[i] == kNoNode) continue;
      rows.push_back(i);
      roots.push_back(gradient[i]);
    }
    swept[j] = true;
    const std::vector<NodeId> tangents = roots.empty() ? std::vector<NodeId>() : sweep.forward(roots, j);
    if (gradient[j] != kNoNode) sweep.unwatch(gradient[j]);
    for (std::size_t k = 0; k < roots.size(); ++k) {
      if (tangents[k] != kNoNode)
        entries.push_back({std::max(rows[k], j), std::min(rows[k], j), tangents[k]});
    }
  }
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return a.row != b.row ? a.row < b.row : a.col < b.col; });
  lower = {function.n_x(), function.n_x(), {}, {}};
  std::vector<NodeId> nodes;
  for (const Entry& entry : entries) {
    lower.row.push_back(entry.row);
    lower.col.push_back(entry.col);
    nodes.push_back(entry.node);
  }
  return nodes;
}

Function derivative(Function function, const std::vector<NodeId>& outputs, const char* suffix) {
  function.outputs = or_zero(function, outputs);
  function.name += suffix;
  function.output_names.clear();
  return compact(function);
}

}  // namespace

Function jvp(const Function& function) {
  Function f = compact(function);
  const std::vector<Seed> direction = as_weights(append_weights(f, f.n_x()));
  const std::vector<NodeId> tangents = append_tangents(f, direction);
  return derivative(std::move(f), tangents, "_jvp");
}

Function vjp(const Function& function) {
  Function f = compact(function);
  const std::vector<NodeId> gradient = append_gradient(f, as_weights(append_weights(f, f.n_y())));
  return derivative(std::move(f), gradient, "_vjp");
}

Function jvp_by_seeds(const Function& function, const Seeds& kinds) {
  Function f = compact(function);
  const std::vector<Seed> seeds = append_seeds(f, kinds);
  const std::vector<NodeId> tangents = append_tangents(f, seeds, Variables::kAny);
  return weights_as_variables(derivative(std::move(f), tangents, "_jvp"));
}

Function vjp_by_seeds(const Function& function, const Seeds& kinds) {
  Function f = compact(function);
  const std::vector<Seed> seeds = append_seeds(f, kinds);
  const std::vector<NodeId> gradient = append_gradient(f, seeds, Variables::kAny);
  return weights_as_variables(derivative(std::move(f), gradient, "_vjp"));
}

namespace {

// What derive() finds, without what it leaves out and replaces at the end.
Derivatives with_derivatives(const Function& function, Order order) {
  Derivatives result;
  result.order = order;
  result.n_y = function.n_y();
  Function f = compact(function);
  std::vector<NodeId> outputs = f.outputs;
  if (order >= Order::kFirst) {
    const std::vector<NodeId> entries = append_jacobian(f, result.jacobian);
    outputs.insert(outputs.end(), entries.begin(), entries.end());
  }
  if (order == Order::kSecond) {
    const std::vector<NodeId> gradient = append_gradient(f, as_weights(append_weights(f, f.n_y())));
    const std::vector<NodeId> entries = append_hessian(f, gradient, result.hessian);
    outputs.insert(outputs.end(), entries.begin(), entries.end());
  }
  f.outputs = std::move(outputs);
  f.output_names.clear();
  result.function = std::move(f);
  return result;
}

// Only the outputs from `first` on.
Function outputs_from(Function function, std::size_t first, const char* suffix) {
  const auto& callees = function.graph.callees();
  if (std::any_of(callees.begin(), callees.end(), [](const auto& c) { return c->dissolves(); }))
    function = dissolved(function);
  function.outputs.erase(function.outputs.begin(),
                         function.outputs.begin() + static_cast<std::ptrdiff_t>(first));
  function.name += suffix;
  return compact(function);
}

}  // namespace

Derivatives derive(const Function& function, Order order) {
  Derivatives result = with_derivatives(function, order);
  result.function = dissolved(result.function);
  return result;
}

SparseFunction sparse_jacobian(const Function& function) {
  Derivatives d = with_derivatives(function, Order::kFirst);
  return {outputs_from(std::move(d.function), d.n_y, "_jacobian"), std::move(d.jacobian)};
}

SparseFunction sparse_hessian(const Function& function) {
  Derivatives d = with_derivatives(function, Order::kSecond);
  const std::size_t first = d.n_y + d.jacobian.nnz();
  return {outputs_from(std::move(d.function), first, "_hessian"), std::move(d.hessian)};
}

}  // namespace dyntape
