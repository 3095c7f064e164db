// SPDX-License-Identifier: BSD-3-Clause
//
// Contact changes between phases (phases.h): terms that a phase satisfies before a contact closes, and impact maps.
//
//   for (Term& term : landing(scene, foot, Landing::kAtRest)) flight.add(term);   // touches down at rest
//   flight.add(stays_above(scene, foot));                                         // and stays above the floor before
//   jump.add("landing", stance, impact(scene, feet));                             // or lands with an impact: kImpact
//
// Contacts are as in robot_problem.h, with their places; the floor has z upwards.
//
// Errors.  ArgumentError: an unknown or fixed frame, a contact without a place.
#pragma once

#include <vector>

#include <dyntape/interface/motion/robot_problem.h>

namespace dyntape {

enum class Landing {
  kAtRest,  // with zero velocity
  kImpact,  // with any velocity
};

// Terms at the end of a motion: the contact is at its place.  A foot (with corners) also has its orientation.
std::vector<Term> landing(const RobotScene& scene, const HeldContact& contact, Landing how);

// A term along a motion: the contact's point or corners are at most one millimetre below their final height.  They
// may be at this height at both ends.
Term stays_above(const RobotScene& scene, const HeldContact& contact);

// A term of a swing: the contact's point or corners keep a height above the straight line from its place to `next`.  At the
// share s of the way over the ground the height is 4 s (1 - s) `clearance` (m): zero at both ends, largest in the middle.
// Beside both ends, within 2 % of the way, it may be up to a millimetre lower.  Between points of a mesh it is verified to a
// thousandth of `clearance` (passings.h).  A contact that lands less than a millimetre from its place is that high at half of
// the duration.
//
//   flight.add(swing_clearance(scene, foot, {0.3, 0.1, 0.1}, 0.05));              // up a step, over its edge
Term swing_clearance(const RobotScene& scene, const HeldContact& contact, const Eigen::Vector3d& next,
                     double clearance);

// The state (q, v, ...) after all these contacts close at once, without restitution (impulse_dynamics,
// constraints.h).
StageFunction impact(const RobotScene& scene, const std::vector<HeldContact>& contacts);

}  // namespace dyntape
