// SPDX-License-Identifier: BSD-3-Clause
//
// The contact problem: Signorini's law with Coulomb friction for many contacts at once, with the exact cone (no
// polyhedron).
//
//   ContactProblem problem{D, b, {{.rows = 3, .friction = 0.7}, {.rows = 1}}};   // two contacts, one without friction
//   contact_residual(problem, D * p + b, p)                                      // 0 of a solution (contact_solver.h)
//
// Each contact has one row, the normal, or three: the normal and two tangents.  Given are the response D = J M^-1
// J^T (symmetric, positive semidefinite, of any rank) and the velocities b (m/s) without impulses (N s), or
// accelerations and forces.  The solution is p with u = D p + b and for each contact
//   0 <= u_n  perpendicular to  p_n >= 0                                        (it opens, or it presses)
//   |p_t| <= mu p_n,   u_t != 0:  p_t = - mu p_n u_t / |u_t|                    (it sticks, or friction brakes it)
// De Saxce's correction turns this into one law on the cone K = {|p_t| <= mu p_n}:
//   w = u + (mu |u_t|, 0, 0):   p in K,  w in the dual of K,  p . w = 0    <=>    p = proj_K(p - rho w), any rho > 0.
//
// There may be no solution (contradictory contacts), and with friction several.  If rows of D are dependent, u is
// unique without friction, p is not.
//
// Sources: M. Jean, The non-smooth contact dynamics method, Comput. Methods Appl. Mech. Eng. 177, 1999; G. De Saxce,
// Z.-Q. Feng, The bipotential method, Math. Comput. Modelling 28, 1998; V. Acary, B. Brogliato, Numerical Methods for
// Nonsmooth Dynamical Systems, 2008.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace dyntape::dynamics {

struct ContactBlock {
  int rows = 3;         // 3: normal, two tangents; 1: the normal alone
  double friction = 0;  // mu >= 0, for three rows
};

struct ContactProblem {
  Eigen::MatrixXd D;  // (m x m)
  Eigen::VectorXd b;  // (m)
  std::vector<ContactBlock> blocks;
  // Size of the numbers whose difference b is, such as |J| |v|: the rounding of b is relative to it.
  double size = 0;
};

// The nearest point of K = {|(x_1, x_2)| <= mu x_0}.
Eigen::Vector3d project_on_cone(const Eigen::Vector3d& x, double mu);

// rho of a contact: rows / trace of its block of D; for an immovable contact the mean of all.
double contact_step(const ContactProblem& problem, const ContactBlock& block, Eigen::Index first);

// Largest entry of (p - proj_K(p - rho w)) / rho at velocities u.
double contact_residual(const ContactProblem& problem, const Eigen::VectorXd& u, const Eigen::VectorXd& p);

// Calls visit(block, first row) for each contact.
template <class Visit>
void for_each_block(const ContactProblem& problem, const Visit& visit) {
  Eigen::Index first = 0;
  for (const ContactBlock& block : problem.blocks) {
    visit(block, first);
    first += block.rows;
  }
}

}  // namespace dyntape::dynamics
