// SPDX-License-Identifier: BSD-3-Clause
//
// A recorded function with its derivatives, compiled to native code.  Use it wherever a function is evaluated often;
// the rest of dyntape does.
//
//   Function recorded = record("norm2", 3, [](const VectorXad& x) {
//     return VectorXad::Constant(1, x.dot(x));
//   });
//   CodegenOptions options;
//   options.order = Order::kSecond;
//   const CompiledFunction f = CompiledFunction::make(recorded, options);
//   CompiledFunction::Workspace workspace(f);                    // for one evaluation at a time
//
//   double y[1], J[3], H[3], w[1] = {1};
//   f.value(x, p, y, workspace);                  // y = f(x, p), without the cost of derivatives
//   f.first_order(x, p, y, J, workspace);         // also dy/dx: non-zeros in the order of f.jacobian_pattern()
//   f.second_order(x, p, w, y, J, H, workspace);  // also sum_i w_i d2y_i/dx2, lower triangle
//
//   CompiledFunction::Workspace threads(f, 4);                   // distributes the points of a call over four threads
//   f.check(f.run(Order::kFirst, {.count = 100, .x = x, .y = y, .jacobian = J}, threads), 100);
//
// Shapes:
//
// - x (n_x), p (n_p), y (n_y).
// - w (n_w + n_y): the function's own weights (usually none), then one weight per output.
// - J, H: the non-zeros in the order of their patterns.
//
// Empty inputs may be null.  Outputs that are null are not written.  Outputs must not overlap other arguments.
//
// Properties:
//
// - A copy is cheap and shares the library.  The library stays loaded while a copy or a workspace exists.
// - Evaluation is const, and thread-safe if each thread has its own workspace.
// - Evaluation does not allocate.  Exception: with guards and no `status`, a call with more points than before.
// - y, J and H have the same bits in all three calls and for any number of points and threads.
// - These bits are equal to the interpreter's.
// - If no compiler is found, the function runs as machine code generated in the process (machine/machine_code.h).
//
// Tiers.  With options.route = Route::kTiered, make() returns at once.  Machine code evaluates first; a background
// thread compiles the C code and replaces the machine code between two evaluations of a workspace.  No evaluation
// waits.
//
// - A library found in the cache is used at once, and is final.
// - On processors without machine code, the interpreter evaluates first.
// - On such processors, if the flags ask for more than -O1, a long function is first compiled at -O1 for temporary
// use (not cached).  There is no -O0 tier, since -O0 is no faster than the interpreter.
// - If the compiler fails, the current tier stays.  One notice on stderr says so, trouble() returns the reason, and
// wait() throws.
// - A child process after fork() does not compile; its wait() throws.
// - When the last copy is destroyed, a compiler that still runs is terminated.
// - A process compiles one tiered function at a time, by options.jobs parallel compilers: this bounds the memory.
//
// Errors:
//
// - ArgumentError: an order above options.order, or a workspace of another function.
// - ToolError: the compiler fails.
// - GuardViolation, with file and line: the evaluation takes another branch than the recording.  run() returns the
// violation instead of throwing.
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
  // The buffers of one evaluation at a time.  The points of a call are distributed over `threads` threads of the
  // process (run/threads.h); 0: all of them.
  class Workspace {
   public:
    explicit Workspace(const CompiledFunction& function, unsigned threads = 1);
    ~Workspace();
    Workspace(Workspace&&) noexcept;
    Workspace& operator=(Workspace&&) noexcept;

   private:
    friend class CompiledFunction;
    std::vector<std::unique_ptr<codegen::Place>> places_;  // one per thread
  };

  static CompiledFunction make(const Function& function, const CodegenOptions& options = {});

  // --- properties of the function ---
  std::size_t n_x() const;
  std::size_t n_p() const;
  std::size_t n_w() const;  // the function's own weights
  std::size_t n_y() const;
  Order order() const;
  const Function& function() const;  // as it was recorded
  const std::string& name() const;
  // Jacobian: (n_y x n_x).  Hessian: (n_x x n_x), lower triangle.  ArgumentError if order() is too low.
  const Pattern& jacobian_pattern() const;
  const Pattern& hessian_pattern() const;

  // --- evaluation of one point; throws GuardViolation ---
  void value(const double* x, const double* p, double* y, Workspace& workspace) const;
  void first_order(const double* x, const double* p, double* y, double* jacobian, Workspace& workspace) const;
  void second_order(const double* x, const double* p, const double* w, double* y, double* jacobian,
                    double* hessian, Workspace& workspace) const;

  // --- evaluation of many points, also for functions with weights; returns violated guards ---
  // With options.lanes, the widest kernel that the processor supports evaluates lane_width() points at once, if the
  // points are contiguous.
  [[nodiscard]] Violation run(Order order, const Points& points, Workspace& workspace) const;
  // Evaluates one point with memory on the stack; several threads may do so at once.  Returns false, and evaluates
  // nothing, if a workspace is needed: for long, interpreted and tiered functions.
  [[nodiscard]] bool run_without_workspace(Order order, const Points& point, Violation& violation) const;
  // The kernel that does so, for callers that keep it: it is called with as many doubles of work.  Null: a workspace is
  // needed, or the kernel runs code of others, whose exceptions run() passes on.
  [[nodiscard]] dyntape_run kernel_without_workspace(Order order) const;
  static constexpr std::size_t kStackDoubles = 256;
  std::size_t lane_width() const;  // 1 without options.lanes, or while the function is interpreted
  // Throws GuardViolation if `violation` is one.  The message names the comparison and, for several points, the
  // point.
  void check(const Violation& violation, std::size_t points = 1) const;

  // --- one evaluation with checked sizes, for small programs and tests ---
  // x, p and w: any vectors of doubles (numbers.h).
  struct Evaluation {
    std::vector<double> y, jacobian, hessian;
  };
  Evaluation evaluate(Order order, Numbers x, Numbers p = {}, Numbers w = {}) const;

  // --- the current tier and its origin ---
  Route route() const;  // kCompiled, kMachineCode or kInterpreter
  const Timings& timings() const;
  std::size_t operations(Order order) const;  // of one point
  const std::string& source_path() const;     // "" if interpreted, or without cache
  const std::string& compiler() const;        // version of the compiler; "" if interpreted

  // --- tiers ---
  Tier tier() const;
  bool is_settled() const;      // true: no other tier will follow
  void wait() const;            // until is_settled(); throws the error that ended the compilation
  std::string trouble() const;  // the reason of a failed compilation, or ""

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
