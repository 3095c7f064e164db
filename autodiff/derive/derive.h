// SPDX-License-Identifier: BSD-3-Clause
//
// Differentiation, graph to graph: a derivative is a Function like any other, so that derivatives of
// derivatives, simplification, printing and evaluation need nothing new.
//
//   Function d = jvp(f);                        // (x, p, [w, dx]) -> J dx     weights: those of f, then dx
//   Function g = vjp(f);                        // (x, p, [w, l])  -> J^T l    weights: those of f, then l
//   Derivatives D = derive(f, Order::kSecond);  // (x, p, [w, l])  -> y | J non-zeros | H non-zeros
//                                               // D.jacobian and D.hessian say where they are
//
// J = dy/dx (n_y x n_x); H = sum_i l_i d2y_i/dx2 (n_x x n_x), lower triangle, each entry once.  Parameters
// are not differentiated; all_as_variables() (function.h) turns them into variables.
//
// A sparse Jacobian is swept forward or in reverse, block by block of rows and columns that hang together,
// whichever needs fewer operations; a dense row among sparse ones is taken in reverse and the others forward.
// What a select does not take contributes exactly zero, never 0 * inf, and neither does a weight that is zero: a
// flow remembers the conditions under which it contributes (flow.h).  Between derivatives 0 * inf is NaN, in both
// directions (Poles, in ops.def).
//
// Derivatives that would append more than 134 million nodes (3 GB) are refused, RecordingError: dense Jacobians of
// large functions, such as that of the forward dynamics of a thousand joints, for which analytic derivatives exist.
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

// Of variables only, as a callee has them, by the seeds that are there (callee.h):
// (x, seeds, whether weights among them are there) -> J dx or J^T l.
Function jvp_by_seeds(const Function& function, const Seeds& seeds);
Function vjp_by_seeds(const Function& function, const Seeds& seeds);

// With kSecond the weights of the Hessian are appended to the weights of the function (n_y more).
Derivatives derive(const Function& function, Order order);

// Only the non-zeros of the Jacobian, or of the lower triangle of the weighted Hessian.
struct SparseFunction {
  Function function;
  Pattern pattern;
};
SparseFunction sparse_jacobian(const Function& function);
SparseFunction sparse_hessian(const Function& function);

}  // namespace dyntape
