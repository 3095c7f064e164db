// SPDX-License-Identifier: BSD-3-Clause
//
// Signorini's contact with Coulomb's friction, many contacts at once, the cone as it is (no polyhedron).
//
//   ContactProblem problem{D, b, {{.rows = 3, .friction = 0.7}, {.rows = 1}}};   // two contacts, one without friction
//   ContactSolver solver;
//   Eigen::VectorXd p = Eigen::VectorXd::Zero(4);          // where it starts: of the step before
//   if (!solver.solve(problem, p)) ... solver.residual()
//
// Each contact has one row, the normal, or three: the normal and two tangents.  With the response D = J M^-1 J^T
// (symmetric, positive semidefinite, of any rank), b the velocities (m/s) without impulses (N s), or accelerations and
// forces, wanted is p with u = D p + b and for each contact
//   0 <= u_n  perpendicular to  p_n >= 0                                        (it opens, or it presses)
//   |p_t| <= mu p_n,   u_t != 0:  p_t = - mu p_n u_t / |u_t|                    (it sticks, or friction brakes it)
// which De Saxce's correction makes one law on the cone K = {|p_t| <= mu p_n}:
//   w = u + (mu |u_t|, 0, 0):   p in K,  w in the dual of K,  p . w = 0    <=>    p = proj_K(p - rho w), any rho > 0.
//
// Solved contact by contact, each exactly (block Gauss-Seidel), and by Newton's method on Alart and Curnier's equations
// where that is slow; ended where p - proj_K(p - rho w), as a velocity, is rounding.  Where rows depend on each other u is
// found, and one of the possible p; a part of b outside of the range of D that is small (1e-8) beside b, which only p without
// bound would answer, is left out where there is no solution with it.  There may be no solution (contacts that contradict each other), and with friction
// several.  No entry of p is ever NaN.
//
// Sources: M. Jean, The non-smooth contact dynamics method, Comput. Methods Appl. Mech. Eng. 177, 1999; G. De Saxce,
// Z.-Q. Feng, The bipotential method, Math. Comput. Modelling 28, 1998; P. Alart, A. Curnier, A mixed formulation for
// frictional contact problems, Comput. Methods Appl. Mech. Eng. 92, 1991; V. Acary, B. Brogliato, Numerical Methods for
// Nonsmooth Dynamical Systems, 2008, chapter 13.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace dyntape::dynamics {

struct ContactBlock {
  int rows = 3;         // 3: normal, two tangents; 1: the normal alone
  double friction = 0;  // mu >= 0, of three rows
};

struct ContactProblem {
  Eigen::MatrixXd D;  // (m x m)
  Eigen::VectorXd b;  // (m)
  std::vector<ContactBlock> blocks;
  // Of the numbers whose differences b is, such as |J| |v|: b is known to the rounding of these.
  double size = 0;
};

// The nearest point of K = {|(x_1, x_2)| <= mu x_0}.
Eigen::Vector3d project_on_cone(const Eigen::Vector3d& x, double mu);

// One contact alone, A (3 x 3) symmetric, positive semidefinite: opening, sticking, or sliding with u_t = - kappa p_t.
Eigen::Vector3d solve_one_contact(const Eigen::Matrix3d& A, const Eigen::Vector3d& b, double mu);

// Largest entry of (p - proj_K(p - rho w)) / rho at velocities u; rho of a contact: rows / trace of its block of D.
double contact_residual(const ContactProblem& problem, const Eigen::VectorXd& u, const Eigen::VectorXd& p);

class ContactSolver {
 public:
  // False where no solution is found; p is then the best that was met.
  bool solve(const ContactProblem& problem, Eigen::VectorXd& p);

  double residual() const { return residual_; }  // of the last solve, in the units of b
  int sweeps() const { return sweeps_; }

 private:
  bool iterate(const ContactProblem& problem, Eigen::VectorXd& p, int rounds);
  bool improve(const ContactProblem& problem, const Eigen::VectorXd& p);
  void sweep(const ContactProblem& problem, Eigen::VectorXd& p) const;
  void polish(const ContactProblem& problem, Eigen::VectorXd p);

  Eigen::VectorXd best_;
  double residual_ = 0, goal_ = 0;
  int sweeps_ = 0;
};

}  // namespace dyntape::dynamics
