// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/detail/patterns.h>

#include <algorithm>
#include <map>
#include <numeric>

#include <dyntape/autodiff/derive/sparsity.h>
#include <dyntape/autodiff/graph/callee.h>

namespace CppAD::inline dyntape_names::detail {

namespace {

// A copy of a function in which `results(graph, callee, arguments)` takes the place of every call.
template <class Results>
Function with_calls(const Function& function, Results&& results) {
  Function copy;
  copy.name = function.name;
  copy.inputs = function.inputs;
  const Graph& from = function.graph;
  std::vector<NodeId> image(from.size());
  std::map<NodeId, std::vector<NodeId>> of_calls;
  for (NodeId id = 0; id < from.size(); ++id) {
    const Node& node = from[id];
    std::vector<NodeId> arguments;
    from.for_each_argument(id, [&](NodeId a) { arguments.push_back(image[a]); });
    if (node.op == Op::Const) {
      image[id] = copy.graph.constant(from.constant_value(id));
    } else if (node.op == Op::Input) {
      image[id] = copy.graph.input(static_cast<Block>(node.a), node.b);
    } else if (node.op == Op::Call) {
      of_calls[id] = results(copy.graph, from.callees()[node.a], arguments);
    } else if (node.op == Op::Result) {
      image[id] = of_calls[node.a][node.b];
    } else {
      arguments.resize(3, kNoNode);
      image[id] = copy.graph.make(node.op, arguments[0], arguments[1], arguments[2]);
    }
  }
  for (NodeId output : function.outputs) copy.outputs.push_back(image[output]);
  for (const Guard& guard : function.guards)
    copy.guards.push_back({image[guard.condition], guard.expected, guard.file, guard.line});
  return copy;
}

Pattern full_pattern(std::size_t rows, std::size_t cols) {
  Pattern all{rows, cols, {}, {}};
  for (std::uint32_t i = 0; i < rows; ++i) {
    for (std::uint32_t j = 0; j < cols; ++j) all.row.push_back(i), all.col.push_back(j);
  }
  return all;
}

enum class Asked { kSlopes, kDependencies, kPairs };

// Polynomials with the patterns of a kernel in its place: sums of what a result depends on, and of the products of the pairs.  No two
// coefficients are equal, so that nothing cancels.
struct KernelStandIns {
  const Kernels& kernels;
  Asked asked;
  double coefficient = 1;

  std::vector<NodeId> operator()(Graph& graph, const std::shared_ptr<const Callee>& callee,
                                 const std::vector<NodeId>& arguments) {
    const auto found = kernels.find(callee.get());
    if (found == kernels.end()) return graph.call(callee, arguments);
    const KernelInSeries& kernel = *found->second;
    // Not zero: a result that depends on no variable may be a factor of one that does.
    std::vector<NodeId> sums(callee->n_out, graph.constant(coefficient += 0.37));
    const auto add = [&](std::size_t i, NodeId x) {
      sums[i] = graph.make(Op::Add, sums[i], graph.make(Op::Mul, graph.constant(coefficient += 0.37), x));
    };
    const Pattern first = pattern_of_kernel(*callee, kernel);
    for (std::size_t k = 0; k < first.nnz(); ++k) add(first.row[k], arguments[first.col[k]]);
    for (std::size_t i = 0; i < callee->n_out && asked == Asked::kPairs; ++i) {
      for (const auto& [j, k] : pairs_of(kernel, first, i))
        add(i, graph.make(Op::Mul, arguments[j], arguments[k]));
    }
    return sums;
  }

 private:
  Pattern pattern_of_kernel(const Callee& callee, const KernelInSeries& kernel) const {
    Pattern pattern;
    if (kernel.jacobian(asked == Asked::kDependencies, pattern)) return pattern;
    const bool all = callee.pattern.rows == 0 || asked == Asked::kDependencies;
    return all ? full_pattern(callee.n_out, callee.n_in) : callee.pattern;
  }
  static std::vector<std::pair<std::size_t, std::size_t>> pairs_of(const KernelInSeries& kernel,
                                                                   const Pattern& first, std::size_t i) {
    Pattern hessian;
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    if (kernel.hessian(i, hessian)) {
      for (std::size_t k = 0; k < hessian.nnz(); ++k) pairs.emplace_back(hessian.row[k], hessian.col[k]);
      return pairs;
    }
    const auto from = std::lower_bound(first.row.begin(), first.row.end(), i) - first.row.begin(),
               to = std::upper_bound(first.row.begin(), first.row.end(), i) - first.row.begin();
    for (auto j = from; j < to; ++j) {
      for (auto k = from; k < to; ++k) pairs.emplace_back(first.col[j], first.col[k]);
    }
    return pairs;
  }
};

// Passes the graph of a function, without kernels, and its first `range` outputs on.
template <class Use>
auto use_without_kernels(const Function& function, const Kernels& kernels, std::size_t range, Asked asked,
                         Use&& use) {
  const auto first = [range](const Function& f) {
    return std::vector<NodeId>(f.outputs.begin(), f.outputs.begin() + static_cast<std::ptrdiff_t>(range));
  };
  if (kernels.empty()) return use(function.graph, first(function));
  const Function without = with_calls(function, KernelStandIns{kernels, asked});
  return use(without.graph, first(without));
}

// 64 variables at a time, a bit each.
Pattern dependency_pattern(const Graph& graph, const std::vector<NodeId>& outputs, std::size_t n_x) {
  std::vector<std::vector<std::uint32_t>> rows(outputs.size());
  std::vector<std::uint64_t> bits(graph.size());
  for (std::size_t base = 0; base < n_x; base += 64) {
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
        if (bits[outputs[i]] >> k & 1) rows[i].push_back(static_cast<std::uint32_t>(base + k));
      }
    }
  }
  return pattern_from_rows(rows, n_x);
}

}  // namespace

Pattern first_order_pattern(const Function& function, std::size_t range, bool dependency,
                            const Kernels& kernels) {
  return use_without_kernels(function, kernels, range, dependency ? Asked::kDependencies : Asked::kSlopes,
                             [&](const Graph& graph, const std::vector<NodeId>& outputs) {
                               return dependency ? dependency_pattern(graph, outputs, function.n_x())
                                                 : jacobian_sparsity(graph, outputs, function.n_x());
                             });
}

Function with_patterns(const Function& function, const Kernels& kernels) {
  std::map<const Callee*, std::shared_ptr<const Callee>> told;
  Function copy = with_calls(function, [&](Graph& graph, const std::shared_ptr<const Callee>& callee,
                                           const std::vector<NodeId>& arguments) {
    std::shared_ptr<const Callee>& mine = told[callee.get()];
    if (!mine) {
      auto with_pattern = std::make_shared<Callee>(*callee);
      const auto found = kernels.find(callee.get());
      if (found != kernels.end()) found->second->jacobian(false, with_pattern->pattern);
      mine = with_pattern;
    }
    return graph.call(mine, arguments);
  });
  copy.input_names = function.input_names;
  copy.output_names = function.output_names;
  return copy;
}

Pattern second_order_pattern(const Function& function, std::size_t range, const std::vector<bool>& of_range,
                             const Kernels& kernels) {
  return use_without_kernels(function, kernels, range, Asked::kPairs,
                             [&](const Graph& graph, const std::vector<NodeId>& outputs) {
                               std::vector<NodeId> summed;
                               for (std::size_t i = 0; i < range; ++i) {
                                 if (of_range[i]) summed.push_back(outputs[i]);
                               }
                               return hessian_sparsity(graph, summed, function.n_x());
                             });
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

void check_groups(const char* what, const Entries& entries, std::size_t lines, const Colors& colors) {
  if (colors.color.size() != lines || colors.entries != entries.row.size())
    refuse(std::string(what) + ": work is of a call with other entries, expected work.clear() before it");
}

using Lines = std::vector<std::vector<std::size_t>>;

// The lowest color that no earlier call forbade for `line`.
class FreeColors {
 public:
  void forbid(std::size_t color, std::size_t line) {
    if (color != SIZE_MAX) taken_by_[color] = line;
  }
  std::size_t pick(std::size_t line) {
    std::size_t c = 0;
    while (c < taken_by_.size() && taken_by_[c] == line) ++c;
    if (c == taken_by_.size()) taken_by_.push_back(SIZE_MAX);
    return c;
  }
  std::size_t count() const { return taken_by_.size(); }

 private:
  std::vector<std::size_t> taken_by_;
};

void color_all(const Entries& entries, const Pattern& pattern, bool rows, Colors& colors) {
  const std::size_t n = rows ? pattern.rows : pattern.cols, across = rows ? pattern.cols : pattern.rows;
  Lines of_line(n), of_cross(across);
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    const std::size_t line = rows ? pattern.row[k] : pattern.col[k],
                      cross = rows ? pattern.col[k] : pattern.row[k];
    of_line[line].push_back(cross);
    of_cross[cross].push_back(line);
  }
  colors = {std::vector<std::size_t>(n, SIZE_MAX), {}, entries.row.size()};
  std::vector<bool> asked(n, false);
  for (std::size_t e = 0; e < entries.row.size(); ++e) asked[rows ? entries.row[e] : entries.col[e]] = true;
  FreeColors free;
  for (std::size_t line = 0; line < n; ++line) {
    if (!asked[line]) continue;
    for (std::size_t cross : of_line[line]) {
      for (std::size_t other : of_cross[cross]) free.forbid(colors.color[other], line);
    }
    colors.color[line] = free.pick(line);
  }
  colors.sources.resize(free.count());
  for (std::size_t e = 0; e < entries.row.size(); ++e) {
    const std::size_t row = entries.row[e], col = entries.col[e];
    if (is_in(pattern, row, col))
      colors.sources[colors.color[rows ? row : col]].push_back({e, rows ? col : row});
  }
}

// A greedy star coloring, columns with many entries first.  Entry (u, v) is read from the column of u or v that is colored first, at
// the other one's row: there no other column may have its color.
class StarColors {
 public:
  StarColors(const Pattern& pattern, std::size_t n) : near_(n), color_(n, SIZE_MAX), rank_(n, SIZE_MAX) {
    std::vector<std::size_t> on_diagonal(n, 0);
    for (std::size_t k = 0; k < pattern.nnz(); ++k) {
      if (pattern.row[k] == pattern.col[k]) {
        on_diagonal[pattern.row[k]] = 1;
        continue;
      }
      near_[pattern.row[k]].push_back(pattern.col[k]);
      near_[pattern.col[k]].push_back(pattern.row[k]);
    }
    for (auto& near : near_) {
      std::sort(near.begin(), near.end());
      near.erase(std::unique(near.begin(), near.end()), near.end());
    }
    std::vector<std::size_t> order(n);
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return near_[a].size() + on_diagonal[a] > near_[b].size() + on_diagonal[b];
    });
    for (std::size_t w : order) color(w);
  }
  std::size_t color_of(std::size_t column) const { return color_[column]; }
  bool is_first(std::size_t a, std::size_t b) const { return rank_[a] <= rank_[b]; }
  std::size_t count() const { return free_.count(); }

 private:
  void color(std::size_t w) {
    for (std::size_t v : near_[w]) {
      free_.forbid(color_[v], w);
      for (std::size_t u : near_[v]) {
        if (u != w && rank_[u] < rank_[v]) free_.forbid(color_[u], w);
      }
    }
    color_[w] = free_.pick(w);
    rank_[w] = next_rank_++;
  }

  Lines near_;  // by column: those that it shares an entry with
  std::vector<std::size_t> color_, rank_;
  std::size_t next_rank_ = 0;
  FreeColors free_;
};

}  // namespace

void color_lines(const char* what, const Entries& entries, const Pattern& pattern, std::size_t n_rows,
                 std::size_t n_cols, bool rows, Colors& colors) {
  if (!colors.empty()) return check_groups(what, entries, rows ? n_rows : n_cols, colors);
  check_pattern(what, pattern, n_rows, n_cols);
  color_all(entries, pattern, rows, colors);
}

void color_symmetric(const char* what, const Entries& entries, const Pattern& pattern, std::size_t n,
                     Colors& colors) {
  if (!colors.empty()) return check_groups(what, entries, n, colors);
  check_pattern(what, pattern, n, n);
  const StarColors star(pattern, n);
  colors = {std::vector<std::size_t>(n, SIZE_MAX), {}, entries.row.size()};
  std::vector<std::size_t> sweep(star.count(), SIZE_MAX);  // of a color of which some entry is read
  for (std::size_t e = 0; e < entries.row.size(); ++e) {
    const std::size_t row = entries.row[e], col = entries.col[e];
    if (!is_in(pattern, row, col) && !is_in(pattern, col, row)) continue;
    const std::size_t from = star.is_first(col, row) ? col : row;
    std::size_t& mine = sweep[star.color_of(from)];
    if (mine == SIZE_MAX) mine = colors.sources.size(), colors.sources.emplace_back();
    colors.color[from] = mine;
    colors.sources[mine].push_back({e, from == col ? row : col});
  }
  Colors general;
  color_all(entries, pattern, false, general);
  if (general.count() < colors.count()) colors = std::move(general);
}

}  // namespace CppAD::inline dyntape_names::detail
