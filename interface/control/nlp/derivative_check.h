// SPDX-License-Identifier: BSD-3-Clause
//
// Are the derivatives of a program those of its functions?
//
//   const DerivativeCheck check = check_derivatives(nlp, start);
//   for (const DerivativeMismatch& m : check.mismatches) std::cerr << m.row << " by " << m.variable << ...;
//
// The derivatives are compared with fourth-order central differences (error h^4, h = 5e-4 of a nominal value, shorter where
// that disagrees) at a random point near the given one: gradient and Jacobian with differences of the values, the Hessian with
// differences of the gradient of sigma f + lambda . g for random multipliers.  Columns that share no row are
// moved together (greedy colouring), so the number of evaluations does not grow with the mesh.  A Hessian with
// more than 64 entries in a row, whose columns would have to be moved apart, is compared along 16 random directions, in
// which all variables move: an effort of its non-zeros, not of their number times the variables.  Where that disagrees it is
// compared column by column.  An entry outside the pattern shows as a mismatch in its row.  What the rounding of a row's terms makes of a difference is no
// error.  An entry is a mismatch where it is one at each of three such points: a wrong derivative is wrong everywhere, and
// one that disagrees at one point alone is right, but next to a kink.  Errors are measured in the program's nominal values (Nlp::scaling); mismatches are told in its own units.
//
// Formula: f'(x) = (8 (f(x + h) - f(x - h)) - (f(x + 2h) - f(x - 2h))) / 12h.
//
// Errors: NumericalError if the functions are not finite around the point.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <dyntape/interface/control/nlp/nlp.h>

namespace dyntape {

struct DerivativeCheckOptions {
  unsigned seed = 1;
  bool second_order = true;  // where the program has the exact Hessian
};

struct DerivativeMismatch {
  std::string row, variable;  // "objective", a constraint, or "gradient of the Lagrangian by ..."
  double given, difference;
};

struct DerivativeCheck {
  double worst_first = 0, worst_second = 0;  // relative, beyond rounding, as above
  std::size_t hessian_directions = 0;        // that the Hessian was compared along; 0: column by column
  std::vector<DerivativeMismatch> mismatches;
  bool good() const { return mismatches.empty(); }
};

DerivativeCheck check_derivatives(Nlp& problem, const std::vector<double>& near,
                                  const DerivativeCheckOptions& options = {});

}  // namespace dyntape
