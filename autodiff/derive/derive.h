// SPDX-License-Identifier: BSD-3-Clause
//
// Differentiates a recorded function and returns the derivative as another recorded function.  Use this header to
// get derivative graphs; CompiledFunction (codegen/compiled_function.h) derives and compiles in one call.  A
// derivative is an ordinary Function: simplify, print, evaluate or derive it again.
//
//   Function d = jvp(f);                        // (x, p, [w, dx]) -> J dx     weights: those of f, then dx
//   Function g = vjp(f);                        // (x, p, [w, l])  -> J^T l    weights: those of f, then l
//   Derivatives D = derive(f, Order::kSecond);  // (x, p, [w, l])  -> y | J non-zeros | H non-zeros
//                                               // D.jacobian and D.hessian: the positions of the non-zeros
//
// J = dy/dx (n_y x n_x).  H = sum_i l_i d2y_i/dx2 (n_x x n_x), lower triangle, each entry once.  Parameters are not
// differentiated; all_as_variables() (function.h) turns parameters into variables.
//
// Method.  The rows and columns of a sparse Jacobian are split into independent blocks.  Each block is swept forward
// or in reverse, whichever needs fewer operations.  A dense row among sparse rows is swept in reverse, the others
// forward.
//
// Zero times infinity.  The side that a select does not take contributes exactly zero, never 0 * inf.  A weight of
// zero also contributes exactly zero: each flow stores the conditions under which it contributes (flow.h).  In all
// other products of derivatives 0 * inf is NaN, forward and in reverse (Poles, in ops.def).
//
// Errors.  RecordingError if the derivatives would append more than 134 million nodes (3 GB).  Dense Jacobians of
// large functions reach this limit, e.g. the forward dynamics of a thousand joints.  Use the analytic derivatives
// for these.
#pragma once

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/graph/pattern.h>

namespace dyntape {

enum class Order { kValue = 0, kFirst = 1, kSecond = 2 };

struct Derivatives {
  Order order = Order::kValue;
  Function function;  // outputs: y (n_y), then jacobian.nnz(), then hessian.nnz()
  std::size_t n_y = 0;
  Pattern jacobian;  // (n_y x n_x), empty below first order
  Pattern hessian;   // (n_x x n_x), lower triangle, empty below second order
};

Function jvp(const Function& function);
Function vjp(const Function& function);

// Products of a callee, a function of variables only, with the seeds that are present (callee.h): (x, seeds, for
// each weight among the seeds whether it is present) -> J dx or J^T l.
Function jvp_by_seeds(const Function& function, const Seeds& seeds);
Function vjp_by_seeds(const Function& function, const Seeds& seeds);

// With kSecond, the weights of the Hessian (n_y) follow the function's own weights.
Derivatives derive(const Function& function, Order order);

// Computes only the non-zeros of the Jacobian, or of the lower triangle of the weighted Hessian.
struct SparseFunction {
  Function function;
  Pattern pattern;
};
SparseFunction sparse_jacobian(const Function& function);
SparseFunction sparse_hessian(const Function& function);

}  // namespace dyntape
