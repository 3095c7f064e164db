// SPDX-License-Identifier: BSD-3-Clause
//
// The interpreter: evaluates a recorded function node by node.  It is the reference that generated code is
// held against, bit for bit in the strict profile.
//
//   std::vector<double> y = evaluate(f, x, p);                   // checks sizes, throws GuardViolation
//
//   Interpreter run(f);                                          // many evaluations: one workspace a thread
//   Interpreter::Workspace workspace(run, 100);
//   std::uint32_t status = run(x, p, w, y, workspace);           // 0, or 1 + first violated guard
//   run({.points = 100, .x = x, .y = y}, workspace);             // one point after the other
//
// Many points go eight at a time, side by side through each operation: three to five times as fast as one by
// one, with the same bits.  No evaluation allocates.
//
// evaluate_as<T> runs the same tape in another float type: with a 113-bit T it is the reference for accuracy.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <dyntape/autodiff/evaluate/interpret_lanes.h>
#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/scalars/portable.h>

namespace dyntape {

// What to evaluate: point i reads x + i * stride_x, ...  A stride of 0 is the same block for all points.
struct PointRange {
  static constexpr std::size_t kDense = SIZE_MAX;  // the points follow each other without gaps
  std::size_t points = 1;
  const double *x = nullptr, *p = nullptr, *w = nullptr;
  double* y = nullptr;
  std::size_t stride_x = kDense, stride_p = kDense, stride_w = kDense, stride_y = kDense;
  std::uint32_t* status = nullptr;  // a word a point; null: not wanted
};

class Interpreter {
 public:
  explicit Interpreter(Function function, Functions functions = kDefaultFunctions);

  // Room for one evaluation at a time: of one point, or of several side by side if `points` is more than 1.
  class Workspace {
   public:
    explicit Workspace(const Interpreter& interpreter, std::size_t points = 1);

   private:
    friend class Interpreter;
    std::vector<detail::LaneRoom<1>> one_;
    std::vector<detail::LaneRoom<detail::kLanes>> many_;
  };

  // x (n_x), p (n_p), w (n_w) -> y (n_y).  Unused blocks may be null; y may be x.  Thread-safe on separate
  // workspaces.
  std::uint32_t operator()(const double* x, const double* p, const double* w, double* y,
                           Workspace& workspace) const;
  // Many points; y overlaps with nothing.  A workspace of one point will do, and is slower.
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

// One evaluation with all checks: ArgumentError for wrong sizes, GuardViolation with the place of the branch.
std::vector<double> evaluate(const Function& function, const std::vector<double>& x,
                             const std::vector<double>& p = {}, const std::vector<double>& w = {});

// The first node whose value is not finite although all its arguments are: "node 17 (Log): of (-1) = nan";
// empty if there is none.  Sizes are the caller's word.
std::string first_not_finite(const Function& function, const double* x, const double* p, const double* w);

// The sentence for a guard that evaluation reported as `status`.
std::string describe_guard(const Function& function, std::uint32_t status);

// Evaluates a callee on numbers.
void evaluate(const Callee& callee, const double* in, double* out);

namespace detail {
void check_sizes(const Function& function, std::size_t x, std::size_t p, std::size_t w);
std::shared_ptr<const Function> recorded_form(const Callee& callee);  // null: it is in double only
}  // namespace detail

// The same tape in the float type T.  Kernels that exist in double only (Kernel::unrolled) throw ArgumentError;
// guards are not checked.
template <class T>
std::vector<T> evaluate_as(const Function& function, const std::vector<T>& x, const std::vector<T>& p = {},
                           const std::vector<T>& w = {});

}  // namespace dyntape

#include <dyntape/autodiff/evaluate/interpret.hxx>
