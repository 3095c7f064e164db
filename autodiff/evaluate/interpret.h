// SPDX-License-Identifier: BSD-3-Clause
//
// The interpreter: evaluates a recorded function node by node.  Use it without a compiler, for single evaluations
// and as the reference: generated code has the same bits.
//
//   std::vector<double> y = evaluate(f, x, p);                   // checks sizes, throws GuardViolation
//
//   Interpreter run(f);                                          // many evaluations: one workspace per thread
//   Interpreter::Workspace workspace(run, 100);
//   std::uint32_t status = run(x, p, w, y, workspace);           // 0, or 1 + index of the first violated guard
//   run({.points = 100, .x = x, .y = y}, workspace);             // dense: point i follows point i - 1
//
// Several points are evaluated eight at a time, in SIMD lanes: three to five times as fast as single points, with
// the same bits.  Evaluations do not allocate.
//
// evaluate_as<T> evaluates the same tape in another float type; a T of 113 bits is the reference for accuracy.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret_lanes.h>
#include <dyntape/autodiff/evaluate/numbers.h>
#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/scalars/portable.h>

namespace dyntape {

// The points of one call: point i reads x + i * stride_x, and so on.  If a stride is 0, all points read the same
// block.
struct PointRange {
  static constexpr std::size_t kDense = SIZE_MAX;  // the points follow each other without gaps
  std::size_t points = 1;
  const double *x = nullptr, *p = nullptr, *w = nullptr;
  double* y = nullptr;
  std::size_t stride_x = kDense, stride_p = kDense, stride_w = kDense, stride_y = kDense;
  std::uint32_t* status = nullptr;  // one word per point, or null
};

class Interpreter {
 public:
  explicit Interpreter(Function function, Functions functions = kDefaultFunctions);

  // The buffers of one evaluation at a time.  If `points` is more than 1, several points are evaluated in SIMD lanes.
  class Workspace {
   public:
    explicit Workspace(const Interpreter& interpreter, std::size_t points = 1);

   private:
    friend class Interpreter;
    std::vector<detail::LaneRoom<1>> one_;
    std::vector<detail::LaneRoom<detail::kLanes>> many_;
  };

  // Evaluates x (n_x), p (n_p), w (n_w) -> y (n_y).  Unused inputs may be null; y may alias x.  Thread-safe if each
  // thread has its own workspace.
  std::uint32_t operator()(const double* x, const double* p, const double* w, double* y,
                           Workspace& workspace) const;
  // Evaluates many points; y must not overlap the inputs.  A workspace made for one point works, but is slower.
  void operator()(const PointRange& range, Workspace& workspace) const;

  const Function& function() const { return function_; }

 private:
  std::size_t link(const Function& function, std::map<const Callee*, std::size_t>& known);
  template <int N>
  void run_lanes(const PointRange& range, std::size_t first, int lanes,
                 std::vector<detail::LaneRoom<N>>& rooms) const;

  Function function_;
  Functions functions_;
  std::vector<detail::LinkedProgram> programs_;  // callees before their callers; the last is the function's
};

// Evaluates once and checks: ArgumentError for wrong sizes, GuardViolation with file and line of the branch.
// x, p and w: any vectors of doubles (numbers.h).
std::vector<double> evaluate(const Function& function, Numbers x, Numbers p = {}, Numbers w = {});

// Returns the first node whose value is not finite although all its arguments are: "node 17 (Log): of (-1) = nan".
// Returns "" if there is none.  Sizes are not checked.
std::string first_not_finite(const Function& function, const double* x, const double* p, const double* w);

// The error message for a guard that an evaluation returned as `status`.
std::string describe_guard(const Function& function, std::uint32_t status);

// Evaluates a callee on numbers.
void evaluate(const Callee& callee, const double* in, double* out);

namespace detail {
void check_sizes(const Function& function, std::size_t x, std::size_t p, std::size_t w);
std::shared_ptr<const Function> recorded_form(
    const Callee& callee);  // null: the callee exists in double only
}  // namespace detail

// Evaluates the tape in the float type T.  Guards are not checked.  ArgumentError for kernels that exist in double
// only (Kernel::unrolled).
template <class T>
std::vector<T> evaluate_as(const Function& function, const std::vector<T>& x, const std::vector<T>& p = {},
                           const std::vector<T>& w = {});

}  // namespace dyntape

#include <dyntape/autodiff/evaluate/interpret.hxx>
