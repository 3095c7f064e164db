// SPDX-License-Identifier: BSD-3-Clause
//
// Whether a motion whose cost has no slope is a minimum, without second derivatives: each control is changed by a few sines over the
// horizon, both ways, and all these motions are run side by side.
#pragma once

#include <vector>

#include <dyntape/interface/control/discretize/end_cost.h>
#include <dyntape/interface/control/discretize/shooting_steps.h>

namespace dyntape {

struct TrialChange {
  int control;
  Eigen::VectorXd shape;  // (N)
  double length;          // of the way that costs less
};

// Of the motion of the controls u (n_u x N), which costs `cost`: the changes along which the cost falls by the square, those whose
// mean both ways is below it.
std::vector<TrialChange> falling_changes(const Problem& problem, ShootingSteps& steps, EndCost& end,
                                         const Eigen::VectorXd& parameters_at_end, const Eigen::MatrixXd& u,
                                         double cost);

}  // namespace dyntape
