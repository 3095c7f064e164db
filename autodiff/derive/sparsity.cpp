// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/derive/sparsity.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <span>

#include <dyntape/autodiff/derive/expr.h>
#include <dyntape/autodiff/graph/callee.h>

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

// The variables that each node depends on, where they are few.  Nodes with the variables of an argument share its
// list: what is common to many outputs is walked once.
class FewVariables {
 public:
  explicit FewVariables(const Graph& graph) : list_(graph.size(), kMany), entries_{0} {
    for (NodeId id = 0; id < graph.size(); ++id) {
      const Node& node = graph[id];
      list_[id] = kNone;
      if (node.op == Op::Input) {
        if (node.a == static_cast<NodeId>(Block::kVariables)) list_[id] = append({&node.b, 1});
      } else {
        for_each_slope(graph, id, [&](NodeId a) { list_[id] = joined(list_[id], list_[a]); });
      }
    }
  }

  bool knows(NodeId id) const { return list_[id] != kMany; }
  std::span<const std::uint32_t> of(NodeId id) const { return entries(list_[id]); }

 private:
  static constexpr std::size_t kFew = 16;
  static constexpr std::size_t kNone = 0, kMany = static_cast<std::size_t>(-1);

  // A list is its length and its entries.
  std::span<const std::uint32_t> entries(std::size_t list) const {
    return {entries_.data() + list + 1, entries_[list]};
  }
  std::size_t append(std::span<const std::uint32_t> entries) {
    const std::size_t list = entries_.size();
    entries_.push_back(static_cast<std::uint32_t>(entries.size()));
    entries_.insert(entries_.end(), entries.begin(), entries.end());
    return list;
  }
  std::size_t joined(std::size_t a, std::size_t b) {
    if (a == kMany || b == kMany) return kMany;
    if (a == b || b == kNone) return a;
    if (a == kNone) return b;
    std::array<std::uint32_t, 2 * kFew> both;
    const auto of_a = entries(a), of_b = entries(b);
    const auto* end = std::set_union(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(), both.data());
    const auto size = static_cast<std::size_t>(end - both.data());
    if (size == of_a.size()) return a;
    if (size == of_b.size()) return b;
    return size > kFew ? kMany : append({both.data(), size});
  }

  std::vector<std::size_t> list_;  // by node: where it begins
  std::vector<std::uint32_t> entries_;
};

// Walks down from outputs to the variables.  A node with many variables where a second walk comes by remembers them,
// for the third.
class Walks {
 public:
  // Gives up after `budget` steps.
  Walks(const Graph& graph, std::size_t n_x, std::size_t budget)
      : graph_(graph),
        few_(graph),
        budget_(budget),
        may_remember_(16 * graph.size()),
        walked_(graph.size(), 0),
        walk_of_(graph.size(), 0),
        walk_of_variable_(n_x, 0),
        remembered_(graph.size(), kNothing) {}

  // False: too many steps.
  bool run(const std::vector<NodeId>& outputs, Rows& rows) {
    std::vector<std::size_t> order(outputs.size());  // what earlier ones remember is within later ones
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return outputs[a] < outputs[b]; });
    for (std::size_t i : order) {
      meet_again(outputs[i]);
      rows[i] = variables_of(outputs[i]);
      if (budget_ == 0) return false;
    }
    return true;
  }

 private:
  static constexpr std::uint32_t kNothing = 0xffffffffu;

  // Sorted.
  std::vector<std::uint32_t> variables_of(NodeId root) {
    ++walk_;
    std::vector<std::uint32_t> variables;
    std::vector<NodeId> stack = {root};
    while (!stack.empty() && budget_ > 0) {
      const NodeId id = stack.back();
      stack.pop_back();
      spend(1);
      walked_[id] = 1;
      if (few_.knows(id)) {
        add(few_.of(id), variables);
      } else if (remembered_[id] != kNothing) {
        add(memory_[remembered_[id]], variables);
      } else {
        for_each_slope(graph_, id, [&](NodeId a) {
          if (walk_of_[a] != walk_) walk_of_[a] = walk_, stack.push_back(a);
        });
      }
    }
    std::sort(variables.begin(), variables.end());
    return variables;
  }

  void add(std::span<const std::uint32_t> some, std::vector<std::uint32_t>& variables) {
    spend(some.size());
    for (std::uint32_t j : some) {
      if (walk_of_variable_[j] != walk_) walk_of_variable_[j] = walk_, variables.push_back(j);
    }
  }

  // Remembers the variables of nodes below an output that other walks have met, where this one's would enter.
  void meet_again(NodeId root) {
    ++walk_;
    std::vector<NodeId> stack = {root}, entered;
    while (!stack.empty() && budget_ > 0) {
      const NodeId id = stack.back();
      stack.pop_back();
      spend(1);
      if (few_.knows(id) || remembered_[id] != kNothing) continue;
      if (walked_[id]) {
        entered.push_back(id);
      } else {
        for_each_slope(graph_, id, [&](NodeId a) {
          if (walk_of_[a] != walk_) walk_of_[a] = walk_, stack.push_back(a);
        });
      }
    }
    std::sort(entered.begin(), entered.end());
    for (NodeId id : entered) remember(id);
  }

  void remember(NodeId id) {
    if (may_remember_ == 0) return;
    std::vector<std::uint32_t> variables = variables_of(id);
    may_remember_ -= std::min(may_remember_, variables.size());
    remembered_[id] = static_cast<std::uint32_t>(memory_.size());
    memory_.push_back(std::move(variables));
  }

  void spend(std::size_t steps) { budget_ -= std::min(budget_, steps); }

  const Graph& graph_;
  const FewVariables few_;
  std::size_t budget_, may_remember_;  // steps; entries
  std::uint32_t walk_ = 0;             // the number of this one
  std::vector<std::uint8_t> walked_;   // by any
  std::vector<std::uint32_t> walk_of_, walk_of_variable_, remembered_;
  std::vector<std::vector<std::uint32_t>> memory_;
};

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

bool is_variable(const Node& node) {
  return node.op == Op::Input && node.a == static_cast<NodeId>(Block::kVariables);
}

// Bit j of [i]: whether the slope of the operator in argument i depends on argument j.
using SlopeArguments = std::array<unsigned, 3>;

SlopeArguments slope_arguments(Op op) {
  Graph graph;
  const GraphScope scope(graph);
  const auto argument = [&](std::uint32_t i) { return Expr(graph.input(Block::kVariables, i)); };
  const Expr x = argument(0), y = argument(1), z = argument(2), v(graph.input(Block::kParameters, 0));
  const int n = info(op).arity;
  const Expr r(graph.make(op, x.id, n > 1 ? y.id : kNoNode, n > 2 ? z.id : kNoNode));
  SlopeArguments depends{};
  for (int i = 0; i < n; ++i) {
    const Expr s = slope<Expr>(op, i, x, y, z, r, v);
    if (!s.exists()) continue;
    for (std::uint32_t j : jacobian_sparsity(graph, {s.id}, 3).col)
      depends[static_cast<std::size_t>(i)] |= 1u << j;
  }
  return depends;
}

const SlopeArguments& known_slope_arguments(Op op) {
  static const auto table = [] {
    std::array<SlopeArguments, std::size(ops::kDerivatives)> rows{};
    for (std::size_t row = 0; row < rows.size(); ++row) rows[row] = slope_arguments(static_cast<Op>(row));
    return rows;
  }();
  return table[static_cast<std::size_t>(op)];
}

// For 64 variables a bit each: which of them a node depends on by slopes, and which its adjoint depends on.
class HessianBits {
 public:
  HessianBits(const Graph& graph, const std::vector<NodeId>& outputs)
      : graph_(graph), is_live_(graph.size(), 0), values_(graph.size()), adjoints_(graph.size()) {
    for (NodeId id : outputs) is_live_[id] = 1;
    for (auto id = static_cast<NodeId>(graph.size()); id-- > 0;) {
      if (is_live_[id]) for_each_slope(graph, id, [&](NodeId a) { is_live_[a] = 1; });
    }
  }

  // Appends the columns base ... base + 63 to the rows.
  void run(std::size_t base, Rows& rows) {
    for (NodeId id = 0; id < graph_.size(); ++id) {
      const Node& node = graph_[id];
      std::uint64_t b = 0;
      if (node.op == Op::Input) {
        if (is_variable(node) && node.b - base < 64) b = std::uint64_t(1) << (node.b - base);
      } else if (is_live_[id]) {
        for_each_slope(graph_, id, [&](NodeId a) { b |= values_[a]; });
      }
      values_[id] = b;
      adjoints_[id] = 0;
    }
    for (auto id = static_cast<NodeId>(graph_.size()); id-- > 0;) {
      if (!is_live_[id]) continue;
      const Node& node = graph_[id];
      if (is_variable(node)) {
        append(adjoints_[id], base, rows[node.b]);
      } else if (node.op == Op::Result) {
        for_each_slope(graph_, id, [&](NodeId a) { adjoints_[a] |= adjoints_[id] | values_[id]; });
      } else if (node.op != Op::Input && node.op != Op::Const && node.op != Op::Call) {
        pass_down(id, node);
      }
    }
  }

 private:
  void pass_down(NodeId id, const Node& node) {
    const SlopeArguments& depends = known_slope_arguments(node.op);
    const int n = info(node.op).arity;
    for (int i = 0; i < n; ++i) {
      if (!has_slope(node.op, i)) continue;
      std::uint64_t b = adjoints_[id];
      for (int j = 0; j < n; ++j) {
        if (depends[static_cast<std::size_t>(i)] >> j & 1) b |= values_[node.argument(j)];
      }
      adjoints_[node.argument(i)] |= b;
    }
  }
  static void append(std::uint64_t bits, std::size_t base, std::vector<std::uint32_t>& row) {
    for (; bits; bits &= bits - 1)
      row.push_back(static_cast<std::uint32_t>(base + static_cast<std::size_t>(__builtin_ctzll(bits))));
  }

  const Graph& graph_;
  std::vector<std::uint8_t> is_live_;
  std::vector<std::uint64_t> values_, adjoints_;
};

}  // namespace

Pattern hessian_sparsity(const Graph& graph, const std::vector<NodeId>& outputs, std::size_t n_x) {
  Rows rows(n_x);
  HessianBits bits(graph, outputs);
  for (std::size_t base = 0; base < n_x; base += 64) bits.run(base, rows);
  return pattern_from_rows(rows, n_x);
}

Pattern jacobian_sparsity(const Graph& graph, const std::vector<NodeId>& outputs, std::size_t n_x) {
  constexpr std::size_t kFewSweeps = 4;
  Rows rows(outputs.size());
  const std::size_t sweeps = (n_x + 63) / 64;
  if (sweeps <= kFewSweeps || !Walks(graph, n_x, 1000 + 4 * graph.size() * (1 + sweeps)).run(outputs, rows)) {
    rows.assign(outputs.size(), {});
    sweep_up(graph, outputs, n_x, rows);
  }
  return pattern_from_rows(rows, n_x);
}

Pattern jacobian_sparsity(const Function& function) {
  return jacobian_sparsity(function.graph, function.outputs, function.n_x());
}

}  // namespace dyntape
