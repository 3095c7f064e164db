// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/derive.h>

#include <algorithm>

#include <dyntape/autodiff/jacobian_blocks.h>
#include <dyntape/autodiff/sparsity.h>
#include <dyntape/autodiff/sweep.h>

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

// Gradient of the weighted sum of outputs, appended to the graph: one node a variable, kNoNode for zero.
std::vector<NodeId> append_gradient(Function& function, const std::vector<NodeId>& weights) {
  std::vector<NodeId> gradient(function.n_x(), kNoNode);
  for (const auto& [variable, node] : Sweep(function.graph).reverse(function.outputs, weights)) {
    gradient[variable] = node;
  }
  return gradient;
}

// Non-zeros of the lower triangle of the Jacobian of a gradient.
std::vector<NodeId> append_hessian(Function& function, const std::vector<NodeId>& gradient, Pattern& lower) {
  std::vector<NodeId> outputs = gradient;
  std::replace(outputs.begin(), outputs.end(), kNoNode, function.graph.constant(0));
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
  for (std::uint32_t j : order) {
    std::vector<NodeId> roots;
    std::vector<std::uint32_t> rows;
    for (std::uint32_t i : neighbours[j]) {
      if (swept[i] || gradient[i] == kNoNode) continue;
      rows.push_back(i);
      roots.push_back(gradient[i]);
    }
    swept[j] = true;
    if (roots.empty()) continue;
    const NodeId one = function.graph.constant(1);
    const std::vector<NodeId> tangents =
        sweep.forward(roots, [&](std::uint32_t i) { return i == j ? one : kNoNode; });
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

}  // namespace

Function jvp(const Function& function) {
  Function result = compact(function);
  const std::vector<NodeId> direction = append_weights(result, result.n_x());
  const NodeId zero = result.graph.constant(0);
  result.outputs = Sweep(result.graph).forward(result.outputs, [&](std::uint32_t i) { return direction[i]; });
  std::replace(result.outputs.begin(), result.outputs.end(), kNoNode, zero);
  result.name += "_jvp";
  result.output_names.clear();
  return compact(result);
}

Function vjp(const Function& function) {
  Function result = compact(function);
  result.outputs = append_gradient(result, append_weights(result, result.n_y()));
  std::replace(result.outputs.begin(), result.outputs.end(), kNoNode, result.graph.constant(0));
  result.name += "_vjp";
  result.output_names.clear();
  return compact(result);
}

Derivatives derive(const Function& function, Order order) {
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
    const std::vector<NodeId> gradient = append_gradient(f, append_weights(f, f.n_y()));
    const std::vector<NodeId> entries = append_hessian(f, gradient, result.hessian);
    outputs.insert(outputs.end(), entries.begin(), entries.end());
  }
  f.outputs = std::move(outputs);
  f.output_names.clear();
  result.function = dissolved(f);
  return result;
}

namespace {

// Only the outputs from `first` on.
Function outputs_from(const Function& function, std::size_t first, const char* suffix) {
  std::vector<std::size_t> chosen;
  for (std::size_t i = first; i < function.n_y(); ++i) chosen.push_back(i);
  Function result = select_outputs(function, chosen);
  result.name += suffix;
  return result;
}

}  // namespace

SparseFunction sparse_jacobian(const Function& function) {
  const Derivatives d = derive(function, Order::kFirst);
  return {outputs_from(d.function, d.n_y, "_jacobian"), d.jacobian};
}

SparseFunction sparse_hessian(const Function& function) {
  const Derivatives d = derive(function, Order::kSecond);
  return {outputs_from(d.function, d.n_y + d.jacobian.nnz(), "_hessian"), d.hessian};
}

}  // namespace dyntape
