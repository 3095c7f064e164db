// SPDX-License-Identifier: BSD-3-Clause
//
// Contact problems with their corners rounded: Newton's method where contacts of one body depend on each other.
//
//   solve_smoothed(problem, p, [&](const Eigen::VectorXd& p) { return good_enough(p); });
//
// Gauss-Seidel, and Newton's method on the equations as they are, come to a point of the solution set.  Where rows depend
// on each other this set is often one that touches the cones only, and neither gets there.  Rounded by tau > 0 (N s),
//   F(p) = p - P(p - rho w(p)),      P(z) = proj_K(z) where tau = 0,      |u_t| ~ sqrt(|u_t|^2 + (tau / rho)^2),
// with w of contact_problem.h, the derivatives are regular for every positive semidefinite D, and the solutions for tau -> 0 go
// to the middle of the set.  P takes the two eigenvalues l = z_0 -+ |z_t| of z on the cone |z_t| <= z_0 to
// (l + sqrt(l^2 + 4 tau^2)) / 2, so p and w are scaled to (mu p_n, p_t) and (w_n / mu, w_t).
//
// Source: M. Fukushima, Z.-Q. Luo, P. Tseng, Smoothing functions for second-order-cone complementarity problems, SIAM J.
// Optim. 12(2), 2002.
#pragma once

#include <dyntape/dynamics/contact/contact_problem.h>
#include <functional>

namespace dyntape::dynamics {

// From p = 0 with tau that shrinks, until done(p), which is asked after each of kMostSmoothedSteps steps of Newton's method.
constexpr int kMostSmoothedSteps = 150;
bool solve_smoothed(const ContactProblem& problem, Eigen::VectorXd& p,
                    const std::function<bool(const Eigen::VectorXd&)>& done);

}  // namespace dyntape::dynamics
