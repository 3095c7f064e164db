// SPDX-License-Identifier: BSD-3-Clause
//
// The functions and limits of a controller that is printed: a problem on its mesh, in nominal values.
//
//   const ControllerParts parts = controller_parts(problem, options);
//   parts.stage.value    (z; t, p) -> x_next | rows | cost                       of an interval; z = (x, u)
//   parts.stage.first    (z; t, p) -> x_next | rows | residuals r, and d: cost = 1/2 r.r + d
//   parts.end.value      (x; t, p) -> rows | cost
//   parts.end.first      (x; t, p) -> rows | residuals | d
//
// r has the roots of step length, weight and nominal cost in it, so its Jacobian J gives the Hessian J^T J.  d, one output
// if there are costs with a Gauss-Newton curvature of their own (penalties.h), else none, comes before their residuals.
//
// Errors: those of controller.h.
#pragma once

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/interface/control/printed/printed_controller.h>

namespace dyntape {

// sign (quantity - bound) / nominal >= 0; a quantity is an entry of z, then a row.
struct ControllerSide {
  std::size_t entry;
  double factor;  // sign / nominal
  double bound;
  std::string name;  // "upper limit of force"
};

struct PointFunctions {
  Function value, first;
  std::size_t rows = 0, squares = 0, curvatures = 0;
  bool has_plain = false;
  std::vector<ControllerSide> sides;
  std::size_t hard = 0;  // the first sides
};

struct ControllerParts {
  Problem problem;  // with the scheme's rate (Scheme::taken_by)
  PointFunctions stage, end;
  double step = 0, cost_unit = 1;
  std::vector<double> times;                  // (intervals + 1) s
  std::vector<double> nominal;                // (n_x + n_u)
  std::vector<double> guess;                  // (intervals + 1) rows of z
  std::vector<std::string> parameter_names;   // of the functions: "t", then the problem's
  std::vector<std::size_t> caller_parameter;  // of each after "t", the entry of the problem's parameters
  int n_parameters = 0;                       // of the problem
};

ControllerParts controller_parts(const Problem& problem, const ControllerOptions& options);

// (t, p) of the functions at a time.
Eigen::VectorXd controller_parameters(const Problem& taken, double t);

}  // namespace dyntape
