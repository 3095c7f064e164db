// SPDX-License-Identifier: BSD-3-Clause
//
// The torques of a motion with rigid contacts, in the simulation of its scene: what contacts then do is not the solver's word.
//
//   const ContactSimulation simulated = simulate_contacts(task, motion);
//   simulated.error                 // 0.012: no position is off by more than 1.2 % of how far it moves
//   simulated.from_afar             // 0.003: so much of the contacts' impulse acts from a distance
//
// From the motion's start, with the torque of an interval's end over the interval, at the scene's own step, and with the servos that
// the task gives the driven joints (verify.servo_stiffness, servo_damping), together within the bounds of the task's controls; compared
// at the motion's points.  Positions only: of a body that lands a step earlier the velocities differ, and nothing is wrong with that.
// A position that moves little is measured by a twentieth of the largest movement of its kind (lengths; angles with entries of
// orientations), and by 0.02 m or rad at least.
//
// From a distance acts a normal force where the gap is more than a millimetre and than ten relaxations (implicit_contacts.h): less than a
// tenth of the weight, which for long enough moves anything.
#pragma once

#include <string>

#include <dyntape/interface/control/discretize/trajectory.h>
#include <dyntape/interface/files/task/task.h>

namespace dyntape {

struct ContactSimulation {
  double error = 0;          // the largest, as a part of how far the position moves
  double off = 0, time = 0;  // in the state's unit, and when (s)
  std::string state = {};    // whose
  std::string unit = {};     // " rad"
  double from_afar = 0;      // part of the normal impulses of all contacts
  std::string trouble = {};  // why the simulation ended ahead of its time, or ""; `error` is then infinite

  // "q.block is off by 0.012 m at 0.85 s, 1.2 % of its movement; 0.3 % of the impulse acts from a distance"
  std::string sentence() const;
};

// Of a task whose scene has rigid contacts (Task::simulated); `relaxation` (m) of the motion.
ContactSimulation simulate_contacts(const Task& task, const Trajectory& motion, double relaxation);

// ArgumentError where the motion begins with a contact below its plane.
void check_contacts_at_start(const Task& task);

}  // namespace dyntape
