// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/sparsity.h>

#include <algorithm>

#include <dyntape/autodiff/callee.h>
#include <dyntape/autodiff/derive.h>

namespace dyntape {
namespace {

using Rows = std::vector<std::vector<std::uint32_t>>;

// Visits the arguments through which a slope passes.
template <class Visit>
void for_each_slope(const Graph& graph, NodeId id, Visit&& visit) {
  const Node& node = graph[id];
  if (node.op == Op::Result) {
    const Node& call = graph[node.a];
    const Pattern& pattern = graph.callees()[call.a]->pattern;
    const std::size_t n = call_arity(graph, node.a);
    if (pattern.rows == 0) {
      for (std::size_t i = 0; i < n; ++i) visit(graph.call_arguments()[call.b + i]);
    } else {
      const auto first =
          std::lower_bound(pattern.row.begin(), pattern.row.end(), node.b) - pattern.row.begin();
      for (auto k = static_cast<std::size_t>(first); k < pattern.nnz() && pattern.row[k] == node.b; ++k) {
        visit(graph.call_arguments()[call.b + pattern.col[k]]);
      }
    }
  } else if (node.op != Op::Call) {
    for (int i = 0; i < info(node.op).arity; ++i) {
      if (has_slope(node.op, i)) visit(node.argument(i));
    }
  }
}

// One walk down from each output.  Linear in the sum of the cones; gives up (false) after `budget` steps.
bool walk_down(const Graph& graph, const std::vector<NodeId>& outputs, std::size_t budget, Rows& rows) {
  std::vector<std::uint32_t> seen(graph.size(), 0);
  std::vector<NodeId> stack;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const auto mark = static_cast<std::uint32_t>(i + 1);
    const auto push = [&](NodeId id) {
      if (seen[id] != mark) seen[id] = mark, stack.push_back(id);
    };
    push(outputs[i]);
    while (!stack.empty()) {
      const NodeId id = stack.back();
      stack.pop_back();
      const Node& node = graph[id];
      if (node.op == Op::Input && node.a == static_cast<NodeId>(Block::kVariables)) rows[i].push_back(node.b);
      for_each_slope(graph, id, push);
      if (budget-- == 0) return false;
    }
    std::sort(rows[i].begin(), rows[i].end());
  }
  return true;
}

// 64 variables at a time, one bit each, swept up through the whole graph.
void sweep_up(const Graph& graph, const std::vector<NodeId>& outputs, std::size_t n_x, Rows& rows) {
  std::vector<std::uint64_t> bits(graph.size());
  for (std::size_t base = 0; base < n_x; base += 64) {
    for (NodeId id = 0; id < graph.size(); ++id) {
      const Node& node = graph[id];
      std::uint64_t b = 0;
      if (node.op == Op::Input) {
        if (node.a == static_cast<NodeId>(Block::kVariables) && node.b >= base && node.b < base + 64) {
          b = std::uint64_t(1) << (node.b - base);
        }
      } else {
        for_each_slope(graph, id, [&](NodeId a) { b |= bits[a]; });
      }
      bits[id] = b;
    }
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      for (std::uint64_t b = bits[outputs[i]]; b; b &= b - 1) {
        rows[i].push_back(static_cast<std::uint32_t>(base + static_cast<std::size_t>(__builtin_ctzll(b))));
      }
    }
  }
}

}  // namespace

Pattern jacobian_sparsity(const Graph& graph, const std::vector<NodeId>& outputs, std::size_t n_x) {
  Rows rows(outputs.size());
  const std::size_t sweeps = (n_x + 63) / 64;
  if (!walk_down(graph, outputs, 1000 + 4 * graph.size() * (1 + sweeps), rows)) {
    rows.assign(outputs.size(), {});
    sweep_up(graph, outputs, n_x, rows);
  }
  return pattern_from_rows(rows, n_x);
}

Pattern jacobian_sparsity(const Function& function) {
  return jacobian_sparsity(function.graph, function.outputs, function.n_x());
}

Pattern hessian_sparsity(const Function& function) {
  Pattern full = jacobian_sparsity(vjp(function));
  Pattern lower{full.rows, full.cols, {}, {}};
  for (std::size_t k = 0; k < full.nnz(); ++k) {
    if (full.col[k] > full.row[k]) continue;
    lower.row.push_back(full.row[k]);
    lower.col.push_back(full.col[k]);
  }
  return lower;
}

}  // namespace dyntape
