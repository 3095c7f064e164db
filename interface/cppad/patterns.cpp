// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/detail/patterns.h>

#include <algorithm>
#include <map>
#include <set>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/derive/sparsity.h>
#include <dyntape/autodiff/graph/callee.h>

namespace CppAD::inline dyntape_names::detail {

// 64 variables at a time, a bit each.
Pattern dependency_pattern(const Function& function) {
  const Graph& graph = function.graph;
  std::vector<std::vector<std::uint32_t>> rows(function.n_y());
  std::vector<std::uint64_t> bits(graph.size());
  for (std::size_t base = 0; base < function.n_x(); base += 64) {
    for (NodeId id = 0; id < graph.size(); ++id) {
      const Node& node = graph[id];
      std::uint64_t b = 0;
      if (node.op == Op::Input && node.a == static_cast<NodeId>(Block::kVariables)) {
        if (node.b >= base && node.b < base + 64) b = std::uint64_t(1) << (node.b - base);
      }
      graph.for_each_argument(id, [&](NodeId a) { b |= bits[a]; });
      bits[id] = b;
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t k = 0; k < 64; ++k) {
        if (bits[function.outputs[i]] >> k & 1) rows[i].push_back(static_cast<std::uint32_t>(base + k));
      }
    }
  }
  return pattern_from_rows(rows, function.n_x());
}

Pattern rows_of(const Pattern& pattern, std::size_t rows) {
  Pattern first{rows, pattern.cols, {}, {}};
  for (std::size_t k = 0; k < pattern.nnz() && pattern.row[k] < rows; ++k) {
    first.row.push_back(pattern.row[k]);
    first.col.push_back(pattern.col[k]);
  }
  return first;
}

namespace {

// Polynomials with the patterns of a kernel in their place: sums of what a result depends on, and of the products of the pairs.  No two
// coefficients are equal, so that nothing cancels.
struct KernelStandIns {
  const Kernels& kernels;
  double coefficient = 1;
  Graph graph;

  NodeId term(NodeId x) { return graph.make(Op::Mul, graph.constant(coefficient += 0.37), x); }

  std::vector<NodeId> results(const Callee& callee, const KernelInSeries& kernel,
                              const std::vector<NodeId>& arguments) {
    std::vector<NodeId> sums(callee.n_out, graph.constant(0));
    const auto add = [&](std::size_t i, NodeId x) { sums[i] = graph.make(Op::Add, sums[i], term(x)); };
    const bool all = callee.pattern.rows == 0;
    for (std::size_t i = 0; i < callee.n_out; ++i) {
      std::vector<std::size_t> of_row;
      for (std::size_t j = 0; j < callee.n_in && all; ++j) of_row.push_back(j);
      for (std::size_t k = 0; k < callee.pattern.nnz(); ++k) {
        if (callee.pattern.row[k] == i) of_row.push_back(callee.pattern.col[k]);
      }
      for (std::size_t j : of_row) add(i, arguments[j]);
      Pattern pairs;
      if (kernel.hessian(i, pairs)) {
        for (std::size_t k = 0; k < pairs.nnz(); ++k)
          add(i, graph.make(Op::Mul, arguments[pairs.row[k]], arguments[pairs.col[k]]));
        continue;
      }
      for (std::size_t j : of_row) {
        for (std::size_t k : of_row) add(i, graph.make(Op::Mul, arguments[j], arguments[k]));
      }
    }
    return sums;
  }
};

Function without_kernels(const Function& function, const Kernels& kernels) {
  KernelStandIns made{kernels, 1, Graph()};
  const Graph& from = function.graph;
  std::vector<NodeId> image(from.size());
  std::map<NodeId, std::vector<NodeId>> of_calls;
  for (NodeId id = 0; id < from.size(); ++id) {
    const Node& node = from[id];
    std::vector<NodeId> arguments;
    from.for_each_argument(id, [&](NodeId a) { arguments.push_back(image[a]); });
    if (node.op == Op::Const) {
      image[id] = made.graph.constant(from.constant_value(id));
    } else if (node.op == Op::Input) {
      image[id] = made.graph.input(static_cast<Block>(node.a), node.b);
    } else if (node.op == Op::Call) {
      const auto& callee = from.callees()[node.a];
      const auto kernel = kernels.find(callee.get());
      of_calls[id] = kernel == kernels.end() ? made.graph.call(callee, arguments)
                                             : made.results(*callee, *kernel->second, arguments);
    } else if (node.op == Op::Result) {
      image[id] = of_calls[node.a][node.b];
    } else {
      arguments.resize(3, kNoNode);
      image[id] = made.graph.make(node.op, arguments[0], arguments[1], arguments[2]);
    }
  }
  Function result;
  result.name = function.name;
  result.inputs = function.inputs;
  result.graph = std::move(made.graph);
  for (NodeId output : function.outputs) result.outputs.push_back(image[output]);
  return result;
}

}  // namespace

Pattern second_order_pattern(const Function& function, std::size_t range, const std::vector<bool>& of_range,
                             const Kernels& kernels) {
  const std::size_t n = function.n_x();
  std::vector<std::set<std::uint32_t>> columns(n);
  std::vector<std::size_t> outputs;
  for (std::size_t i = 0; i < range; ++i) {
    if (of_range[i]) outputs.push_back(i);
  }
  const Function part = select_outputs(function, outputs);
  const Pattern lower = sparse_hessian(kernels.empty() ? part : without_kernels(part, kernels)).pattern;
  for (std::size_t k = 0; k < lower.nnz(); ++k) {
    columns[lower.row[k]].insert(lower.col[k]);
    columns[lower.col[k]].insert(lower.row[k]);
  }
  std::vector<std::vector<std::uint32_t>> rows;
  for (const auto& row : columns) rows.emplace_back(row.begin(), row.end());
  return pattern_from_rows(rows, n);
}

namespace {

bool is_in(const Pattern& pattern, std::size_t row, std::size_t col) {
  const auto from = std::lower_bound(pattern.row.begin(), pattern.row.end(), row),
             to = std::upper_bound(from, pattern.row.end(), row);
  const auto first = pattern.col.begin() + (from - pattern.row.begin()),
             last = pattern.col.begin() + (to - pattern.row.begin());
  return std::binary_search(first, last, col);
}

void check_pattern(const char* what, const Pattern& pattern, std::size_t rows, std::size_t cols) {
  if (pattern.rows == rows && pattern.cols == cols) return;
  refuse(std::string(what) + ": the pattern is " + std::to_string(pattern.rows) + " x " +
         std::to_string(pattern.cols) + ", expected " + std::to_string(rows) + " x " + std::to_string(cols));
}

void color_all(const Entries& entries, const Pattern& pattern, bool rows, Colors& colors) {
  const std::size_t n = rows ? pattern.rows : pattern.cols, across = rows ? pattern.cols : pattern.rows;
  std::vector<std::vector<std::size_t>> of_line(n), of_cross(across);
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    const std::size_t line = rows ? pattern.row[k] : pattern.col[k],
                      cross = rows ? pattern.col[k] : pattern.row[k];
    of_line[line].push_back(cross);
    of_cross[cross].push_back(line);
  }
  colors = {std::vector<std::size_t>(n, SIZE_MAX), 0, {}};
  std::vector<bool> asked(n, false);
  for (std::size_t e = 0; e < entries.row.size(); ++e) asked[rows ? entries.row[e] : entries.col[e]] = true;
  std::vector<std::size_t> taken_by;  // color: the last line that may not have it
  for (std::size_t line = 0; line < n; ++line) {
    if (!asked[line]) continue;
    for (std::size_t cross : of_line[line]) {
      for (std::size_t other : of_cross[cross]) {
        if (other != line && colors.color[other] != SIZE_MAX) taken_by[colors.color[other]] = line;
      }
    }
    std::size_t c = 0;
    while (c < taken_by.size() && taken_by[c] == line) ++c;
    if (c == taken_by.size()) taken_by.push_back(SIZE_MAX);
    colors.color[line] = c;
  }
  colors.count = taken_by.size();
  for (std::size_t e = 0; e < entries.row.size(); ++e)
    colors.in_pattern.push_back(is_in(pattern, entries.row[e], entries.col[e]));
}

}  // namespace

void color_lines(const char* what, const Entries& entries, const Pattern& pattern, std::size_t n_rows,
                 std::size_t n_cols, bool rows, Colors& colors) {
  if (colors.empty()) {
    check_pattern(what, pattern, n_rows, n_cols);
    color_all(entries, pattern, rows, colors);
  } else if (colors.color.size() != (rows ? n_rows : n_cols) ||
             colors.in_pattern.size() != entries.row.size()) {
    refuse(std::string(what) + ": work is of a call with other entries, expected work.clear() before it");
  }
}

}  // namespace CppAD::inline dyntape_names::detail
