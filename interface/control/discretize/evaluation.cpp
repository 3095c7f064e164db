// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/discretize/evaluation.h>

#include <algorithm>

namespace dyntape {

namespace {

bool all_finite(const std::vector<double>& values, std::size_t first, std::size_t last) {
  // A sum is not finite if a term is not; one pass without branches.
  double sum = 0;
  for (std::size_t i = first; i < last; ++i) sum += values[i] * 0.0;
  return sum == 0.0;
}

}  // namespace

std::size_t Evaluator::jacobian_end() const {
  if (function.order() < Order::kFirst) return jacobian;
  return jacobian + at.count * function.jacobian_pattern().nnz();
}

std::size_t Evaluator::hessian_end() const {
  if (function.order() < Order::kSecond) return hessian;
  return hessian + at.count * function.hessian_pattern().nnz();
}

std::size_t add_evaluator(std::vector<Evaluator>& all, const CompiledFunction& function,
                          const EvaluationPoints& at) {
  Evaluator next{function, at};
  if (!all.empty()) {
    const Evaluator& last = all.back();
    next.y = last.y_end(), next.jacobian = last.jacobian_end(), next.hessian = last.hessian_end();
  }
  all.push_back(std::move(next));
  return all.size() - 1;
}

std::size_t add_evaluator(std::vector<Evaluator>& all, const Function& function,
                          const CodegenOptions& options, const EvaluationPoints& at) {
  CodegenOptions own = options;
  if (function.n_y() == 0) own.route = Route::kInterpreter;  // there is nothing to compile
  return add_evaluator(all, CompiledFunction::make(function, own), at);
}

Evaluation::Evaluation(const std::vector<Evaluator>& evaluators, Order highest) {
  for (const Evaluator& e : evaluators) workspaces_.emplace_back(e.function, e.at.threads);
  if (evaluators.empty()) return;
  const Evaluator& last = evaluators.back();
  y.resize(last.y_end());
  if (highest >= Order::kFirst) jacobian.resize(last.jacobian_end());
  if (highest >= Order::kSecond) hessian.resize(last.hessian_end()), weights.resize(last.y_end());
}

bool Evaluation::run(const std::vector<Evaluator>& evaluators, Order order, const double* x,
                     EvaluatorRange range) {
  const std::size_t end = std::min(range.last, evaluators.size());
  if (range.first >= end) return true;
  for (std::size_t k = range.first; k < end; ++k) {
    const Evaluator& e = evaluators[k];
    Points points{.count = e.at.count, .x = x + e.at.variable, .p = e.parameters.data(), .y = y.data() + e.y};
    if (order >= Order::kFirst) points.jacobian = jacobian.data() + e.jacobian;
    if (order >= Order::kSecond) points.w = weights.data() + e.y, points.hessian = hessian.data() + e.hessian;
    if (e.function.run(order, points, workspaces_[k])) return false;
  }
  const Evaluator &first = evaluators[range.first], &last = evaluators[end - 1];
  return all_finite(y, first.y, last.y_end()) &&
         (order < Order::kFirst || all_finite(jacobian, first.jacobian, last.jacobian_end())) &&
         (order < Order::kSecond || all_finite(hessian, first.hessian, last.hessian_end()));
}

void add_to(BuildReport& report, const CompiledFunction& function) {
  report.seconds += function.timings();
  const bool cached = function.timings().cache_hit;
  report.interpreted += function.route() == Route::kInterpreter && function.n_y() > 0;
  report.machine_code += function.route() == Route::kMachineCode;
  report.from_cache += cached;
  report.compiled += function.route() == Route::kCompiled && !cached;
  report.unfinished += !function.is_settled();
  if (!function.source_path().empty()) report.sources.push_back(function.source_path());
}

}  // namespace dyntape
