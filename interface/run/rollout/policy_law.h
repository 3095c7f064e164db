// SPDX-License-Identifier: BSD-3-Clause
//
// A recorded function of the state and of parameters as the commands of a motion, u = f(x, p).  Internal.
//
//   evaluate_law(values, workspace, Order::kValue, points, strides, n_x);           // many states
//   law_slopes(derivatives, workspace, model, x, p, slopes);                        // one state
//
// GuardViolation: a finite state takes another branch than the recording.  Rows of states that are not finite are NaN.
#pragma once

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/model/model.h>

namespace dyntape {

void evaluate_law(const CompiledFunction& law, CompiledFunction::Workspace& workspace, Order order,
                  Points points, const Strides& strides, std::size_t n_x);

// Of one state: u; du/dx along increments of the moving frame (n_u x n_t), du/dp (n_u x n_p).
struct LawSlopes {
  Eigen::VectorXd u;
  Eigen::MatrixXd by_x, by_p;
};

// `derivatives`: f with x and p as its variables (all_as_variables).  x (n_x), p (n_p).
struct LawPoint {
  const double *x, *p;
  std::size_t n_x, n_p;
};
void law_slopes(const CompiledFunction& derivatives, CompiledFunction::Workspace& workspace,
                const dynamics::Model<double>& model, const LawPoint& at, LawSlopes& slopes);

}  // namespace dyntape
