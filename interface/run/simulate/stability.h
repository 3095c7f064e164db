// SPDX-License-Identifier: BSD-3-Clause
//
// How long a step may be.  A motion near a state is made of modes exp(lambda t); an explicit step follows one only while
// h lambda lies within its region of stability:
//   runge-kutta-4         |1 + z + z^2/2 + z^3/6 + z^4/24| <= 1,  z = h lambda
//   semi-implicit-euler   h |lambda| <= 2 (sqrt(1 + d^2) - d),  d = -Re lambda / |lambda|, of a mode that oscillates;
//                         2 of one that only decays
// and any other scheme here follows all.  An oscillator of stiffness k and mass m: h <= 2 / sqrt(k/m); a damper d: 2 m / d.
//
//   stability_trouble(scene, q, v)      // "": steps of scene.step are short enough there
//
// Motors that follow a table are told once a step, whatever the scheme, and late by up to a step (servo_trouble.h).
#pragma once

#include <complex>
#include <string>

#include <dyntape/interface/files/scene/scene.h>

namespace dyntape {

// x' = A x + B u by increments of q and v about a state, and of what the motors are told about nothing.
struct LinearMotion {
  Eigen::MatrixXd A, B;  // (2 nv x 2 nv), (2 nv x driven joints)
};
LinearMotion linear_motion(const RobotScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v);

// Infinite where there is no limit, as of modes that grow by themselves.
double longest_step(Integrator integrator, std::complex<double> mode);

// Why steps of the scene's length cannot follow its motion about (q, v), with the longest that can, or "".
std::string stability_trouble(const Scene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v);

}  // namespace dyntape
