// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/machine/assemble.h>

#include <algorithm>
#include <utility>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/machine/called_functions.h>
#include <dyntape/codegen/machine/elementary.h>
#include <dyntape/codegen/machine/slots.h>

namespace dyntape::codegen {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

// Where each value is used, in order.
class Uses {
 public:
  explicit Uses(const Graph& graph) : first_(graph.size() + 1, 0) {
    const auto each = [&](auto&& visit) {
      for (NodeId id = 0; id < graph.size(); ++id) {
        if (graph[id].op != Op::Result) graph.for_each_argument(id, [&](NodeId a) { visit(a, id); });
      }
    };
    each([&](NodeId a, NodeId) { ++first_[a + 1]; });
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    users_.resize(first_.back());
    next_.assign(first_.begin(), first_.end() - 1);
    each([&](NodeId a, NodeId user) { users_[next_[a]++] = user; });
    next_.assign(first_.begin(), first_.end() - 1);
  }

  // kNone: never again.
  NodeId next(NodeId id) const { return next_[id] < first_[id + 1] ? users_[next_[id]] : kNone; }
  bool is_used_behind(NodeId id, NodeId user) const {
    return next_[id] < first_[id + 1] && users_[first_[id + 1] - 1] > user;
  }
  void pass(NodeId id, NodeId user) {
    while (next_[id] < first_[id + 1] && users_[next_[id]] <= user) ++next_[id];
  }

 private:
  std::vector<std::uint32_t> first_, next_;
  std::vector<NodeId> users_;
};

class Assembly {
 public:
  Assembly(const Derivatives& derived, int lanes, const CodegenOptions& options, CalledKernels& known)
      : derived_(derived),
        function_(derived.function),
        graph_(function_.graph),
        lanes_(lanes),
        options_(options),
        known_(known),
        uses_(graph_),
        register_of_(graph_.size(), kNone),
        slot_of_(graph_.size(), kNone),
        outputs_(outputs_by_node()) {}

  std::shared_ptr<MachineKernel> run() {
    for (const Guard& guard : function_.guards) made_->guards.push_back(guard.expected);
    make_callees();
    count_results();
    pair_sines();
    fill_pool();
    lay_out();
    encode_.emplace(layout_);
    values_.assign(std::size_t(encode_->registers()), kNone);
    next_use_.assign(values_.size(), kNone);
    for (NodeId id = 0; id < graph_.size(); ++id) {
      if (id % 4096 == 0) go_on();
      add(id);
    }
    encode_->finish();
    made_->instructions.assign(encode_->code().begin(), encode_->code().end());
    describe(made_->kernel);
    return made_;
  }

  void describe(dyntape_kernel& kernel) const {
    kernel.order = static_cast<std::uint32_t>(derived_.order);
    kernel.lane_width = static_cast<std::uint32_t>(lanes_);
    kernel.work = std::size_t(first_slot_ + slots_.count()) * std::size_t(lanes_);
    kernel.operations = static_cast<std::uint32_t>(total_operations(function_));
    kernel.live = live_most_;
  }

 private:
  struct Output {
    NodeId node;
    Location place;
  };

  void go_on() const {
    if (options_.stop.stop_requested())
      throw ToolError("the machine code of \"" + function_.name + "\" was interrupted");
  }

  // --- what is known before the first instruction ---

  // After the unused values.
  std::uint32_t first_condition() const {
    return static_cast<std::uint32_t>(
        std::max({derived_.n_y, derived_.jacobian.nnz(), derived_.hessian.nnz()}));
  }

  // Conditions of guards are outputs into the work array.
  std::vector<Output> outputs_by_node() const {
    std::vector<Output> all;
    const std::size_t n_y = derived_.n_y, n_jacobian = derived_.jacobian.nnz();
    for (std::size_t k = 0; k < function_.outputs.size(); ++k) {
      Location to{Location::kY, static_cast<std::uint32_t>(k)};
      if (k >= n_y + n_jacobian)
        to = {Location::kHessian, static_cast<std::uint32_t>(k - n_y - n_jacobian)};
      else if (k >= n_y)
        to = {Location::kJacobian, static_cast<std::uint32_t>(k - n_y)};
      all.push_back({function_.outputs[k], to});
    }
    for (std::size_t k = 0; k < function_.guards.size(); ++k)
      all.push_back({function_.guards[k].condition,
                     {Location::kWork, first_condition() + static_cast<std::uint32_t>(k)}});
    std::stable_sort(all.begin(), all.end(),
                     [](const Output& a, const Output& b) { return a.node < b.node; });
    return all;
  }

  void make_callees() {
    for (const auto& callee : graph_.callees()) made_->called.push_back({callee, kernel_of(*callee)});
  }

  // Null: it is not recorded.
  std::shared_ptr<const MachineKernel> kernel_of(const Callee& callee) {
    const Recorded* const recorded = callee.recorded();
    if (!recorded) return nullptr;
    if (const auto& found = known_[&callee]) return found;
    // Not on the stack: callees have callees.
    const auto alone = std::make_unique<Derivatives>();
    alone->function = *recorded->function;
    alone->n_y = alone->function.n_y();
    return known_[&callee] = std::make_unique<Assembly>(*alone, lanes_, options_, known_)->run();
  }

  void count_results() {
    for (NodeId id = 0; id < graph_.size(); ++id)
      if (graph_[id].op == Op::Result) ++results_[graph_[id].a].unread;
  }

  void pair_sines() {
    for (NodeId id = 0; id < graph_.size(); ++id) {
      const Node& node = graph_[id];
      if (node.op != Op::Sin && node.op != Op::Cos) continue;
      auto& both = turned_.try_emplace(node.a, kNone, kNone).first->second;
      (node.op == Op::Sin ? both.first : both.second) = id;
    }
  }

  void fill_pool() {
    const std::size_t width = std::size_t(lanes_);
    const std::span<const double> start = pool_start();
    first_constant_ = static_cast<std::uint32_t>(start.size());
    made_->pool.resize((start.size() + graph_.constants().size()) * width + 1);
    double* to = made_->pool.data();
    for (double value : start) to = std::fill_n(to, width, value);
    for (double value : graph_.constants()) to = std::fill_n(to, width, value);
  }

  void lay_out() {
    std::size_t arguments = 3, work = 0;
    for (const CalleeOfKernel& called : made_->called) {
      arguments = std::max(arguments, called.callee->n_in);
      work = std::max(work, work_of(called));
    }
    const std::size_t width = std::size_t(lanes_);
    layout_.lanes = lanes_;
    layout_.sizes = {function_.n_x(), function_.n_p(),         function_.n_w(),
                     derived_.n_y,    derived_.jacobian.nnz(), derived_.hessian.nnz()};
    layout_.pool = made_->pool.data();
    layout_.guards = &made_->guards;
    layout_.unwanted = 0;
    layout_.conditions = first_condition();
    arguments_ = layout_.conditions + static_cast<std::uint32_t>(function_.guards.size());
    callee_work_ = arguments_ + static_cast<std::uint32_t>(arguments);
    first_slot_ = callee_work_ + static_cast<std::uint32_t>((work + width - 1) / width);
  }

  // --- where values stand ---

  bool is_leaf(NodeId id) const { return graph_[id].op == Op::Const || graph_[id].op == Op::Input; }

  Location location_of(NodeId id) const {
    if (register_of_[id] != kNone) return {Location::kRegister, register_of_[id]};
    const Node& node = graph_[id];
    if (node.op == Op::Const) return {Location::kPool, first_constant_ + node.a};
    if (node.op == Op::Input) return {static_cast<Location::Kind>(Location::kX + node.a), node.b};
    return {Location::kWork, first_slot_ + slot_of_[id]};
  }

  void save(NodeId id) {
    if (is_leaf(id) || slot_of_[id] != kNone) return;
    slot_of_[id] = slots_.take();
    encode_->store({Location::kWork, first_slot_ + slot_of_[id]}, int(register_of_[id]));
  }

  void put(NodeId id, int reg) {
    values_[std::size_t(reg)] = id;
    next_use_[std::size_t(reg)] = uses_.next(id);
    register_of_[id] = static_cast<std::uint32_t>(reg);
  }
  void leave_register(NodeId id) {
    if (register_of_[id] == kNone) return;
    values_[register_of_[id]] = kNone;
    register_of_[id] = kNone;
  }

  // A register that is none of `kept` (a bit each).
  int take(std::uint32_t kept) {
    int best = -1;
    NodeId last = 0;
    for (int r = 0; r < int(values_.size()); ++r) {
      const NodeId value = values_[std::size_t(r)];
      if (kept >> r & 1u) continue;
      if (value == kNone) return r;
      const NodeId next = next_use_[std::size_t(r)];
      if (best < 0 || next > last) best = r, last = next;
    }
    const NodeId value = values_[std::size_t(best)];
    save(value);
    leave_register(value);
    return best;
  }
  bool has_free_register() const { return std::find(values_.begin(), values_.end(), kNone) != values_.end(); }

  int in_register(NodeId id, std::uint32_t kept) {
    if (register_of_[id] == kNone) {
      const int r = take(kept);
      encode_->load(r, location_of(id));
      put(id, r);
    }
    return int(register_of_[id]);
  }

  void come_alive() { live_most_ = std::max(live_most_, ++live_); }

  // Of what is not needed behind `user`.
  void pass(NodeId id, NodeId user) {
    uses_.pass(id, user);
    const NodeId next = uses_.next(id);
    if (register_of_[id] != kNone) next_use_[register_of_[id]] = next;
    if (next == kNone) release(id);
  }
  void release(NodeId id) {
    if (register_of_[id] == kNone && slot_of_[id] == kNone) return;
    leave_register(id);
    if (is_leaf(id)) return;
    --live_;
    if (slot_of_[id] != kNone) slots_.leave(slot_of_[id]);
    slot_of_[id] = kNone;
  }

  // --- instructions ---

  void add(NodeId id) {
    const Op op = graph_[id].op;
    if (op == Op::Call)
      call(id);
    else if (op == Op::Result)
      slot_of_[id] = results_.at(graph_[id].a).first + graph_[id].b, come_alive();
    else if (is_table_op(op) && slot_of_[id] != kNone)  // with its sine or cosine
      pass(graph_[id].a, id);
    else if (is_table_op(op))
      Encoder::has_instruction(op) ? compute(id) : call_function(id);
    write_outputs(id);
    if (!is_leaf(id) && op != Op::Call && uses_.next(id) == kNone) release(id);
    // Not before: the instruction itself may read them.
    slots_.free_what_was_left();
  }

  void write(Location to, NodeId id) {
    const Location from = location_of(id);
    from.is_register() ? encode_->store(to, int(from.index)) : encode_->copy(to, from);
  }

  void write_outputs(NodeId id) {
    for (; output_ < outputs_.size() && outputs_[output_].node == id; ++output_)
      write(outputs_[output_].place, id);
  }

  void compute(NodeId id) {
    const Node& node = graph_[id];
    const Op op = node.op;
    const int arity = info(op).arity;
    std::array<NodeId, 3> a = {node.a, node.b, node.c};
    const int in_memory = Encoder::memory_argument(op);
    const bool is_apart = Encoder::result_is_apart(op);
    const bool may_swap = arity == 2 && (op == Op::Add || op == Op::Mul);
    if (may_swap && register_of_[a[0]] == kNone && register_of_[a[1]] != kNone) std::swap(a[0], a[1]);
    std::uint32_t kept = 0;
    for (int i = 0; i < arity; ++i) {
      if (i != in_memory && !(is_apart && i == 2)) kept |= 1u << in_register(a[std::size_t(i)], kept);
    }
    const NodeId other = a[std::size_t(in_memory)];
    if (register_of_[other] == kNone && uses_.is_used_behind(other, id) && has_free_register())
      in_register(other, kept);
    if (register_of_[other] != kNone) kept |= 1u << register_of_[other];
    std::array<Location, 3> places;
    for (int i = 0; i < arity; ++i) places[std::size_t(i)] = location_of(a[std::size_t(i)]);
    int to = -1;
    if (is_apart) to = apart(id, a, kept);
    for (int i = 0; i < arity; ++i) pass(a[std::size_t(i)], id);
    if (to < 0) to = take(0);
    put(id, to);
    come_alive();
    encode_->operate(op, to, places);
  }

  // The third argument's, if this is its last use; otherwise one that no argument is read from.
  int apart(NodeId id, const std::array<NodeId, 3>& a, std::uint32_t kept) {
    const bool is_last = !uses_.is_used_behind(a[2], id) && register_of_[a[2]] != kNone;
    if (is_last && a[2] != a[0] && a[2] != a[1]) return int(register_of_[a[2]]);
    const std::uint32_t third = register_of_[a[2]];
    return take(kept | (third == kNone ? 0u : 1u << third));
  }

  // What is needed behind a call stands in memory before it.
  void save_all(NodeId user) {
    for (const NodeId id : values_) {
      if (id != kNone && uses_.is_used_behind(id, user)) save(id);
    }
  }
  void leave_all_registers() {
    for (NodeId& id : values_) {
      if (id != kNone) register_of_[id] = kNone;
      id = kNone;
    }
  }

  // The other one of sine and cosine of a value that is not there yet.
  NodeId partner_of(NodeId id) const {
    const Node& node = graph_[id];
    if (node.op != Op::Sin && node.op != Op::Cos) return kNone;
    const auto found = turned_.find(node.a);
    if (found == turned_.end() || found->second.first == kNone || found->second.second == kNone) return kNone;
    return node.op == Op::Sin ? found->second.second : found->second.first;
  }

  void call_both(NodeId id, NodeId partner) {
    const Node& node = graph_[id];
    save_all(id);
    Location x = location_of(node.a);
    if (x.is_register()) {
      const Location memory{Location::kWork, arguments_};
      encode_->store(memory, int(x.index));
      x = memory;
    }
    const std::uint32_t pair = slots_.take_block(2, 2);
    encode_->call(sine_and_cosine(lanes_, options_.functions), {x, x, x},
                  {Location::kWork, first_slot_ + pair});
    finish_call(id, node, 1);
    const bool is_sine = node.op == Op::Sin;
    slot_of_[id] = pair + (is_sine ? 0 : 1);
    slot_of_[partner] = pair + (is_sine ? 1 : 0);
    come_alive(), come_alive();
  }

  void call_function(NodeId id) {
    if (const NodeId partner = partner_of(id); partner != kNone) return call_both(id, partner);
    const Node& node = graph_[id];
    const int arity = info(node.op).arity;
    save_all(id);
    std::array<Location, 3> places;
    for (int i = 0; i < 3; ++i) places[std::size_t(i)] = location_of(i < arity ? node.argument(i) : node.a);
    ScalarFunction* const scalar = lanes_ == 1 ? scalar_function(node.op, options_.functions) : nullptr;
    if (scalar) {
      encode_->call(scalar, places);
      finish_call(id, node, arity);
    } else {
      for (int i = 0; i < arity; ++i) {
        Location& place = places[std::size_t(i)];
        if (!place.is_register()) continue;
        const Location memory{Location::kWork, arguments_ + static_cast<std::uint32_t>(i)};
        encode_->store(memory, int(place.index));
        place = memory;
      }
      for (int i = arity; i < 3; ++i) places[std::size_t(i)] = places[0];
      const std::uint32_t slot = slots_.take();
      const Location result{Location::kWork, first_slot_ + slot};
      encode_->call(lane_function(node.op, lanes_, options_.functions), places, result);
      finish_call(id, node, arity);
      slot_of_[id] = slot;
      encode_->load(0, result);
    }
    put(id, 0);
    come_alive();
  }

  void finish_call(NodeId id, const Node& node, int arity) {
    for (int i = 0; i < arity; ++i) pass(node.argument(i), id);
    leave_all_registers();
  }

  void call(NodeId id) {
    const Node& node = graph_[id];
    const CalleeOfKernel& called = made_->called[node.a];
    std::uint32_t k = 0;
    graph_.for_each_argument(id, [&](NodeId a) { write({Location::kWork, arguments_ + k++}, a); });
    save_all(id);
    Results& results = results_[id];
    results.first = slots_.take_block(static_cast<std::uint32_t>(called.callee->n_out), results.unread);
    encode_->call(callee_function(called, lanes_), &called, {Location::kWork, arguments_},
                  {Location::kWork, first_slot_ + results.first}, {Location::kWork, callee_work_});
    graph_.for_each_argument(id, [&](NodeId a) { pass(a, id); });
    leave_all_registers();
  }

  const Derivatives& derived_;
  const Function& function_;
  const Graph& graph_;
  const int lanes_;
  const CodegenOptions& options_;
  CalledKernels& known_;
  const std::shared_ptr<MachineKernel> made_ = std::make_shared<MachineKernel>();
  Uses uses_;
  KernelLayout layout_;
  std::optional<Encoder> encode_;
  std::vector<NodeId> values_;              // by register
  std::vector<NodeId> next_use_;            // of each
  std::vector<std::uint32_t> register_of_;  // by node
  std::vector<std::uint32_t> slot_of_;
  std::uint32_t first_constant_ = 0, arguments_ = 0, callee_work_ = 0, first_slot_ = 0;
  Slots slots_;
  std::uint32_t live_ = 0, live_most_ = 0;
  struct Results {
    std::uint32_t first = 0, unread = 0;
  };
  std::map<NodeId, Results> results_;                   // by call
  std::map<NodeId, std::pair<NodeId, NodeId>> turned_;  // sine and cosine, by argument
  std::vector<Output> outputs_;
  std::size_t output_ = 0;
};

}  // namespace

std::shared_ptr<MachineKernel> assemble(const Derivatives& derived, int lanes, const CodegenOptions& options,
                                        CalledKernels& known) {
  return Assembly(derived, lanes, options, known).run();
}

}  // namespace dyntape::codegen
