// SPDX-License-Identifier: BSD-3-Clause
//
// Solves contact problems with rounded corners by Newton's method.  Use it if contacts of one body depend on each
// other.
//
//   solve_smoothed(problem, p, [&](const Eigen::VectorXd& p) { return good_enough(p); });
//
// Gauss-Seidel, and Newton's method on the unsmoothed equations, converge to a point of the solution set.  If rows
// depend on each other, this set often only touches the cones, and neither method reaches it.  With tau > 0 (N s),
//   F(p) = p - P(p - rho w(p)),      P(z) = proj_K(z) for tau = 0,      |u_t| ~ sqrt(|u_t|^2 + (tau / rho)^2),
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

// Starts from p = 0 and decreases tau until done(p) is true; calls done(p) after each of at most kMostSmoothedSteps
// steps of Newton's method.
constexpr int kMostSmoothedSteps = 150;
bool solve_smoothed(const ContactProblem& problem, Eigen::VectorXd& p,
                    const std::function<bool(const Eigen::VectorXd&)>& done);

}  // namespace dyntape::dynamics
