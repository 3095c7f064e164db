// SPDX-License-Identifier: BSD-3-Clause
//
// Whether motors that follow a table hold the robot, though they are told once a step: from one step to the next increments go as
//   x+ = (exp(Z h) by x and u) (x, -stiffness q - damping v),       Z = (A, B; 0, 0), lags of motors in it,
// whatever the scheme.  A mode that changes its sign from step to step and grows, or grows a hundredfold over the motion,
// is trouble; modes that grow however short the steps are, as of a pendulum upside down, are the robot's own.
// With a stiffness and no damping all grow, at a rate of stiffness h / (4 mass): a little of that is what such motors do.
//
//   servo_trouble(scene, A, B)       // "", or why not, with the longest step
#pragma once

#include <string>

#include <dyntape/interface/files/scene/scene.h>

namespace dyntape {

// Of a scene whose commands follow; A and B as of a LinearMotion (stability.h).
std::string servo_trouble(const Scene& scene, const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

}  // namespace dyntape
