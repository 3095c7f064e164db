// SPDX-License-Identifier: BSD-3-Clause
//
// Returns the least of all impulses that solve a contact problem with the same velocities.
//
//   const std::optional<Eigen::VectorXd> least = least_impulses(problem, p, 1e-10);   // p: a solution; 1e-10 m/s: at rest
//
// Where rows of D depend on each other p is not unique.  With u = D p + b fixed, the laws of contact_problem.h say of each contact
//   u_n > 0: p = 0      u_n = 0, u_t != 0: p = t (1, -mu u_t / |u_t|), t >= 0      u = 0: p in K
// and the least |p| with D p as it is lies on the projection of a vector of the range of D onto these cones, whose dual is solved by
// Newton's method.  The least p is unique and has every symmetry that the problem has.  Velocities below `still` count as zero.
//
// None where p is unique, or where Newton's method does not get to rounding.
//
// Source: R. T. Rockafellar, Convex Analysis, 1970, section 31; L. Qi, J. Sun, A nonsmooth version of Newton's method, 1993.
#pragma once

#include <optional>

#include <dyntape/dynamics/contact/contact_problem.h>

namespace dyntape::dynamics {

std::optional<Eigen::VectorXd> least_impulses(const ContactProblem& problem, const Eigen::VectorXd& p,
                                              double still);

}  // namespace dyntape::dynamics
