// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluates functions at many points of one vector of variables.
//
//   std::vector<Evaluator> all;
//   add_evaluator(all, node, {.order = Order::kSecond}, {.count = 81, .variable = 0});   // 81 points
//   add_evaluator(all, end, {.order = Order::kSecond}, {.variable = 80 * n_z});          // one more
//   Evaluation at(all, Order::kSecond);
//   if (at.run(all, Order::kFirst, x)) use(at.y, at.jacobian);
//
// Point k of an evaluator reads f.n_x() variables from x[variable + k f.n_x()], and its parameters.  Results of all
// evaluators are contiguous: y (count x n_y), non-zeros of Jacobian and Hessian (count x nnz).  `weights` are for y.
//
// No allocation after construction.  Not thread-safe.
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/compiled_function.h>

namespace dyntape {

struct EvaluationPoints {
  std::size_t count = 1, variable = 0;  // points; index of the first variable
  unsigned threads = 1;                 // that share the points; 0: all
};

struct Evaluator {
  CompiledFunction function;
  EvaluationPoints at;
  std::vector<double> parameters = {};           // (count x n_p)
  std::size_t y = 0, jacobian = 0, hessian = 0;  // offsets of the results
  std::size_t y_end() const { return y + at.count * function.n_y(); }
  std::size_t jacobian_end() const;
  std::size_t hessian_end() const;
};

// Compiles the function to options.order and appends its results after those of the others.  Returns its index.
std::size_t add_evaluator(std::vector<Evaluator>& all, const Function& function,
                          const CodegenOptions& options, const EvaluationPoints& at);
// The same for a compiled function.
std::size_t add_evaluator(std::vector<Evaluator>& all, const CompiledFunction& function,
                          const EvaluationPoints& at);

// A range of evaluators: first <= k < last.
struct EvaluatorRange {
  std::size_t first = 0, last = SIZE_MAX;
};

class Evaluation {
 public:
  Evaluation() = default;
  // Allocates results up to this order.
  Evaluation(const std::vector<Evaluator>& evaluators, Order highest);

  // Returns false if a recorded branch is left, or a result of this order is not finite.
  bool run(const std::vector<Evaluator>& evaluators, Order order, const double* x, EvaluatorRange range = {});

  std::vector<double> weights, y, jacobian, hessian;

 private:
  std::vector<CompiledFunction::Workspace> workspaces_;
};

// Sums over functions of the cost of compilation.
struct BuildReport {
  Timings seconds;
  int compiled = 0, from_cache = 0, machine_code = 0, interpreted = 0;  // functions
  int unfinished = 0;                                                   // still compiling
  std::vector<std::string> sources = {};                                // C files, if any
};
void add_to(BuildReport& report, const CompiledFunction& function);

}  // namespace dyntape
