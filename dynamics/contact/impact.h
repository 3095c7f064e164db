// SPDX-License-Identifier: BSD-3-Clause
//
// Solves an impact of several contacts at once: Newton's restitution, Coulomb friction on impulses.  Use it when
// closed contacts of rigid_contacts.h have approaching velocities.
//
//   const ImpactImpulses impact = solve_impact(solver, D, blocks, restitution, u);
//   v += W J^T impact.p;                                             // u = J v before; impact.u: after
//   impact.energy                                                    // (J) change of the kinetic energy, <= 0
//
// M (v+ - v-) = J^T p over all closed contacts, u = J v, D = J M^-1 J^T, and with Moreau's rule for each contact
//   0 <= u_n+ + s e min(u_n-, 0)   perpendicular to   p_n >= 0,      friction of p_t against u_t+   (contact_problem.h)
// where e is the restitution of a contact that has just closed, and 0 for a contact that was closed before.
//
// Energy.  The kinetic energy changes by p . (u- + u+) / 2, exactly.  Without restitution the change is never
// positive: p . u+ <= 0 and D >= 0.  Newton's restitution together with friction may create energy (Kane's paradox).
// Therefore s is the largest number found in [0, 1] for which no energy is created.  s = 1 if Newton's law creates
// none, e.g. without friction and with equal e.
//
// Sources: J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988; T. Kane, D. Levinson,
// Dynamics: Theory and Applications, 1985; C. Glocker, Set-Valued Force Laws, 2001.
#pragma once

#include <dyntape/dynamics/contact/contact_solver.h>

namespace dyntape::dynamics {

struct ImpactImpulses {
  Eigen::VectorXd p, u;    // (m) impulses (N s); velocities after the impact (m/s)
  double energy = 0;       // J
  double restitution = 1;  // s
  bool solved = false;
};

// restitution: one per contact, 0 for closed ones.  u: velocities before, accurate to the rounding of values of
// `size`.
ImpactImpulses solve_impact(ContactSolver& solver, const Eigen::MatrixXd& D,
                            const std::vector<ContactBlock>& blocks, const std::vector<double>& restitution,
                            const Eigen::VectorXd& u, double size = 0);

}  // namespace dyntape::dynamics
