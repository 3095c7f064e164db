// SPDX-License-Identifier: BSD-3-Clause
//
// Solutions of contact problems.
//
//   ContactSolver solver;
//   Eigen::VectorXd p = Eigen::VectorXd::Zero(4);          // where it starts: of the step before
//   if (!solver.solve(problem, p)) ... solver.residual()
//
// Solved contact by contact, each exactly (block Gauss-Seidel), and by Newton's method on Alart and Curnier's equations;
// where that is slow, with the corners of the cones rounded (smoothed_contact.h); ended where p - proj_K(p - rho w), as a
// velocity, is rounding.  Where rows depend on each other p is the least of
// those with the same u (least_impulses.h); a part of b outside of the
// range of D that is small (1e-8) beside b, which only p without bound would answer, is left out where there is no solution
// with it.  No entry of p is ever NaN.
//
// Sources: M. Jean, 1999, of the sweeps; P. Alart, A. Curnier, A mixed formulation for frictional contact problems, Comput.
// Methods Appl. Mech. Eng. 92, 1991; V. Acary, B. Brogliato, 2008, chapter 13.
#pragma once

#include <dyntape/dynamics/contact/contact_problem.h>

namespace dyntape::dynamics {

// One contact alone, A (3 x 3) symmetric, positive semidefinite: opening, sticking, or sliding with u_t = - kappa p_t.
Eigen::Vector3d solve_one_contact(const Eigen::Matrix3d& A, const Eigen::Vector3d& b, double mu);

class ContactSolver {
 public:
  // False where no solution is found to 1e-9 of b; p is then the best that was met.
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
