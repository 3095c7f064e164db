// SPDX-License-Identifier: BSD-3-Clause
//
// Closes the loops of a robot: finds a start near the given one.
//
//   Eigen::VectorXd q = scene.q, v = scene.v;
//   const double moved = close_loops(scene.robot, q, v);        // largest increment of a joint (rad or m)
//
// Method.  q: Gauss-Newton, the shortest way to e(q) = 0 in joint increments.  v: the nearest in kinetic energy that
// keeps the loops closed, M (v+ - v) = G^T mu, G v+ = 0.  Closed loops stay unchanged, to rounding.
//
// Errors.  ArgumentError, with the remaining error, if the loops cannot be closed from the given start.
#pragma once

#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

double close_loops(const RobotScene& scene, Eigen::VectorXd& q, Eigen::VectorXd& v);

// Largest entry of the loops' errors (m, rad); 0 without loops.
double loop_error(const RobotScene& scene, const Eigen::VectorXd& q);

}  // namespace dyntape
