// SPDX-License-Identifier: BSD-3-Clause
//
// The interpreter: evaluates a recorded function node by node.  It is the reference that generated code is
// held against, bit for bit in the strict profile.
//
//   std::vector<double> y = evaluate(f, x, p);                   // checks sizes, throws GuardViolation
//
//   Interpreter run(f);                                          // many evaluations: one workspace a thread
//   Interpreter::Workspace workspace(run);
//   std::uint32_t status = run(x, p, w, y, workspace);           // 0, or 1 + first violated guard
//
// evaluate_as<T> runs the same tape in another float type: with a 113-bit T it is the reference for accuracy.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <dyntape/autodiff/callee.h>
#include <dyntape/autodiff/function.h>
#include <dyntape/autodiff/portable.h>

namespace dyntape {

class Interpreter {
 public:
  explicit Interpreter(Function function, Functions functions = Functions::kLibm);

  // Values of all nodes of one evaluation.
  class Workspace {
   public:
    explicit Workspace(const Interpreter& interpreter);

   private:
    friend class Interpreter;
    std::vector<double> values_, call_;
  };

  // x (n_x), p (n_p), w (n_w) -> y (n_y).  Unused blocks may be null; y may be x.  Thread-safe on separate
  // workspaces.
  std::uint32_t operator()(const double* x, const double* p, const double* w, double* y,
                           Workspace& workspace) const;

  // The first node whose value is not finite although all its arguments are, after an evaluation with this
  // workspace: "node 17 (Log): log(-1) = nan"; empty if there is none.
  std::string first_not_finite(const Workspace& workspace) const;

  const Function& function() const { return function_; }

 private:
  template <Functions F>
  std::uint32_t run(const double* x, const double* p, const double* w, double* y, Workspace& workspace) const;
  void call(const Callee& callee, const double* in, double* out) const;

  Function function_;
  Functions functions_;
  std::map<const Callee*, Interpreter> portable_callees_;  // recorded ones, where functions are portable
  std::size_t call_space_ = 0;
  std::vector<std::size_t> call_offset_;  // of call number i in Workspace::call_
};

// One evaluation with all checks: ArgumentError for wrong sizes, GuardViolation with the place of the branch.
std::vector<double> evaluate(const Function& function, const std::vector<double>& x,
                             const std::vector<double>& p = {}, const std::vector<double>& w = {});

// The sentence for a guard that evaluation reported as `status`.
std::string describe_guard(const Function& function, std::uint32_t status);

// Evaluates a callee on numbers.
void evaluate(const Callee& callee, const double* in, double* out);

namespace detail {
void check_sizes(const Function& function, std::size_t x, std::size_t p, std::size_t w);
}

// The same tape in the float type T.  Kernels, which exist in double only, throw ArgumentError; guards are
// not checked.
template <class T>
std::vector<T> evaluate_as(const Function& function, const std::vector<T>& x, const std::vector<T>& p = {},
                           const std::vector<T>& w = {});

}  // namespace dyntape

#include <dyntape/autodiff/interpret.hxx>
