// SPDX-License-Identifier: BSD-3-Clause
//
// A finer mesh for a motion that is not what its controls do, and the motion on it as the next start.
//
//   StagedNlp finer = discretize(coarse, halved(motion));
//   Solution s = optimise(finer, finer.variables(resampled(problem, motion, finer.times())), options);
#pragma once

#include <dyntape/interface/control/discretize/trajectory.h>
#include <dyntape/interface/control/problem/problem.h>

namespace dyntape {

// Node times with every interval halved.  Not the bad ones alone: where neighbours differ in length an optimum leans on
// the points that the quadrature weighs least.  Of config/tasks/arm_effort.info, a trapezoid, halving the bad ones took
// the defect from 1.3e-2 of the motion to 1.4e-3 and then, in two more rounds, to 1.0e-2; halving all takes it to 4.7e-4.
std::vector<double> halved(const Trajectory& motion);

// The motion at other times within its own: states along the cubics that have the motion's states and rates at
// neighbouring points, accelerations and controls as the scheme interpolates them.
Trajectory resampled(const Problem& problem, const Trajectory& motion, const std::vector<double>& times);

// x' (n_x x points) at every point of a motion.
Eigen::MatrixXd rates_of(const Problem& problem, Trajectory motion);

// The cubic with these values and derivatives at both ends of a length h, at a fraction of it.
Eigen::VectorXd cubic(const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                      const Eigen::VectorXd& slope_from, const Eigen::VectorXd& slope_to, double h,
                      double fraction);

}  // namespace dyntape
