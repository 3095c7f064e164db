// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/interpret.h>

#include <cmath>
#include <sstream>

#include <dyntape/autodiff/error.h>

namespace dyntape {
namespace {

inline double evaluate_in_double(Op op, double x, double y, double z) {
  return evaluate<double>(op, x, y, z);
}

}  // namespace

Interpreter::Interpreter(Function function, Functions functions)
    : function_(std::move(function)), functions_(functions) {
  check(function_);
  // Every call keeps its results until its Result nodes have read them, and its arguments while it runs.
  for (const Node& node : function_.graph.nodes()) {
    if (node.op != Op::Call) continue;
    const Callee& callee = *function_.graph.callees()[node.a];
    call_offset_.push_back(call_space_);
    call_space_ += callee.n_in + callee.n_out;
    if (functions == Functions::kPortable && callee.recorded)
      portable_callees_.try_emplace(&callee, *callee.recorded, functions);
  }
}

Interpreter::Workspace::Workspace(const Interpreter& interpreter)
    : values_(interpreter.function_.graph.size()), call_(interpreter.call_space_) {}

void Interpreter::call(const Callee& callee, const double* in, double* out) const {
  const auto portable = portable_callees_.find(&callee);
  if (portable == portable_callees_.end()) return callee.evaluate(in, out);
  Workspace workspace(portable->second);
  portable->second(in, nullptr, nullptr, out, workspace);
}

std::uint32_t Interpreter::operator()(const double* x, const double* p, const double* w, double* y,
                                      Workspace& workspace) const {
  return functions_ == Functions::kPortable ? run<Functions::kPortable>(x, p, w, y, workspace)
                                            : run<Functions::kLibm>(x, p, w, y, workspace);
}

template <Functions F>
std::uint32_t Interpreter::run(const double* x, const double* p, const double* w, double* y,
                               Workspace& workspace) const {
  constexpr auto evaluate = F == Functions::kPortable ? portable_value : evaluate_in_double;
  const Graph& graph = function_.graph;
  const double* const blocks[] = {x, p, w};
  double* const value = workspace.values_.data();
  const Node* const nodes = graph.nodes().data();
  const auto n = static_cast<NodeId>(graph.size());
  for (NodeId id = 0; id < n; ++id) {
    const Node& node = nodes[id];
    switch (node.op) {
#define OP(name, fn, arity, ...)                                                                             \
  case Op::name:                                                                                             \
    value[id] =                                                                                              \
        evaluate(Op::name, value[node.a], arity > 1 ? value[node.b] : 0.0, arity > 2 ? value[node.c] : 0.0); \
    break;
#define FN OP
#include "ops.def"
#undef OP
#undef FN
      case Op::Const:
        value[id] = graph.constants()[node.a];
        break;
      case Op::Input:
        value[id] = blocks[node.a][node.b];
        break;
      case Op::Call: {
        const Callee& callee = *graph.callees()[node.a];
        double* const in = workspace.call_.data() + call_offset_[node.c];
        for (std::size_t i = 0; i < callee.n_in; ++i) in[i] = value[graph.call_arguments()[node.b + i]];
        call(callee, in, in + callee.n_in);
        value[id] = 0;
        break;
      }
      case Op::Result: {
        const Node& call = nodes[node.a];
        value[id] = workspace.call_[call_offset_[call.c] + graph.callees()[call.a]->n_in + node.b];
        break;
      }
    }
  }
  for (std::size_t i = 0; i < function_.outputs.size(); ++i) y[i] = value[function_.outputs[i]];
  for (std::size_t i = 0; i < function_.guards.size(); ++i) {
    const Guard& guard = function_.guards[i];
    if ((value[guard.condition] != 0) != guard.expected) return static_cast<std::uint32_t>(i + 1);
  }
  return 0;
}

std::string Interpreter::first_not_finite(const Workspace& workspace) const {
  const Graph& graph = function_.graph;
  for (NodeId id = 0; id < graph.size(); ++id) {
    const Node& node = graph[id];
    if (node.op == Op::Call || node.op == Op::Const || std::isfinite(workspace.values_[id])) continue;
    std::ostringstream text;
    text.precision(17);
    text << "node " << id << " (" << info(node.op).name << ")";
    if (node.op == Op::Input) {
      const auto& names = function_.input_names[node.a];
      const char* const blocks[] = {"variable", "parameter", "weight"};
      text << ": " << blocks[node.a] << " " << node.b;
      if (node.b < names.size()) text << " (" << names[node.b] << ")";
      text << " = " << workspace.values_[id];
      return text.str();
    }
    if (node.op == Op::Result) text << ": " << graph.callees()[graph[node.a].a]->name;
    text << ": of (";
    bool finite = true, first = true;
    graph.for_each_argument(node.op == Op::Result ? node.a : id, [&](NodeId a) {
      const double argument = workspace.values_[a];
      finite = finite && std::isfinite(argument);
      text << (first ? "" : ", ") << argument;
      first = false;
    });
    text << ") = " << workspace.values_[id];
    if (finite) return text.str();
  }
  return {};
}

std::string describe_guard(const Function& function, std::uint32_t status) {
  const Guard& guard = function.guards.at(status - 1);
  return "\"" + function.name + "\": the comparison at " + guard.file + ":" + std::to_string(guard.line) +
         " was " + (guard.expected ? "true" : "false") + " when recorded and is " +
         (guard.expected ? "false" : "true") +
         " now; record again at a point of this branch, or use select(condition, a, b)";
}

void detail::check_sizes(const Function& function, std::size_t x, std::size_t p, std::size_t w) {
  const std::size_t given[] = {x, p, w};
  const char* const blocks[] = {"x", "p", "w"};
  for (int b = 0; b < kBlocks; ++b) {
    if (given[b] != function.inputs[b]) {
      throw ArgumentError(std::string("evaluate: ") + blocks[b] + " has " + std::to_string(given[b]) +
                          " entries, function \"" + function.name + "\" expects " +
                          std::to_string(function.inputs[b]));
    }
  }
}

std::vector<double> evaluate(const Function& function, const std::vector<double>& x,
                             const std::vector<double>& p, const std::vector<double>& w) {
  detail::check_sizes(function, x.size(), p.size(), w.size());
  const Interpreter run(function);
  Interpreter::Workspace workspace(run);
  std::vector<double> y(function.n_y());
  const std::uint32_t status = run(x.data(), p.data(), w.data(), y.data(), workspace);
  if (status) throw GuardViolation(describe_guard(function, status));
  return y;
}

void evaluate(const Callee& callee, const double* in, double* out) { callee.evaluate(in, out); }

}  // namespace dyntape
