// SPDX-License-Identifier: BSD-3-Clause
//
// Functions at the points where derivatives go wrong: values, gradients and Hessians known by hand.
//
//   for (const EdgeCase& c : edge_cases()) ... c.f recorded, evaluated at c.x by some route, held to c.value
//   ...
//
// The cases are data, so that every route (interpreter, generated code) is held to the same ones.  Where a
// convention decides, it is the one written in ops.def.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <dyntape/autodiff/record/record.h>

namespace dyntape::testing {

struct EdgeCase {
  std::string name;
  std::function<AD(const VectorXad& x)> f;
  std::vector<double> x;
  double value;
  std::vector<double> gradient;  // (n_x); empty: not claimed
  std::vector<double> hessian;   // (n_x x n_x), row by row; empty: not claimed

  // What the case is recorded at: away from the edge, as a user would.
  Function recorded() const;
};

std::vector<EdgeCase> edge_cases();
std::vector<EdgeCase> extreme_cases();  // those of them at extremes: large, small, at the ends of ranges

// Equal to 1e-14 relative, or to 1e-15 of a scale; zeros of either sign, infinities and NaN as such.
bool agrees(double got, double expected, double scale = 0);

}  // namespace dyntape::testing
