// SPDX-License-Identifier: BSD-3-Clause
//
// Checks whether motors that follow a table hold the robot, although they get a command only once a step.  From one
// step to the next, increments follow
//   x+ = (exp(Z h) by x and u) (x, -stiffness q - damping v),       Z = (A, B; 0, 0), with lags of motors,
// for every scheme.  A mode is trouble if it grows and changes its sign from step to step, or grows a hundredfold
// over the motion.  Modes that grow with any step, as of an inverted pendulum, belong to the robot.  With a
// stiffness and no damping all modes grow, at a rate of stiffness h / (4 mass); a small growth of this kind is
// accepted.
//
//   servo_trouble(scene, A, B)       // "", or the reason with the longest step
#pragma once

#include <string>

#include <dyntape/interface/files/scene/scene.h>

namespace dyntape {

// For a scene whose commands follow a table; A and B as in a LinearMotion (stability.h).
std::string servo_trouble(const Scene& scene, const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

}  // namespace dyntape
