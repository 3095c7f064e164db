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
//   CompiledFunction::Workspace workspace(f);                    // one a thread
//
//   double y[1], J[3], H[3], w[1] = {1};
//   f.value(x, p, y, workspace);                  // y = f(x, p): a line search pays for values only
//   f.first_order(x, p, y, J, workspace);         // and dy/dx; f.jacobian_pattern() says where
//   f.second_order(x, p, w, y, J, H, workspace);  // and sum_i w_i d2y_i/dx2, lower triangle
//
// Shapes.  x (n_x), p (n_p), w (n_w + n_y: the function's own weights, mostly none, then one an output), y
// (n_y); J, H: the non-zeros in the order of their patterns.  Empty blocks may be null; outputs that are null
// are not written.  Outputs overlap with nothing.
//
// A copy is cheap and shares the library, which stays loaded while any copy lives.  Evaluation is const and
// thread-safe on separate workspaces, and allocates nothing.  y, J and H have the same bits in all three
// calls, and in the strict profile the same as the interpreter's, which is what runs where there is no
// compiler.
//
// Errors.  ArgumentError: an order that was not asked for, a workspace of another function.  ToolError: the
// compiler fails.  GuardViolation, with file and line: the evaluation leaves a branch that was recorded; the
// run() calls report it in their return value instead.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/codegen/options.h>
#include <dyntape/codegen/pipeline.h>
#include <dyntape/codegen/run/lanes.h>
#include <dyntape/codegen/store/abi.h>

namespace dyntape {

using Strides = dyntape_strides;

// What to evaluate: `lanes` points one after the other.  Null strides: without gaps; a stride of 0: one block
// for all.
struct Points {
  std::size_t lanes = 1;
  const double *x = nullptr, *p = nullptr, *w = nullptr;
  double *y = nullptr, *jacobian = nullptr, *hessian = nullptr;
  const Strides* strides = nullptr;
  std::uint32_t* status = nullptr;  // a word a lane: 0, or 1 + index of the first violated guard
};

// The first point at which a recorded branch was left; false if there is none.
struct Violation {
  std::uint32_t guard = 0;  // 1 + index
  std::size_t lane = 0;
  explicit operator bool() const { return guard != 0; }
};

class CompiledFunction {
 public:
  // Room for one evaluation at a time.
  class Workspace {
   public:
    explicit Workspace(const CompiledFunction& function);

   private:
    friend class CompiledFunction;
    std::shared_ptr<const void> owner_;
    std::vector<double> work_;
    codegen::AlignedRoom lanes_;
    std::vector<std::uint32_t> status_;
    std::vector<Interpreter::Workspace> interpreters_;
  };

  static CompiledFunction make(const Function& function, const CodegenOptions& options = {});
  // Of what the pipeline has made with these options.
  static CompiledFunction from(codegen::Product product, const CodegenOptions& options);

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
  // With options.lanes several points are evaluated at once, by the widest kernel that the processor runs.
  [[nodiscard]] Violation run(Order order, const Points& points, Workspace& workspace) const;
  // For those who keep their points in lanes: blocks of lane_width() = W points side by side, entry i of lane l
  // of block b of an array of n entries a point at [(b n + i) W + l].  points.lanes is a multiple of W; strides
  // count doubles from one block to the next.  ArgumentError for another number of points.
  [[nodiscard]] Violation run_in_lanes(Order order, const Points& points, Workspace& workspace) const;
  std::size_t lane_width() const;  // 1: interpreted, or without options.lanes
  // Throws GuardViolation if there is one, naming the comparison and, of several points, which.
  void check(const Violation& violation, std::size_t lanes = 1) const;

  // --- one evaluation with all sizes checked, for small programs and tests ---
  struct Evaluation {
    std::vector<double> y, jacobian, hessian;
  };
  Evaluation evaluate(Order order, const std::vector<double>& x, const std::vector<double>& p = {},
                      const std::vector<double>& w = {}) const;

  // --- how it was made ---
  Route route() const;  // kCompiled or kInterpreter
  const Timings& timings() const;
  std::size_t operations(Order order) const;  // of one point
  const std::string& source_path() const;     // empty: interpreted, or without cache
  const std::string& compiler() const;        // its version; empty: interpreted

 private:
  struct Kernels;
  explicit CompiledFunction(std::shared_ptr<const Kernels> kernels) : kernels_(std::move(kernels)) {}
  void require(Order order, const char* what) const;
  void require_no_weights(const char* what) const;

  std::shared_ptr<const Kernels> kernels_;
};

}  // namespace dyntape
