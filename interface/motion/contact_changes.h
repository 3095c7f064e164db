// SPDX-License-Identifier: BSD-3-Clause
//
// Where contacts of a robot begin and end: what a phase before has to fulfil, and what becomes of velocities (phases.h).
//
//   for (Term& term : landing(scene, foot, Landing::kAtRest)) flight.add(term);   // the foot is set down
//   flight.add(stays_above(scene, foot));                                         // and is not in the floor before
//   jump.add("landing", stance, impact(scene, feet));                             // or hits it: Landing::kImpact
//
// Contacts are those of robot_problem.h, with their places; a floor has z upwards.
//
// Errors: ArgumentError for a frame that is unknown or fixed, for a contact without a place.
#pragma once

#include <vector>

#include <dyntape/interface/motion/robot_problem.h>

namespace dyntape {

enum class Landing {
  kAtRest,  // without velocity
  kImpact,  // with any
};

// At the end of a motion the contact is at its place; a foot, which has corners, with its axes as well.
std::vector<Term> landing(const RobotScene& scene, const HeldContact& contact, Landing how);

// Along a motion, the contact's point or corners are no more than a millimetre below where they are when it is at its place: at
// both ends they may be there.
Term stays_above(const RobotScene& scene, const HeldContact& contact);

// (q, v, ...) when all these contacts come to rest at once, without restitution (impulse_dynamics, constraints.h).
StageFunction impact(const RobotScene& scene, const std::vector<HeldContact>& contacts);

}  // namespace dyntape
