// SPDX-License-Identifier: BSD-3-Clause
//
// The outputs of a function that are worth writing: those that are not zero everywhere, and each of them once.
//
//   Function f = record_robot_function(talos, RobotFunction("id-derivatives"));   // 3675 outputs, half of them zeros
//   const NonzeroOutputs nonzero = nonzero_outputs(f);                             // about 1800
//   CompiledFunction compiled = CompiledFunction::make(nonzero.function, options);
//   compiled.value(x, p, values.data(), workspace);
//   nonzero.place[k]                       // of output k: its index in `values`; kZero: it is zero
//   nonzero.expand(values.data(), y);      // y as f has it, with the same bits
//
// What is written bounds large functions (docs/measured.md), so that whoever can work with non-zeros should.  Outputs that are
// one node are one value: of a symmetric matrix that is recorded once, a triangle is left.  Zeros are those of the recording:
// +0 or -0 for every argument.  A constant other than zero stays an output.
#pragma once

#include <cstdint>
#include <vector>

#include <dyntape/autodiff/graph/function.h>

namespace dyntape {

struct NonzeroOutputs {
  static constexpr std::int32_t kZero = -1, kNegativeZero = -2;

  Function function;  // the same inputs, guards and names; its outputs are the non-zeros, in order
  std::vector<std::int32_t> place;  // (n_y of the whole) index among the non-zeros, kZero or kNegativeZero

  void expand(const double* nonzeros, double* outputs) const;
};

NonzeroOutputs nonzero_outputs(const Function& function);

}  // namespace dyntape
