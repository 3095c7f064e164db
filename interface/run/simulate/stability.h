// SPDX-License-Identifier: BSD-3-Clause
//
// The longest stable step of an integrator.  Near a state a motion is a sum of modes exp(lambda t); an explicit
// scheme is stable for a mode if h lambda is in its region of stability:
//   runge-kutta-4         |1 + z + z^2/2 + z^3/6 + z^4/24| <= 1,  z = h lambda
//   semi-implicit-euler   h |lambda| <= 2 (sqrt(1 + d^2) - d),  d = -Re lambda / |lambda|, for an oscillating mode;
//                         2 for a mode that only decays
// All other schemes here have no such limit.  Examples: stiffness k and mass m, h <= 2 / sqrt(k/m); damper d, h <= 2
// m / d.
//
//   stability_trouble(scene, q, v)      // "": scene.step is short enough at this state
//
// Motors that follow a table get one command per step, with any scheme, so they lag by up to a step
// (servo_trouble.h).
#pragma once

#include <complex>
#include <string>

#include <dyntape/interface/files/scene/scene.h>

namespace dyntape {

// Linearisation x' = A x + B u in increments of q and v about a state, and of the motors' commands about zero.
struct LinearMotion {
  Eigen::MatrixXd A, B;  // (2 nv x 2 nv), (2 nv x driven joints)
};
LinearMotion linear_motion(const RobotScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v);

// Returns infinity if there is no limit, also for growing modes.
double longest_step(Integrator integrator, std::complex<double> mode);

// Returns why the scene's step is too long near (q, v), with the longest valid step; or "".
std::string stability_trouble(const Scene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v);

}  // namespace dyntape
