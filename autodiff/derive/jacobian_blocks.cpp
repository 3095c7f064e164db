// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/derive/jacobian_blocks.h>

#include <algorithm>
#include <numeric>

#include <dyntape/autodiff/derive/sparsity.h>
#include <dyntape/autodiff/derive/sweep.h>
#include <dyntape/autodiff/graph/callee.h>

namespace dyntape {
namespace {

enum class Direction { kForward, kReverse };

// Entries of the pattern, by index, that are swept together.
struct BlockOfEntries {
  std::vector<std::size_t> entries;
  std::size_t rows = 0, cols = 0;
};

// More than this many blocks, or nodes times sweeps, are not tried both ways: the shorter side decides, unless it
// takes many steps.
constexpr std::size_t kMostTrials = 16;
constexpr double kMostTrialWork = 2e7;
constexpr std::size_t kManySteps = 20'000'000;

class Builder {
 public:
  Builder(Graph& graph, const std::vector<NodeId>& outputs, const Pattern& pattern)
      : graph_(graph), outputs_(outputs), pattern_(pattern), nodes_(pattern.nnz(), kNoNode) {}

  // False: `go_on`, which is asked after each row or column what it has given, said so.
  template <class GoOn>
  bool sweep(const BlockOfEntries& block, Direction direction, Sweep& sweep, GoOn&& go_on) {
    std::vector<std::size_t> entries = block.entries;
    const auto& key = direction == Direction::kForward ? pattern_.col : pattern_.row;
    std::stable_sort(entries.begin(), entries.end(),
                     [&](std::size_t a, std::size_t b) { return key[a] < key[b]; });
    for (std::size_t first = 0, last; first < entries.size(); first = last) {
      last = first;
      while (last < entries.size() && key[entries[last]] == key[entries[first]]) ++last;
      const std::vector<std::size_t> line(entries.begin() + static_cast<std::ptrdiff_t>(first),
                                          entries.begin() + static_cast<std::ptrdiff_t>(last));
      direction == Direction::kForward ? column(line, sweep) : row(line, sweep);
      found_.clear();
      for (std::size_t k : line) found_.push_back(nodes_[k]);
      if (!go_on(found_)) return false;
    }
    return true;
  }

  const std::vector<NodeId>& nodes() const { return nodes_; }

 private:
  void column(const std::vector<std::size_t>& entries, Sweep& sweep) {
    std::vector<NodeId> roots;
    for (std::size_t k : entries) roots.push_back(outputs_[pattern_.row[k]]);
    const std::vector<NodeId> tangents = sweep.forward(roots, pattern_.col[entries[0]]);
    for (std::size_t i = 0; i < entries.size(); ++i) nodes_[entries[i]] = tangents[i];
  }

  void row(const std::vector<std::size_t>& entries, Sweep& sweep) {
    const NodeId one = graph_.constant(1);
    const auto adjoints = sweep.reverse({outputs_[pattern_.row[entries[0]]]}, {one});
    for (std::size_t k : entries) {
      const auto it =
          std::lower_bound(adjoints.begin(), adjoints.end(), std::pair{pattern_.col[k], NodeId(0)});
      if (it != adjoints.end() && it->first == pattern_.col[k]) nodes_[k] = it->second;
    }
  }

  Graph& graph_;
  const std::vector<NodeId>& outputs_;
  const Pattern& pattern_;
  std::vector<NodeId> nodes_, found_;
};

// Numbers 0, 1, ... for the rows or the columns of some entries.
std::vector<std::size_t> numbered(const std::vector<std::uint32_t>& lines,
                                  const std::vector<std::size_t>& entries) {
  std::vector<std::uint32_t> sorted;
  for (std::size_t k : entries) sorted.push_back(lines[k]);
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  std::vector<std::size_t> numbers;
  for (std::size_t k : entries)
    numbers.push_back(
        static_cast<std::size_t>(std::lower_bound(sorted.begin(), sorted.end(), lines[k]) - sorted.begin()));
  return numbers;
}

// Connected components of the bipartite graph of rows and columns, over a subset of the entries.
std::vector<BlockOfEntries> components(const Pattern& pattern, const std::vector<std::size_t>& entries) {
  if (entries.empty()) return {};
  const std::vector<std::size_t> row = numbered(pattern.row, entries), col = numbered(pattern.col, entries);
  const std::size_t rows = *std::max_element(row.begin(), row.end()) + 1;
  std::vector<std::size_t> parent(rows + *std::max_element(col.begin(), col.end()) + 1);
  std::iota(parent.begin(), parent.end(), std::size_t(0));
  const auto find = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (std::size_t i = 0; i < entries.size(); ++i) parent[find(row[i])] = find(rows + col[i]);
  std::vector<std::size_t> number(parent.size(), SIZE_MAX);
  std::vector<bool> counted(parent.size(), false);
  std::vector<BlockOfEntries> blocks;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const std::size_t root = find(row[i]);
    if (number[root] == SIZE_MAX) number[root] = blocks.size(), blocks.emplace_back();
    BlockOfEntries& block = blocks[number[root]];
    block.entries.push_back(entries[i]);
    if (!counted[row[i]]) counted[row[i]] = true, ++block.rows;
    if (!counted[rows + col[i]]) counted[rows + col[i]] = true, ++block.cols;
  }
  return blocks;
}

// Operations that nodes need beyond the first `before` nodes of the graph, each counted once.
class AddedOperations {
 public:
  AddedOperations(const Graph& graph, NodeId before) : graph_(graph), before_(before) {}

  void add(const std::vector<NodeId>& nodes) {
    seen_.resize(graph_.size() - before_, 0);
    for (NodeId id : nodes) push(id);
    while (!stack_.empty()) {
      const NodeId id = stack_.back();
      stack_.pop_back();
      graph_.for_each_argument(id, [&](NodeId a) { push(a); });
    }
  }
  std::size_t count() const { return count_; }

 private:
  void push(NodeId id) {
    if (id == kNoNode || id < before_ || seen_[id - before_]) return;
    seen_[id - before_] = 1;
    ++count_;
    stack_.push_back(id);
  }

  const Graph& graph_;
  const NodeId before_;
  std::size_t count_ = 0;
  std::vector<std::uint8_t> seen_;
  std::vector<NodeId> stack_;
};

struct Plan {
  std::vector<std::pair<BlockOfEntries, Direction>> parts;
};

// The rows of a part, each once: entries are sorted by row.
std::vector<NodeId> roots_of(const BlockOfEntries& block, const std::vector<NodeId>& outputs,
                             const Pattern& pattern) {
  std::vector<NodeId> roots;
  for (std::size_t i = 0; i < block.entries.size(); ++i) {
    const std::uint32_t row = pattern.row[block.entries[i]];
    if (i == 0 || row != pattern.row[block.entries[i - 1]]) roots.push_back(outputs[row]);
  }
  return roots;
}

// Runs plans, as long as `go_on` says so.  What is swept forward shares no variable with what else is: one watch serves
// all.
template <class GoOn>
bool sweep(const std::vector<Plan>& plans, const std::vector<NodeId>& outputs, const Pattern& pattern,
           Sweep& sweep, Builder& builder, GoOn&& go_on) {
  for (const Plan& plan : plans) {
    for (const auto& [block, direction] : plan.parts) {
      if (direction == Direction::kReverse) continue;
      for (NodeId root : roots_of(block, outputs, pattern)) sweep.watch(root);
    }
  }
  for (const Plan& plan : plans) {
    for (const auto& [block, direction] : plan.parts) {
      if (!builder.sweep(block, direction, sweep, go_on)) return false;
    }
  }
  return true;
}

using Callees = std::vector<std::shared_ptr<const Callee>>;

// What a plan makes of a graph.
struct Trial {
  Graph graph;
  std::vector<NodeId> nodes;  // by entry
  std::size_t cost = SIZE_MAX;
};

// Tries a plan, up to a cost that is too much.  `met` keeps the derivatives of callees that a trial has made, for the
// next one.
Trial tried(const Graph& graph, const std::vector<NodeId>& outputs, const Pattern& pattern, const Plan& plan,
            std::size_t too_much, Callees& met) {
  Trial trial{graph, {}};
  Sweep sweep(trial.graph);
  Builder builder(trial.graph, outputs, pattern);
  AddedOperations added(trial.graph, static_cast<NodeId>(graph.size()));
  const auto is_worth_it = [&](const std::vector<NodeId>& found) {
    added.add(found);
    return added.count() < too_much;
  };
  if (dyntape::sweep({plan}, outputs, pattern, sweep, builder, is_worth_it)) {
    trial.nodes = builder.nodes();
    trial.cost = added.count();
  }
  met.insert(met.end(), trial.graph.callees().begin(), trial.graph.callees().end());
  return trial;
}

Direction shorter_side(const BlockOfEntries& block) {
  return block.rows < block.cols ? Direction::kReverse : Direction::kForward;
}

// Rows much longer than the typical one, in reverse; the rest forward, where it may fall apart.
Plan long_rows_apart(const Pattern& pattern, const BlockOfEntries& block) {
  std::vector<std::size_t> begins;  // of the rows, among the entries
  for (std::size_t i = 0; i < block.entries.size(); ++i) {
    if (i == 0 || pattern.row[block.entries[i]] != pattern.row[block.entries[i - 1]]) begins.push_back(i);
  }
  begins.push_back(block.entries.size());
  std::vector<std::size_t> lengths;
  for (std::size_t i = 0; i + 1 < begins.size(); ++i) lengths.push_back(begins[i + 1] - begins[i]);
  std::nth_element(lengths.begin(), lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2),
                   lengths.end());
  const std::size_t limit = 4 * lengths[lengths.size() / 2] + 4;
  BlockOfEntries rows;
  std::vector<std::size_t> rest;
  for (std::size_t i = 0; i + 1 < begins.size(); ++i) {
    std::vector<std::size_t>& entries = begins[i + 1] - begins[i] > limit ? rows.entries : rest;
    for (std::size_t k = begins[i]; k < begins[i + 1]; ++k) entries.push_back(block.entries[k]);
  }
  Plan plan;
  if (rows.entries.empty()) return plan;
  plan.parts.emplace_back(rows, Direction::kReverse);
  for (BlockOfEntries& part : components(pattern, rest)) plan.parts.emplace_back(part, shorter_side(part));
  return plan;
}

// Counts the nodes that sweeps visit, up to `most`.
class Steps {
 public:
  Steps(Sweep& sweep, const std::vector<NodeId>& outputs, const Pattern& pattern)
      : sweep_(sweep), outputs_(outputs), pattern_(pattern) {}

  std::size_t of(const Plan& plan, std::size_t most) {
    std::size_t steps = 0;
    for (const auto& [block, direction] : plan.parts)
      steps += direction == Direction::kForward ? forward(block, most - steps) : reverse(block, most - steps);
    return steps;
  }

 private:
  std::size_t forward(const BlockOfEntries& block, std::size_t most) {
    const std::vector<NodeId> roots = roots_of(block, outputs_, pattern_);
    std::vector<std::uint32_t> variables;
    for (std::size_t k : block.entries) variables.push_back(pattern_.col[k]);
    std::sort(variables.begin(), variables.end());
    variables.erase(std::unique(variables.begin(), variables.end()), variables.end());
    std::size_t steps = 0;
    for (NodeId root : roots) sweep_.watch(root);
    for (std::uint32_t j : variables) steps += sweep_.count_forward(j, most - steps);
    for (NodeId root : roots) sweep_.unwatch(root);
    return steps;
  }

  std::size_t reverse(const BlockOfEntries& block, std::size_t most) {
    std::size_t steps = 0;
    for (NodeId root : roots_of(block, outputs_, pattern_)) steps += sweep_.count_reverse(root, most - steps);
    return steps;
  }

  Sweep& sweep_;
  const std::vector<NodeId>& outputs_;
  const Pattern& pattern_;
};

// The shorter side, or a plan that takes far fewer steps where it takes more than `most`.
Plan fewest_steps(const Pattern& pattern, const BlockOfEntries& block, std::size_t most, Steps& steps) {
  const bool is_reverse = shorter_side(block) == Direction::kReverse;
  std::vector<Plan> candidates = {{{{block, shorter_side(block)}}},
                                  {{{block, is_reverse ? Direction::kForward : Direction::kReverse}}}};
  if (Plan mixed = long_rows_apart(pattern, block); !mixed.parts.empty()) {
    candidates.push_back(mixed);
    for (std::size_t i = 1; i < mixed.parts.size(); ++i) mixed.parts[i].second = Direction::kForward;
    candidates.push_back(std::move(mixed));
  }
  for (;; most *= 4) {
    for (Plan& candidate : candidates) {
      if (steps.of(candidate, most) < most) return std::move(candidate);
    }
  }
}

// And what came of trying the plan, if it was tried.
struct Choice {
  Plan plan;
  Trial trial;
};

Choice cheapest(const Graph& graph, const std::vector<NodeId>& outputs, const Pattern& pattern,
                const BlockOfEntries& block, std::size_t blocks, Steps& steps, Callees& met) {
  Choice best{{{{block, shorter_side(block)}}}, {}};
  if (block.rows == 1 || block.cols == 1) return best;
  std::vector<Plan> candidates;
  const auto nodes = static_cast<double>(graph.size());
  const bool may_try = blocks <= kMostTrials;
  if (may_try && nodes * static_cast<double>(block.cols) < kMostTrialWork)
    candidates.push_back({{{block, Direction::kForward}}});
  if (may_try && nodes * static_cast<double>(block.rows) < kMostTrialWork)
    candidates.push_back({{{block, Direction::kReverse}}});
  if (candidates.empty()) return {fewest_steps(pattern, block, kManySteps / blocks + 1, steps), {}};
  if (candidates.size() == 1) return {std::move(candidates[0]), {}};
  if (Plan mixed = long_rows_apart(pattern, block); !mixed.parts.empty())
    candidates.push_back(std::move(mixed));
  // What is likely to be cheaper comes first: the others are given up as soon as they cost more.  Where several cost
  // the same, it is the first candidate of all.
  std::vector<std::size_t> order(candidates.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  if (shorter_side(block) == Direction::kReverse) std::swap(order[0], order[1]);
  std::size_t chosen = candidates.size();
  for (std::size_t i : order) {
    const std::size_t too_much = best.trial.cost == SIZE_MAX ? SIZE_MAX : best.trial.cost + (i < chosen);
    Trial trial = tried(graph, outputs, pattern, candidates[i], too_much, met);
    if (trial.cost >= too_much) continue;
    best.trial = std::move(trial);
    chosen = i;
  }
  best.plan = std::move(candidates[chosen]);
  return best;
}

}  // namespace

std::vector<NodeId> append_jacobian(Function& function, Pattern& pattern) {
  pattern = jacobian_sparsity(function);
  std::vector<std::size_t> all(pattern.nnz());
  std::iota(all.begin(), all.end(), std::size_t(0));
  const std::vector<BlockOfEntries> blocks = components(pattern, all);
  const std::vector<NodeId> outputs = function.outputs;
  std::vector<Plan> plans;
  Callees met;
  Sweep sweep(function.graph);
  Steps steps(sweep, outputs, pattern);
  std::vector<NodeId> found;  // by entry
  for (const BlockOfEntries& block : blocks) {
    Choice choice = cheapest(function.graph, outputs, pattern, block, blocks.size(), steps, met);
    plans.push_back(std::move(choice.plan));
    if (blocks.size() > 1 || choice.trial.cost == SIZE_MAX) continue;
    function.graph = std::move(choice.trial.graph);  // what the plan would make once more
    found = std::move(choice.trial.nodes);
  }
  if (found.empty()) {
    Builder builder(function.graph, outputs, pattern);
    dyntape::sweep(plans, outputs, pattern, sweep, builder, [](const auto&) { return true; });
    found = builder.nodes();
  }
  // An entry that came out as a structural zero leaves the pattern.
  Pattern kept{pattern.rows, pattern.cols, {}, {}};
  std::vector<NodeId> nodes;
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    const NodeId id = found[k];
    if (id == kNoNode || function.graph.is_constant(id, 0)) continue;
    kept.row.push_back(pattern.row[k]);
    kept.col.push_back(pattern.col[k]);
    nodes.push_back(id);
  }
  pattern = std::move(kept);
  return nodes;
}

}  // namespace dyntape
