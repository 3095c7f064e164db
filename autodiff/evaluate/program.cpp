// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/evaluate/program.h>

#include <algorithm>
#include <array>
#include <span>

#include <dyntape/autodiff/graph/callee.h>

namespace dyntape::detail {
namespace {

// Longer windows make longer runs and keep more values alive.
constexpr std::size_t kWindow = 512;

// The order within a window: one kind of operation as long as there is one whose arguments are there.
class Window {
 public:
  explicit Window(const Graph& graph) : graph_(graph), place_(graph.size(), kOutside) {}

  // The nodes in their new order, in place.
  void order(std::vector<NodeId>& nodes) {
    const auto n = static_cast<std::uint32_t>(nodes.size());
    for (std::uint32_t i = 0; i < n; ++i) place_[nodes[i]] = i;
    link(nodes);
    for (auto& list : ready_) list.clear();
    for (std::uint32_t i = 0; i < n; ++i) {
      if (waiting_[i] == 0) ready_[kind(nodes[i])].push_back(i);
    }
    ordered_.clear();
    while (ordered_.size() < n) take_all_of(most_ready(), nodes);
    for (NodeId id : nodes) place_[id] = kOutside;
    nodes.swap(ordered_);
  }

 private:
  static constexpr std::uint32_t kOutside = 0xffffffffu;
  using Ready = std::array<std::vector<std::uint32_t>, kTableOps + 1>;

  // Calls are a kind of their own, after those of the table.
  std::size_t kind(NodeId id) const {
    return std::min(static_cast<std::size_t>(graph_[id].op), static_cast<std::size_t>(kTableOps));
  }

  // Visits the nodes of this window that must come before `id`.
  template <class Visit>
  void for_each_before(NodeId id, Visit&& visit) const {
    graph_.for_each_argument(id, [&](NodeId a) {
      const std::uint32_t p = place_[graph_[a].op == Op::Result ? graph_[a].a : a];
      if (p != kOutside) visit(p);
    });
  }

  // Who waits for whom: the users of place p are users_[first_[p]] to users_[first_[p + 1]].
  void link(const std::vector<NodeId>& nodes) {
    const auto n = static_cast<std::uint32_t>(nodes.size());
    waiting_.assign(n, 0);
    first_.assign(n + 2, 0);
    for (std::uint32_t i = 0; i < n; ++i)
      for_each_before(nodes[i], [&](std::uint32_t p) {
        ++waiting_[i];
        ++first_[p + 2];
      });
    for (std::uint32_t p = 2; p < n + 2; ++p) first_[p] += first_[p - 1];
    users_.resize(first_[n + 1]);
    for (std::uint32_t i = 0; i < n; ++i)
      for_each_before(nodes[i], [&](std::uint32_t p) { users_[first_[p + 1]++] = i; });
  }

  std::size_t most_ready() const {
    const auto longest = std::max_element(ready_.begin(), ready_.end(),
                                          [](const auto& a, const auto& b) { return a.size() < b.size(); });
    return static_cast<std::size_t>(longest - ready_.begin());
  }

  void take_all_of(std::size_t kind_taken, const std::vector<NodeId>& nodes) {
    std::vector<std::uint32_t>& list = ready_[kind_taken];
    for (std::size_t k = 0; k < list.size(); ++k) {  // it grows on the way
      const std::uint32_t i = list[k];
      ordered_.push_back(nodes[i]);
      for (std::uint32_t u = first_[i]; u < first_[i + 1]; ++u) {
        if (--waiting_[users_[u]] == 0) ready_[kind(nodes[users_[u]])].push_back(users_[u]);
      }
    }
    list.clear();
  }

  const Graph& graph_;
  std::vector<std::uint32_t> place_;  // within the window
  std::vector<std::uint32_t> waiting_, first_, users_;
  Ready ready_;
  std::vector<NodeId> ordered_;
};

}  // namespace

// Fills a program: order, then slots.
class ProgramLayout {
 public:
  ProgramLayout(const Function& function, Program& program)
      : function_(function),
        graph_(function.graph),
        program_(program),
        uses_(graph_.size(), 0),
        slot_(graph_.size(), Program::kNoSlot) {
    program_.callees_ = graph_.callees();
    for (const Guard& guard : function.guards) program_.expected_.push_back(guard.expected);
  }

  void run() {
    count_uses();
    place_constants();
    find_results();
    load_inputs();
    Window window(graph_);
    std::vector<NodeId> nodes;
    for (NodeId id = 0; id < graph_.size(); ++id) {
      const Op op = graph_[id].op;
      if (!is_needed(id) || op == Op::Const || op == Op::Input || op == Op::Result) continue;
      nodes.push_back(id);
      if (nodes.size() == kWindow) lay_out(window, nodes);
    }
    lay_out(window, nodes);
    program_.slots_ = next_;
  }

 private:
  using Kind = Program::Kind;
  using Word = Program::Word;

  // A call is needed where one of its results is.
  bool is_needed(NodeId id) const { return uses_[id] > 0; }

  void count_uses() {
    for (NodeId id : function_.outputs) ++uses_[id];
    for (const Guard& guard : function_.guards) ++uses_[guard.condition];
    for (auto id = static_cast<NodeId>(graph_.size()); id-- > 0;) {
      if (is_needed(id)) graph_.for_each_argument(id, [&](NodeId a) { ++uses_[a]; });
    }
    // Which outputs and guards a node is: the chains of those that are the same node.
    chain(
        function_.outputs.size(), [&](std::size_t i) { return function_.outputs[i]; }, outputs_of_);
    chain(
        function_.guards.size(), [&](std::size_t i) { return function_.guards[i].condition; }, guards_of_);
  }

  struct Chains {
    std::vector<std::uint32_t> first, next;  // by node, by output
  };
  template <class NodeOf>
  void chain(std::size_t n, NodeOf node_of, Chains& chains) {
    if (n == 0) return;
    chains.first.assign(graph_.size(), kEnd);
    chains.next.assign(n, kEnd);
    for (std::size_t i = n; i-- > 0;) {
      chains.next[i] = chains.first[node_of(i)];
      chains.first[node_of(i)] = static_cast<std::uint32_t>(i);
    }
  }

  void place_constants() {
    for (NodeId id = 0; id < graph_.size(); ++id) {
      if (graph_[id].op != Op::Const || !is_needed(id)) continue;
      slot_[id] = next_++;
      program_.constants_.push_back(graph_.constant_value(id));
      store(id);
    }
  }

  void find_results() {
    for (NodeId id = 0; id < graph_.size(); ++id) {
      if (graph_[id].op != Op::Result || !is_needed(id)) continue;
      const std::size_t number = graph_[graph_[id].a].c;
      results_.resize(std::max(results_.size(), number + 1));
      results_[number].push_back(id);
    }
  }

  // All inputs before anything is stored: an output may lie where an input was.
  void load_inputs() {
    for (NodeId id = 0; id < graph_.size(); ++id) {
      const Node& node = graph_[id];
      if (node.op != Op::Input || !is_needed(id)) continue;
      slot_[id] = next_++;
      add(Kind::kLoad, Op::Input, std::array{slot_[id], node.a, node.b});
      store(id);
    }
    flush();
  }

  void lay_out(Window& window, std::vector<NodeId>& nodes) {
    window.order(nodes);
    for (NodeId id : nodes) graph_[id].op == Op::Call ? call(id) : compute(id);
    flush();
    nodes.clear();
  }

  void compute(NodeId id) {
    const Node& node = graph_[id];
    const int arity = info(node.op).arity;
    Word words[4] = {};
    for (int i = 0; i < arity; ++i) words[i + 1] = slot_[node.argument(i)];
    for (int i = 0; i < arity; ++i) release(node.argument(i));  // the result may take an argument's place
    words[0] = slot_[id] = free_slot();
    add(Kind::kCompute, node.op, std::span(words, static_cast<std::size_t>(arity) + 1));
    store(id);
  }

  void call(NodeId id) {
    const Node& node = graph_[id];
    const Callee& callee = *graph_.callees()[node.a];
    std::vector<Word> words = {node.a};
    graph_.for_each_argument(id, [&](NodeId a) { words.push_back(slot_[a]); });
    words.resize(words.size() + callee.n_out, Program::kNoSlot);
    graph_.for_each_argument(id, [&](NodeId a) { release(a); });
    for (NodeId result : results_[node.c])
      words[1 + callee.n_in + graph_[result].b] = slot_[result] = free_slot();
    add(Kind::kCall, Op::Call, words);
    for (NodeId result : results_[node.c]) store(result);
  }

  // Outputs and guards that are this node are served at the end of the window.
  void store(NodeId id) {
    const bool is_output = !outputs_of_.first.empty() && outputs_of_.first[id] != kEnd;
    const bool is_guard = !guards_of_.first.empty() && guards_of_.first[id] != kEnd;
    if (is_output || is_guard) pending_.push_back(id);
  }

  void flush() {
    flush_kind(Kind::kStore, outputs_of_);
    flush_kind(Kind::kCheck, guards_of_);
    pending_.clear();
  }
  void flush_kind(Kind kind, const Chains& chains) {
    if (chains.first.empty()) return;
    for (NodeId id : pending_) {
      for (std::uint32_t i = chains.first[id]; i != kEnd; i = chains.next[i]) {
        add(kind, Op::Result, std::array{i, slot_[id]});
        release(id);
      }
    }
  }

  Word free_slot() {
    if (free_.empty()) return next_++;
    const Word slot = free_.back();
    free_.pop_back();
    return slot;
  }
  void release(NodeId id) {
    if (--uses_[id] == 0 && graph_[id].op != Op::Const) free_.push_back(slot_[id]);
  }

  void add(Kind kind, Op op, std::span<const Word> words) {
    auto& runs = program_.runs_;
    if (runs.empty() || runs.back().kind != kind || runs.back().op != op) runs.push_back({kind, op, 0});
    ++runs.back().count;
    program_.code_.insert(program_.code_.end(), words.begin(), words.end());
  }

  static constexpr std::uint32_t kEnd = 0xffffffffu;

  const Function& function_;
  const Graph& graph_;
  Program& program_;
  std::vector<std::uint32_t> uses_;  // that are still to come
  std::vector<Word> slot_, free_;
  Word next_ = 0;
  Chains outputs_of_, guards_of_;
  std::vector<NodeId> pending_;               // to be stored or checked
  std::vector<std::vector<NodeId>> results_;  // that are needed of call number i
};

Program::Program(const Function& function) { ProgramLayout(function, *this).run(); }

}  // namespace dyntape::detail
