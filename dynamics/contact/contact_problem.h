// SPDX-License-Identifier: BSD-3-Clause
//
// Signorini's contact with Coulomb's friction, many contacts at once, the cone as it is (no polyhedron).
//
//   ContactProblem problem{D, b, {{.rows = 3, .friction = 0.7}, {.rows = 1}}};   // two contacts, one without friction
//   contact_residual(problem, D * p + b, p)                                      // 0 of a solution (contact_solver.h)
//
// Each contact has one row, the normal, or three: the normal and two tangents.  With the response D = J M^-1 J^T
// (symmetric, positive semidefinite, of any rank), b the velocities (m/s) without impulses (N s), or accelerations and
// forces, wanted is p with u = D p + b and for each contact
//   0 <= u_n  perpendicular to  p_n >= 0                                        (it opens, or it presses)
//   |p_t| <= mu p_n,   u_t != 0:  p_t = - mu p_n u_t / |u_t|                    (it sticks, or friction brakes it)
// which De Saxce's correction makes one law on the cone K = {|p_t| <= mu p_n}:
//   w = u + (mu |u_t|, 0, 0):   p in K,  w in the dual of K,  p . w = 0    <=>    p = proj_K(p - rho w), any rho > 0.
//
// There may be no solution (contacts that contradict each other), and with friction several.  Where rows of D depend on each
// other u is unique where there is no friction, p is not.
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

// rho of a contact: rows / trace of its block of D; one that nothing can move takes the mean of all.
double contact_step(const ContactProblem& problem, const ContactBlock& block, Eigen::Index first);

// Largest entry of (p - proj_K(p - rho w)) / rho at velocities u.
double contact_residual(const ContactProblem& problem, const Eigen::VectorXd& u, const Eigen::VectorXd& p);

// visit(block, first row)
template <class Visit>
void for_each_block(const ContactProblem& problem, const Visit& visit) {
  Eigen::Index first = 0;
  for (const ContactBlock& block : problem.blocks) {
    visit(block, first);
    first += block.rows;
  }
}

}  // namespace dyntape::dynamics
