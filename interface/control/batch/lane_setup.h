// SPDX-License-Identifier: BSD-3-Clause
//
// What the problems of a batch have in common, and what the work of a lane (lane_work.h) is told and finds:
//
//   LaneSetup setup{step, end, 100, 4, 1, lower, upper, true, false};
//   state.shift = 1e-3;                  // of the next backward()
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

// Of one lane: what the next piece of work is told, and what the last one found.
struct LaneState {
  double shift = 0;           // backward(): added to the curvature of the controls
  bool with_secants = false;  // backward()
  bool is_first = true;       // linearise(): there is nothing yet that secants could be learnt from

  // linearise()
  bool is_finite = false, help = false;  // the secants' help (stage_secants.h)
  double cost = 0, gap = 0, gaps = 0, largest_x = 0, largest_u = 0;
  Eigen::VectorXd slopes, sizes;  // (n_u)
  // backward()
  bool is_convex = false;
  double step_size = 0, linear = 0, curved = 0;  // the largest step; what the cost is predicted to change by
  int failed_stage = -1;
  Eigen::MatrixXd failed;  // (n_u x n_u)
};

}  // namespace dyntape
