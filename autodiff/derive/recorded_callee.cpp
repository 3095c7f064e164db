// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/derive/recorded_callee.h>

#include <string>
#include <utility>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/derive/sparsity.h>
#include <dyntape/autodiff/error.h>

namespace dyntape {
namespace {

std::shared_ptr<const Callee> derived(const Recorded& from, AdMode mode, const Seeds& seeds) {
  const bool is_forward = mode == AdMode::kForward;
  const Function& f = *from.function;
  const Function derivative = seeds.empty() ? all_as_variables(is_forward ? jvp(f) : vjp(f))
                              : is_forward  ? jvp_by_seeds(f, seeds)
                                            : vjp_by_seeds(f, seeds);
  return from.use == Recorded::Use::kDissolve ? dissolving_callee(derivative) : recorded_callee(derivative);
}

bool has_poles(const Graph& graph) {
  for (NodeId id = 0; id < graph.size(); ++id) {
    if (has_pole(graph, id)) return true;
  }
  return false;
}

std::shared_ptr<Callee> wrapped(const Function& function, Recorded::Use use) {
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
  const auto recorded = std::make_shared<const Function>(compact(function));
  auto callee = std::make_shared<Callee>(function.name, recorded->n_x(), recorded->n_y(),
                                         Recorded{recorded, use, derived});
  callee->pattern = jacobian_sparsity(*recorded);
  callee->has_poles = has_poles(recorded->graph);
  return callee;
}

}  // namespace

std::shared_ptr<const Callee> recorded_callee(const Function& function) {
  return wrapped(function, Recorded::Use::kCall);
}

std::shared_ptr<const Callee> dissolving_callee(const Function& function, CalleeMaker jvp, CalleeMaker vjp) {
  auto callee = wrapped(function, Recorded::Use::kDissolve);
  callee->jvp = std::move(jvp);
  callee->vjp = std::move(vjp);
  return callee;
}

}  // namespace dyntape
