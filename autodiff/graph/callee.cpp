// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/graph/callee.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/derive/sparsity.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>

namespace dyntape {
namespace {

std::recursive_mutex derivation_mutex;

std::shared_ptr<const Callee> made_once(std::weak_ptr<const Callee>& made, const Callee& callee,
                                        const char* what,
                                        const std::function<std::shared_ptr<const Callee>()>& make) {
  const std::scoped_lock lock(derivation_mutex);
  if (auto existing = made.lock()) return existing;
  if (!make) {
    throw ArgumentError("kernel \"" + callee.name + "\" is differentiated but gives no " + what);
  }
  auto result = make();
  made = result;
  return result;
}

bool has_poles(const Graph& graph) {
  for (NodeId id = 0; id < graph.size(); ++id) {
    if (has_pole(graph, id)) return true;
  }
  return false;
}

// The derivative by some seeds, as a callee of the same kind.
std::shared_ptr<const Callee> by_seeds(const Callee& callee, const Seeds& seeds,
                                       std::map<Seeds, std::weak_ptr<const Callee>>& made,
                                       Function (*derived)(const Function&, const Seeds&)) {
  const std::scoped_lock lock(derivation_mutex);
  if (auto existing = made[seeds].lock()) return existing;
  const Function function = derived(*callee.recorded, seeds);
  auto result = callee.dissolves ? dissolving_callee(function) : recorded_callee(function);
  made[seeds] = result;
  return result;
}

bool are_numbers(const Seeds& seeds) {
  return std::all_of(seeds.begin(), seeds.end(), [](SeedKind kind) { return kind == SeedKind::kNumber; });
}

// Whoever interprets the caller does without it: the callee is then part of the caller's program.
struct OnRequest {
  std::once_flag once;
  std::optional<Interpreter> run;
};

using Derivation = Function (*)(const Function&);
using Wrapping = std::shared_ptr<const Callee> (*)(const Function&);

std::shared_ptr<const Callee> dissolving(const Function& function) { return dissolving_callee(function); }

// The derivative that derivation finds, as a callee of the same kind.
struct Derived {
  std::shared_ptr<const Function> recorded;
  Derivation derivation;
  Wrapping wrapped;
  std::shared_ptr<const Callee> operator()() const {
    return wrapped(all_as_variables(derivation(*recorded)));
  }
};

bool follows(const Callee& callee, const CalleeMaker& maker, Derivation derivation) {
  const auto* derived = maker.target<Derived>();
  return derived && callee.recorded && derived->recorded == callee.recorded &&
         derived->derivation == derivation &&
         derived->wrapped == (callee.dissolves ? dissolving : recorded_callee);
}

}  // namespace

std::shared_ptr<const Callee> recorded_callee(const Function& function) {
  if (function.n_p() || function.n_w()) {
    throw ArgumentError("\"" + function.name +
                        "\" has parameters or weights and cannot be called from a recording; "
                        "pass it through all_as_variables() first");
  }
  if (!function.guards.empty()) {
    throw ArgumentError("\"" + function.name + "\" branches on recorded values (" + function.guards[0].file +
                        ":" + std::to_string(function.guards[0].line) +
                        ") and cannot be called from a recording; use select(condition, a, b)");
  }
  auto callee = std::make_shared<Callee>();
  const auto recorded = std::make_shared<const Function>(compact(function));
  callee->name = function.name;
  callee->n_in = recorded->n_x();
  callee->n_out = recorded->n_y();
  callee->recorded = recorded;
  callee->pattern = jacobian_sparsity(*recorded);
  callee->evaluate = [made = std::make_shared<OnRequest>(), recorded](const double* in, double* out) {
    std::call_once(made->once, [&] { made->run.emplace(*recorded); });
    Interpreter::Workspace workspace(*made->run);
    (*made->run)(in, nullptr, nullptr, out, workspace);
  };
  callee->has_poles = has_poles(recorded->graph);
  callee->jvp = Derived{recorded, jvp, recorded_callee};
  callee->vjp = Derived{recorded, vjp, recorded_callee};
  return callee;
}

std::shared_ptr<const Callee> dissolving_callee(const Function& function, CalleeMaker jvp, CalleeMaker vjp) {
  auto callee = std::make_shared<Callee>(*recorded_callee(function));
  callee->dissolves = true;
  callee->jvp = jvp ? jvp : Derived{callee->recorded, dyntape::jvp, dissolving};
  callee->vjp = vjp ? vjp : Derived{callee->recorded, dyntape::vjp, dissolving};
  return callee;
}

bool derivatives_follow(const Callee& callee) {
  return follows(callee, callee.jvp, jvp) && follows(callee, callee.vjp, vjp);
}

void check_pattern(const Callee& callee) {
  const Pattern& p = callee.pattern;
  if (p.rows == 0) return;
  const auto refuse = [&](const std::string& what) {
    throw ArgumentError("pattern of \"" + callee.name + "\": " + what);
  };
  const auto size = [](std::size_t rows, std::size_t cols) {
    return std::to_string(rows) + " x " + std::to_string(cols);
  };
  if (p.rows != callee.n_out || p.cols != callee.n_in)
    refuse("it is " + size(p.rows, p.cols) + ", expected outputs x inputs, " +
           size(callee.n_out, callee.n_in));
  if (p.row.size() != p.col.size())
    refuse(std::to_string(p.row.size()) + " rows for " + std::to_string(p.col.size()) +
           " columns of entries, expected as many");
  const auto entry = [&](std::size_t k) {
    return "(" + std::to_string(p.row[k]) + ", " + std::to_string(p.col[k]) + ")";
  };
  for (std::size_t k = 0; k < p.nnz(); ++k) {
    if (p.row[k] >= p.rows || p.col[k] >= p.cols)
      refuse("entry " + entry(k) + " is beyond " + size(p.rows, p.cols));
    if (k && std::pair(p.row[k - 1], p.col[k - 1]) >= std::pair(p.row[k], p.col[k]))
      refuse("entry " + entry(k) + " stands behind " + entry(k - 1) +
             ", expected each once, sorted by row and then by column");
  }
}

std::vector<OperationCount> count_operations(const Callee& callee) {
  if (!callee.recorded) return callee.operations;
  static std::mutex mutex;
  auto& made = callee.made.operations;
  {
    const std::scoped_lock lock(mutex);
    if (made) return *made;
  }
  auto operations = count_operations(*callee.recorded);  // and of what that calls: once each
  const std::scoped_lock lock(mutex);
  if (!made) made = std::move(operations);
  return *made;
}

std::shared_ptr<const Callee> jvp_callee(const std::shared_ptr<const Callee>& callee) {
  return made_once(callee->made.jvp, *callee, "jvp", callee->jvp);
}

std::shared_ptr<const Callee> vjp_callee(const std::shared_ptr<const Callee>& callee) {
  return made_once(callee->made.vjp, *callee, "vjp", callee->vjp);
}

std::shared_ptr<const Callee> jvp_callee(const std::shared_ptr<const Callee>& callee, const Seeds& seeds) {
  return are_numbers(seeds) ? jvp_callee(callee) : by_seeds(*callee, seeds, callee->made.jvps, jvp_by_seeds);
}

std::shared_ptr<const Callee> vjp_callee(const std::shared_ptr<const Callee>& callee, const Seeds& seeds) {
  return are_numbers(seeds) ? vjp_callee(callee) : by_seeds(*callee, seeds, callee->made.vjps, vjp_by_seeds);
}

bool has_pole(const Graph& graph, NodeId id) {
  const Node& node = graph[id];
  if (node.op == Op::Call) return graph.callees()[node.a]->has_poles;
  if (node.op == Op::Const) return !std::isfinite(graph.constant_value(id));
  const bool by_constant =
      node.op == Op::Div && graph.is_constant(node.b) && graph.constant_value(node.b) != 0;
  return (info(node.op).laws & kPole) && !by_constant;
}

}  // namespace dyntape
