// SPDX-License-Identifier: BSD-3-Clause
//
// Compares the derivatives of a nonlinear program with finite differences of its functions.
//
//   const DerivativeCheck check = check_derivatives(nlp, start);
//   for (const DerivativeMismatch& m : check.mismatches) std::cerr << m.row << " by " << m.variable << ...;
//
// Method.  Fourth-order central differences (error h^4, h = 5e-4 of a nominal value, shorter if these disagree) at a
// random point near the given one.  Gradient and Jacobian are compared with differences of the values.  The Hessian
// is compared with differences of the gradient of sigma f + lambda . g for random multipliers.
//
// - Columns that share no row are perturbed together (greedy colouring), so the number of evaluations does not grow
// with the mesh.
// - A Hessian with more than 64 entries in a row is compared along 16 random directions in all variables; the cost
// is proportional to its non-zeros.  If a direction disagrees, it is compared column by column.
// - An entry outside the pattern appears as a mismatch in its row.
// - Differences that rounding of a row's terms explains are not errors.
// - An entry is a mismatch only if it disagrees at each of three random points.  A single disagreement means a kink
// nearby.
// - Errors are relative to the program's nominal values (Nlp::scaling); mismatches are in its own units.
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
  bool second_order = true;  // compare the Hessian, if the program has an exact one
};

struct DerivativeMismatch {
  std::string row, variable;  // "objective", a constraint, or "gradient of the Lagrangian by ..."
  double given, difference;
};

struct DerivativeCheck {
  double worst_first = 0, worst_second = 0;  // relative, without the part that rounding explains
  std::size_t hessian_directions =
      0;  // number of directions in which the Hessian was compared; 0: column by column
  std::vector<DerivativeMismatch> mismatches;
  bool good() const { return mismatches.empty(); }
};

DerivativeCheck check_derivatives(Nlp& problem, const std::vector<double>& near,
                                  const DerivativeCheckOptions& options = {});

}  // namespace dyntape
