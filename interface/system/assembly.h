// SPDX-License-Identifier: BSD-3-Clause
//
// A start at which loops are closed, near the one that was given.
//
//   Eigen::VectorXd q = scene.q, v = scene.v;
//   const double moved = close_loops(scene.robot, q, v);        // largest increment of a joint (rad or m)
//
// q by the method of Gauss and Newton, which goes the shortest way to e(q) = 0 in joint increments; v: the nearest in the
// sense of the kinetic energy that keeps the loops closed, M (v+ - v) = G^T mu, G v+ = 0.  What is closed stays as it is, to
// rounding.  ArgumentError with what is left where loops cannot be closed from there.
#pragma once

#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

double close_loops(const RobotScene& scene, Eigen::VectorXd& q, Eigen::VectorXd& v);

// Largest entry of the loops' errors (m, rad); 0 without loops.
double loop_error(const RobotScene& scene, const Eigen::VectorXd& q);

}  // namespace dyntape
