// SPDX-License-Identifier: BSD-3-Clause
//
// Prints a recorded function as formulas, in LaTeX or MathML.  Use it for reports and to check a recording.
//
//   std::cout << to_latex(f);                  // \[ y_{0} = \operatorname{sin}\left(x_{0}\right) \]
//   std::cout << to_mathml(f, {.open = "<math display=\"block\">"});
//
// A value that several others use is an equation of its own.  Guards are not printed.
#pragma once

#include <string>

#include <dyntape/autodiff/graph/function.h>

namespace dyntape {

// Texts around an equation, and letters of results and shared values.  Inputs have their names, or x, p and w.
struct FormulaStyle {
  std::string open{}, close{};  // empty: \[ and \], or <math display="block"> and </math>
  std::string input = "x", output = "y", shared = "v";
};

// One equation a line, in topological order.
std::string to_latex(const Function& function, const FormulaStyle& style = {});
std::string to_mathml(const Function& function, const FormulaStyle& style = {});

// Values that are used more than once and are no inputs, constants or outputs.
std::size_t shared_values(const Function& function);

}  // namespace dyntape
