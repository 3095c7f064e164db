// SPDX-License-Identifier: BSD-3-Clause
//
// The outputs of a function without zeros and duplicates.  Use it for large functions whose results are sparse: the
// time of a large function is bounded by the numbers that it writes (docs/measured.md).
//
//   Function f = record_robot_function(talos, RobotFunction("id-derivatives"));   // 3675 outputs, half of them zeros
//   const NonzeroOutputs nonzero = nonzero_outputs(f);                             // about 1800
//   CompiledFunction compiled = CompiledFunction::make(nonzero.function, options);
//   compiled.value(x, p, values.data(), workspace);
//   nonzero.place[k]                       // of output k: its index in `values`; kZero: the output is zero
//   nonzero.expand(values.data(), y);      // y of f, with the same bits
//
// Outputs that are the same node are one value: a symmetric matrix that is recorded once becomes a triangle.  Zeros
// are the outputs that are +0 or -0 for every argument in the recording.  A constant other than zero remains an
// output.
#pragma once

#include <cstdint>
#include <vector>

#include <dyntape/autodiff/graph/function.h>

namespace dyntape {

struct NonzeroOutputs {
  static constexpr std::int32_t kZero = -1, kNegativeZero = -2;

  Function function;  // the same inputs, guards and names; the non-zero outputs in order
  std::vector<std::int32_t>
      place;  // (n_y of the whole function) index among the non-zeros, kZero or kNegativeZero

  void expand(const double* nonzeros, double* outputs) const;
};

NonzeroOutputs nonzero_outputs(const Function& function);

}  // namespace dyntape
