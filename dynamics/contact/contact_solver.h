// SPDX-License-Identifier: BSD-3-Clause
//
// Solves contact problems (contact_problem.h).
//
//   ContactSolver solver;
//   Eigen::VectorXd p = Eigen::VectorXd::Zero(4);          // initial guess, e.g. of the previous step
//   if (!solver.solve(problem, p)) ... solver.residual()
//
// Method.  Block Gauss-Seidel, one contact at a time, each exactly; and Newton's method on the equations of Alart
// and Curnier.  If both are slow, the corners of the cones are smoothed (smoothed_contact.h).  Converged if p -
// proj_K(p - rho w), as a velocity, is rounding.  If rows are dependent, p has the least norm among those with the
// same u (least_impulses.h).  A small part of b (1e-8 of b) outside the range of D, which only an unbounded p could
// balance, is dropped if there is no solution with it.  No entry of p is ever NaN.
//
// Sources: M. Jean, 1999 (sweeps); P. Alart, A. Curnier, A mixed formulation for frictional contact problems,
// Comput.
// Methods Appl. Mech. Eng. 92, 1991; V. Acary, B. Brogliato, 2008, chapter 13.
#pragma once

#include <dyntape/dynamics/contact/contact_problem.h>

namespace dyntape::dynamics {

// Solves one contact, A (3 x 3) symmetric, positive semidefinite: opening, sticking, or sliding with u_t = - kappa
// p_t.
Eigen::Vector3d solve_one_contact(const Eigen::Matrix3d& A, const Eigen::Vector3d& b, double mu);

class ContactSolver {
 public:
  // Returns false if no solution is found to 1e-9 of b; p is then the best point found.
  bool solve(const ContactProblem& problem, Eigen::VectorXd& p);

  double residual() const { return residual_; }  // of the last solve, in the units of b
  int sweeps() const { return sweeps_; }

 private:
  bool iterate(const ContactProblem& problem);
  bool sweep_and_polish(const ContactProblem& problem, Eigen::VectorXd& p, int most, double share);
  void take_least(const ContactProblem& problem, Eigen::VectorXd& p) const;
  bool improve(const ContactProblem& problem, const Eigen::VectorXd& p);
  void sweep(const ContactProblem& problem, Eigen::VectorXd& p) const;
  bool polish(const ContactProblem& problem, Eigen::VectorXd p);

  Eigen::VectorXd best_;
  double residual_ = 0, goal_ = 0;
  int sweeps_ = 0;
};

}  // namespace dyntape::dynamics
