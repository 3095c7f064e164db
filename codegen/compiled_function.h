// SPDX-License-Identifier: BSD-3-Clause
//
// A recorded function with its derivatives, compiled: what the rest of dyntape evaluates.
//
//   Function recorded = record("norm2", 3, [](const VectorXad& x) {
//     return VectorXad::Constant(1, x.dot(x));
//   });
//   CodegenOptions options;
//   options.order = Order::kSecond;
//   const CompiledFunction f = CompiledFunction::make(recorded, options);
//   CompiledFunction::Workspace workspace(f);                    // of one evaluation at a time
//
//   double y[1], J[3], H[3], w[1] = {1};
//   f.value(x, p, y, workspace);                  // y = f(x, p): a line search pays for values only
//   f.first_order(x, p, y, J, workspace);         // and dy/dx; f.jacobian_pattern() says where
//   f.second_order(x, p, w, y, J, H, workspace);  // and sum_i w_i d2y_i/dx2, lower triangle
//
//   CompiledFunction::Workspace threads(f, 4);                   // the points of a call are shared out among four
//   f.check(f.run(Order::kFirst, {.count = 100, .x = x, .y = y, .jacobian = J}, threads), 100);
//
// Shapes.  x (n_x), p (n_p), w (n_w + n_y: the function's own weights, mostly none, then one an output), y
// (n_y); J, H: the non-zeros in the order of their patterns.  Empty blocks may be null; outputs that are null
// are not written.  Outputs overlap with nothing.
//
// A copy is cheap and shares the library, which stays loaded while any copy or workspace lives.  Evaluation is const
// and thread-safe on separate workspaces, and allocates nothing (but where a function with guards is given more points than
// a workspace has seen, and no `status`).  y, J and H have the same bits in all three
// calls, for any number of points and threads, and in the strict profile the same as the interpreter's.  Where there is no
// compiler, machine code runs.
//
// Tiers.  With options.route = Route::kTiered a function is there at once, and gets faster: machine code (machine/machine_code.h)
// while a thread compiles it in the background, which swaps the better code in between two evaluations of a workspace.  No evaluation
// waits.  What the cache has is used at once and for good.  On processors without machine code it is interpreted meanwhile, and
// where the flags ask for more than -O1, a long function is compiled at -O1 first, which is soon done and not kept; there is no tier
// at -O0, which would be no faster than the interpreter.  If the compiler fails, what serves goes on serving: it is said once on stderr, trouble() has the reason,
// wait() throws it, as it does in a forked child, where nobody compiles.  When the last copy goes, a compiler that still runs is ended.  One function at a time is compiled
// in a process, so that memory is bounded (options.jobs compilers side by side).
//
// Errors.  ArgumentError: an order that was not asked for, a workspace of another function.  ToolError: the
// compiler fails.  GuardViolation, with file and line: the evaluation leaves a branch that was recorded; run()
// reports it in its return value instead.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/codegen/options/options.h>
#include <dyntape/codegen/run/points.h>
#include <dyntape/codegen/timings.h>

namespace dyntape {

namespace codegen {
class Place;
class Tiers;
class TierBuilder;
}  // namespace codegen

class CompiledFunction {
 public:
  // Room for one evaluation at a time, whose points are shared out among so many threads of the process
  // (run/threads.h); 0: as many as it has.
  class Workspace {
   public:
    explicit Workspace(const CompiledFunction& function, unsigned threads = 1);
    ~Workspace();
    Workspace(Workspace&&) noexcept;
    Workspace& operator=(Workspace&&) noexcept;

   private:
    friend class CompiledFunction;
    std::vector<std::unique_ptr<codegen::Place>> places_;  // one a thread
  };

  static CompiledFunction make(const Function& function, const CodegenOptions& options = {});

  // --- what it is ---
  std::size_t n_x() const;
  std::size_t n_p() const;
  std::size_t n_w() const;  // the function's own weights
  std::size_t n_y() const;
  Order order() const;
  const Function& function() const;  // as recorded
  const std::string& name() const;
  // (n_y x n_x), and (n_x x n_x) lower triangle; ArgumentError below first and second order.
  const Pattern& jacobian_pattern() const;
  const Pattern& hessian_pattern() const;

  // --- evaluation; throws GuardViolation ---
  void value(const double* x, const double* p, double* y, Workspace& workspace) const;
  void first_order(const double* x, const double* p, double* y, double* jacobian, Workspace& workspace) const;
  void second_order(const double* x, const double* p, const double* w, double* y, double* jacobian,
                    double* hessian, Workspace& workspace) const;

  // --- the same of many points, and of functions with weights; guards are reported, not thrown ---
  // With options.lanes several points are evaluated at once, by the widest kernel that the processor runs.  Points that
  // lie side by side do so lane_width() by lane_width().
  [[nodiscard]] Violation run(Order order, const Points& points, Workspace& workspace) const;
  std::size_t lane_width() const;  // 1: first interpreted, or without options.lanes
  // Throws GuardViolation if there is one, naming the comparison and, of several points, which.
  void check(const Violation& violation, std::size_t points = 1) const;

  // --- one evaluation with all sizes checked, for small programs and tests ---
  struct Evaluation {
    std::vector<double> y, jacobian, hessian;
  };
  Evaluation evaluate(Order order, const std::vector<double>& x, const std::vector<double>& p = {},
                      const std::vector<double>& w = {}) const;

  // --- how what serves now was made ---
  Route route() const;  // kCompiled, kMachineCode or kInterpreter
  const Timings& timings() const;
  std::size_t operations(Order order) const;  // of one point
  const std::string& source_path() const;     // empty: interpreted, or without cache
  const std::string& compiler() const;        // its version; empty: interpreted

  // --- which tier serves ---
  Tier tier() const;
  bool is_settled() const;      // no other tier will come
  void wait() const;            // until then; throws what ended the compilation
  std::string trouble() const;  // what did; empty: nothing

 private:
  CompiledFunction(std::shared_ptr<codegen::Tiers> tiers, std::shared_ptr<codegen::TierBuilder> builder)
      : tiers_(std::move(tiers)), builder_(std::move(builder)) {}
  void require(Order order, const char* what) const;
  void require_no_weights(const char* what) const;
  void require_fit(const Points& points, const Workspace& workspace) const;

  std::shared_ptr<codegen::Tiers> tiers_;
  std::shared_ptr<codegen::TierBuilder> builder_;  // null: settled from the start
};

}  // namespace dyntape
