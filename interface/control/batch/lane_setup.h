// SPDX-License-Identifier: BSD-3-Clause
//
// The data that all problems of a batch share:
//
//   LaneSetup setup{step, end, 100, 4, 1, lower, upper, true, false};
#pragma once

#include <Eigen/Core>

#include <dyntape/codegen/compiled_function.h>

namespace dyntape {

// The functions of record_shooting(), and the data that all problems share.
struct LaneSetup {
  CompiledFunction step, end;
  int intervals, n_x, n_u;
  Eigen::VectorXd lower, upper;  // (n_u) limits of the controls
  bool is_exact;                 // second derivatives; otherwise Gauss-Newton with secants
  bool has_gaps;                 // the nodes of a motion need not be the ends of its steps
};

}  // namespace dyntape
