// SPDX-License-Identifier: BSD-3-Clause
//
// Coordinates, velocities, accelerations and torques of a task's motion over time.
//
//   const Curves c = curves_of(task, motion);
//   c.tau.row(0);                               // of the first driven joint, at motion.t
#pragma once

#include <dyntape/interface/files/task/task.h>

namespace dyntape {

// Positions, velocities, accelerations (joints x points) and driving torques (controls x points), all in
// physical units.
struct Curves {
  Eigen::MatrixXd q, v, a, tau;
};
// (N m or N) of the joint with that degree of freedom.
double effort_limit(const dynamics::Model<double>& model, int dof);

// Names of the controls in tables: torques "tau.elbow", forces "f.rotor".
std::vector<std::string> control_columns(const Task& task);

Curves curves_of(const Task& task, const Trajectory& motion);

}  // namespace dyntape
