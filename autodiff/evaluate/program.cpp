// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/evaluate/program.h>

#include <algorithm>
#include <array>
#include <span>

#include <dyntape/autodiff/graph/callee.h>

namespace dyntape::detail {
namespace {

// Longer windows make longer runs and keep more values alive.
constexpr std::size_t kWindow = 2048;

// Of the nodes that are operations and calls, in the order of the graph, which one a node is; a result is its call.
using Positions = std::vector<std::uint32_t>;
constexpr std::uint32_t kNone = 0xffffffffu;

// The order within a window: one kind of operation as long as there is one whose arguments are there.
class Window {
 public:
  Window(const Graph& graph, const Positions& position) : graph_(graph), position_(position) {}

  // The nodes, of which the first has the given position, in their new order.
  std::span<const NodeId> ordered(std::span<const NodeId> nodes, std::size_t first) {
    const auto n = static_cast<std::uint32_t>(nodes.size());
    kind_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) kind_[i] = kind(graph_[nodes[i]].op);
    find_kinds();
    link(nodes, static_cast<std::uint32_t>(first));
    next_ready_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) {
      if (waiting_[i] == 0) make_ready(i);
    }
    ordered_.clear();
    while (ordered_.size() < n) take_all_of(most_ready(), nodes);
    return ordered_;
  }

 private:
  // Calls are a kind of their own, after those of the table.
  static constexpr std::size_t kKinds = kTableOps + 1;
  static std::uint8_t kind(Op op) {
    return static_cast<std::uint8_t>(std::min(static_cast<int>(op), kTableOps));
  }

  // Those that there are.
  void find_kinds() {
    std::array<bool, kKinds> is_there{};
    for (std::uint8_t k : kind_) is_there[k] = true;
    kinds_.clear();
    for (std::size_t k = 0; k < kKinds; ++k) {
      if (is_there[k]) kinds_.push_back(k);
    }
  }

  // Who waits for whom, and for how many.
  void link(std::span<const NodeId> nodes, std::uint32_t first) {
    const auto n = static_cast<std::uint32_t>(nodes.size());
    waiting_.assign(n, 0);
    first_user_.assign(n, kNone);
    users_.clear();
    for (std::uint32_t i = n; i-- > 0;) {  // backwards: a list begins with what is entered last
      const auto wait = [&](NodeId a) {
        const std::uint32_t p = position_[a] - first;
        if (p >= n) return;  // outside: it is there
        ++waiting_[i];
        users_.push_back({i, first_user_[p]});
        first_user_[p] = static_cast<std::uint32_t>(users_.size() - 1);
      };
      const Node& node = graph_[nodes[i]];
      if (is_table_op(node.op)) {
        wait(node.a);
        const int arity = info(node.op).arity;
        if (arity > 1) wait(node.b);
        if (arity > 2) wait(node.c);
      } else {
        graph_.for_each_argument(nodes[i], wait);
      }
    }
  }

  void make_ready(std::uint32_t i) {
    Ready& ready = ready_[kind_[i]];
    next_ready_[i] = kNone;
    (ready.count == 0 ? ready.first : next_ready_[ready.last]) = i;
    ready.last = i;
    ++ready.count;
  }

  // The first of those of which there are most.
  std::size_t most_ready() const {
    std::size_t most = kinds_[0];
    for (std::size_t k : kinds_) {
      if (ready_[k].count > ready_[most].count) most = k;
    }
    return most;
  }

  void take_all_of(std::size_t kind_taken, std::span<const NodeId> nodes) {
    Ready& ready = ready_[kind_taken];
    for (std::uint32_t i = ready.first; i != kNone; i = next_ready_[i]) {  // it grows on the way
      ordered_.push_back(nodes[i]);
      for (std::uint32_t u = first_user_[i]; u != kNone; u = users_[u].next) {
        if (--waiting_[users_[u].place] == 0) make_ready(users_[u].place);
      }
    }
    ready.count = 0;
  }

  struct User {
    std::uint32_t place, next;
  };
  struct Ready {
    std::uint32_t first, last, count = 0;
  };
  const Graph& graph_;
  const Positions& position_;
  std::vector<std::uint8_t> kind_;  // by place within the window, as those below
  std::vector<std::uint32_t> waiting_, first_user_, next_ready_;
  std::vector<User> users_;
  std::vector<std::size_t> kinds_;
  std::array<Ready, kKinds> ready_;  // lists, the oldest first
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
    sort_out();
    place_constants();
    load_inputs();
    Window window(graph_, position_);
    for (std::size_t first = 0; first < operations_.size(); first += kWindow) {
      const std::size_t n = std::min(kWindow, operations_.size() - first);
      for (NodeId id : window.ordered({operations_.data() + first, n}, first))
        graph_[id].op == Op::Call ? call(id) : compute(id);
      flush();
    }
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
      if (!is_needed(id)) continue;
      const Node& node = graph_[id];
      if (is_table_op(node.op)) {
        const int arity = info(node.op).arity;
        ++uses_[node.a];
        if (arity > 1) ++uses_[node.b];
        if (arity > 2) ++uses_[node.c];
      } else {
        graph_.for_each_argument(id, [&](NodeId a) { ++uses_[a]; });
      }
    }
    // Which outputs and guards a node is: the chains of those that are the same node.
    chain(
        function_.outputs.size(), [&](std::size_t i) { return function_.outputs[i]; }, outputs_of_);
    chain(
        function_.guards.size(), [&](std::size_t i) { return function_.guards[i].condition; }, guards_of_);
  }

  // What is needed, by what it is, and how many words that takes.
  void sort_out() {
    std::size_t words = 2 * (function_.outputs.size() + function_.guards.size());
    position_.assign(graph_.size(), kNone);
    operations_.reserve(graph_.size());
    for (NodeId id = 0; id < graph_.size(); ++id) {
      if (!is_needed(id)) continue;
      const Node& node = graph_[id];
      if (node.op == Op::Const) {
        constants_.push_back(id);
      } else if (node.op == Op::Input) {
        inputs_.push_back(id);
        words += 3;
      } else if (node.op == Op::Result) {
        position_[id] = position_[node.a];
        const std::size_t number = graph_[node.a].c;
        results_.resize(std::max(results_.size(), number + 1));
        results_[number].push_back(id);
      } else {
        position_[id] = static_cast<std::uint32_t>(operations_.size());
        operations_.push_back(id);
        const bool is_call = node.op == Op::Call;
        words += 1 + (is_call ? call_arity(graph_, id) + graph_.callees()[node.a]->n_out
                              : static_cast<std::size_t>(info(node.op).arity));
      }
    }
    program_.code_.reserve(words);
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
    for (NodeId id : constants_) {
      slot_[id] = next_++;
      program_.constants_.push_back(graph_.constant_value(id));
      store(id);
    }
  }

  // All inputs before anything is stored: an output may lie where an input was.
  void load_inputs() {
    for (NodeId id : inputs_) {
      const Node& node = graph_[id];
      slot_[id] = next_++;
      add(Kind::kLoad, Op::Input, {slot_[id], node.a, node.b});
      store(id);
    }
    flush();
  }

  void compute(NodeId id) {
    switch (info(graph_[id].op).arity) {
      case 1:
        return compute_of<1>(id);
      case 2:
        return compute_of<2>(id);
      default:
        return compute_of<3>(id);
    }
  }

  template <std::size_t arity>
  void compute_of(NodeId id) {
    const Node node = graph_[id];
    const NodeId arguments[] = {node.a, node.b, node.c};
    std::array<Word, arity + 1> words;
    for (std::size_t i = 0; i < arity; ++i) words[i + 1] = slot_[arguments[i]];
    for (std::size_t i = 0; i < arity; ++i) release(arguments[i]);  // the result may take an argument's place
    words[0] = slot_[id] = free_slot();
    begin(Kind::kCompute, node.op);
    for (Word word : words) program_.code_.push_back(word);
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
    begin(Kind::kCall, Op::Call);
    program_.code_.insert(program_.code_.end(), words.begin(), words.end());
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
        add(kind, Op::Result, {i, slot_[id]});
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

  void begin(Kind kind, Op op) {
    auto& runs = program_.runs_;
    if (runs.empty() || runs.back().kind != kind || runs.back().op != op) runs.push_back({kind, op, 0});
    ++runs.back().count;
  }
  void add(Kind kind, Op op, std::initializer_list<Word> words) {
    begin(kind, op);
    for (Word word : words) program_.code_.push_back(word);
  }

  static constexpr std::uint32_t kEnd = 0xffffffffu;

  const Function& function_;
  const Graph& graph_;
  Program& program_;
  std::vector<std::uint32_t> uses_;  // that are still to come
  std::vector<Word> slot_, free_;
  Word next_ = 0;
  std::vector<NodeId> constants_, inputs_, operations_;
  Positions position_;
  Chains outputs_of_, guards_of_;
  std::vector<NodeId> pending_;               // to be stored or checked
  std::vector<std::vector<NodeId>> results_;  // that are needed of call number i
};

Program::Program(const Function& function) { ProgramLayout(function, *this).run(); }

}  // namespace dyntape::detail
