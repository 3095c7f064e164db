// SPDX-License-Identifier: BSD-3-Clause
//
// Functions at many points of one vector of variables, evaluated together.
//
//   std::vector<Evaluator> all;
//   add_evaluator(all, node, {.order = Order::kSecond}, {.count = 81, .variable = 0});   // 81 points, one after another
//   add_evaluator(all, end, {.order = Order::kSecond}, {.variable = 80 * n_z});          // one more
//   Evaluation at(all, Order::kSecond);
//   if (at.run(all, Order::kFirst, x)) use(at.y, at.jacobian);
//
// Point k of an evaluator reads f.n_x() variables from x[variable + k f.n_x()] on, and its parameters.  Results of all evaluators
// stand one after another: y (count x n_y), non-zeros of the Jacobian and of the Hessian (count x nnz); `weights` are of y.
//
// Nothing is allocated after construction; one call at a time.
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/compiled_function.h>

namespace dyntape {

struct EvaluationPoints {
  std::size_t count = 1, variable = 0;  // points; where the variables of the first begin
  unsigned threads = 1;                 // that share the points; 0: as many as there are
};

struct Evaluator {
  CompiledFunction function;
  EvaluationPoints at;
  std::vector<double> parameters = {};           // (count x n_p)
  std::size_t y = 0, jacobian = 0, hessian = 0;  // where its results begin
  std::size_t y_end() const { return y + at.count * function.n_y(); }
  std::size_t jacobian_end() const;
  std::size_t hessian_end() const;
};

// Makes the function ready, to options.order, and places its results behind those of the others; its number.
std::size_t add_evaluator(std::vector<Evaluator>& all, const Function& function,
                          const CodegenOptions& options, const EvaluationPoints& at);
// The same of a function that is ready.
std::size_t add_evaluator(std::vector<Evaluator>& all, const CompiledFunction& function,
                          const EvaluationPoints& at);

// Some evaluators in the order of their numbers, first <= k < last.
struct EvaluatorRange {
  std::size_t first = 0, last = SIZE_MAX;
};

class Evaluation {
 public:
  Evaluation() = default;
  // Room for results up to this order.
  Evaluation(const std::vector<Evaluator>& evaluators, Order highest);

  // False where a recorded branch is left, or a result of this order is not finite.
  bool run(const std::vector<Evaluator>& evaluators, Order order, const double* x, EvaluatorRange range = {});

  std::vector<double> weights, y, jacobian, hessian;

 private:
  std::vector<CompiledFunction::Workspace> workspaces_;
};

// What it took to make functions ready, summed over them.
struct BuildReport {
  Timings seconds;
  int compiled = 0, from_cache = 0, machine_code = 0, interpreted = 0;  // functions
  int unfinished = 0;                                                   // whose compiler is still at work
  std::vector<std::string> sources = {};                                // C files, where there are any
};
void add_to(BuildReport& report, const CompiledFunction& function);

}  // namespace dyntape
