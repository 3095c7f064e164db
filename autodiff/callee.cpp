// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/callee.h>

#include <mutex>
#include <optional>

#include <dyntape/autodiff/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/interpret.h>
#include <dyntape/autodiff/sparsity.h>

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

// Whoever interprets the caller does without it: the callee is then part of the caller's program.
struct OnRequest {
  std::once_flag once;
  std::optional<Interpreter> run;
};

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
  callee->jvp = [recorded] { return recorded_callee(all_as_variables(jvp(*recorded))); };
  callee->vjp = [recorded] { return recorded_callee(all_as_variables(vjp(*recorded))); };
  return callee;
}

std::shared_ptr<const Callee> dissolving_callee(const Function& function, CalleeMaker jvp, CalleeMaker vjp) {
  auto callee = std::make_shared<Callee>(*recorded_callee(function));
  callee->dissolves = true;
  const auto recorded = callee->recorded;
  callee->jvp =
      jvp ? jvp : [recorded] { return dissolving_callee(all_as_variables(dyntape::jvp(*recorded))); };
  callee->vjp =
      vjp ? vjp : [recorded] { return dissolving_callee(all_as_variables(dyntape::vjp(*recorded))); };
  return callee;
}

std::vector<OperationCount> count_operations(const Callee& callee) {
  return callee.recorded ? count_operations(*callee.recorded) : callee.operations;
}

std::shared_ptr<const Callee> jvp_callee(const std::shared_ptr<const Callee>& callee) {
  return made_once(callee->jvp_made, *callee, "jvp", callee->jvp);
}

std::shared_ptr<const Callee> vjp_callee(const std::shared_ptr<const Callee>& callee) {
  return made_once(callee->vjp_made, *callee, "vjp", callee->vjp);
}

}  // namespace dyntape
