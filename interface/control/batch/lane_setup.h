// SPDX-License-Identifier: BSD-3-Clause
//
// What the problems of a batch have in common:
//
//   LaneSetup setup{step, end, 100, 4, 1, lower, upper, true, false};
#pragma once

#include <Eigen/Core>

#include <dyntape/codegen/compiled_function.h>

namespace dyntape {

// The functions of record_shooting(), and what all problems have in common.
struct LaneSetup {
  CompiledFunction step, end;
  int intervals, n_x, n_u;
  Eigen::VectorXd lower, upper;  // (n_u) limits of the controls
  bool is_exact;                 // second derivatives, else Gauss-Newton with secants
  bool has_gaps;                 // a motion's nodes need not be ends of its steps
};

}  // namespace dyntape
