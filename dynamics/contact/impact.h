// SPDX-License-Identifier: BSD-3-Clause
//
// What a collision does to velocities: Newton's restitution, Coulomb's friction on impulses, several contacts at once.
//
//   const ImpactImpulses impact = solve_impact(solver, D, blocks, restitution, u);
//   v += W J^T impact.p;                                             // u = J v before; impact.u: after
//   impact.energy                                                    // (J) what the robot gains, <= 0
//
// M (v+ - v-) = J^T p over all contacts that touch, u = J v, D = J M^-1 J^T, and with Moreau's rule for each
//   0 <= u_n+ + s e min(u_n-, 0)   perpendicular to   p_n >= 0,      friction of p_t against u_t+      (contact_problem.h)
// for those that were open and hit; those that were closed before have e = 0.
//
// Energy.  The kinetic energy changes by p . (u- + u+) / 2, exactly.  Without restitution that is never a gain:
// p . u+ <= 0 and D >= 0.  Newton's restitution beside friction may create energy (Kane's paradox), so that s is the
// largest number in [0, 1] found for which it does not: 1 wherever Newton's law is sound, as without friction and with one e.
//
// Sources: J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988; T. Kane, D. Levinson,
// Dynamics: Theory and Applications, 1985; C. Glocker, Set-Valued Force Laws, 2001.
#pragma once

#include <dyntape/dynamics/contact/contact_solver.h>

namespace dyntape::dynamics {

struct ImpactImpulses {
  Eigen::VectorXd p, u;    // (m) impulses (N s); velocities after them (m/s)
  double energy = 0;       // J
  double restitution = 1;  // s
  bool solved = false;
};

// restitution: one a contact, 0 for closed ones; u: velocities before, known to the rounding of numbers of that size.
ImpactImpulses solve_impact(ContactSolver& solver, const Eigen::MatrixXd& D,
                            const std::vector<ContactBlock>& blocks, const std::vector<double>& restitution,
                            const Eigen::VectorXd& u, double size = 0);

}  // namespace dyntape::dynamics
