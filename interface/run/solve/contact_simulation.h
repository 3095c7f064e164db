// SPDX-License-Identifier: BSD-3-Clause
//
// Verifies a motion with rigid contacts by the simulation of its scene with the motion's torques.
//
//   const ContactSimulation simulated = simulate_contacts(task, motion);
//   simulated.error                 // 0.012: the largest error of a position is 1.2 % of its movement
//   simulated.from_afar             // 0.003: this fraction of the contacts' impulse acts at a distance
//
// The simulation starts at the motion's start.  The torque at the end of an interval acts over the interval, at the
// scene's own step, with the position control of the task (verify.servo_stiffness, servo_damping), within the bounds
// of the controls.  Positions are compared at the motion's points.  Velocities are not compared: they differ if a
// body lands a step earlier, which is not an error.  The error of a position is relative to its movement, at least
// to a twentieth of the largest movement of its kind (lengths; angles with entries of orientations), and at least to
// 0.02 m or rad.
//
// A normal force acts at a distance if the gap exceeds a millimetre and ten relaxations (implicit_contacts.h).  It
// is then below a tenth of the weight, which over a long time still moves bodies.
#pragma once

#include <stop_token>
#include <string>

#include <dyntape/interface/control/discretize/trajectory.h>
#include <dyntape/interface/files/task/task.h>

namespace dyntape {

struct ContactSimulation {
  double error = 0;          // the largest, relative to the position's movement
  double off = 0, time = 0;  // in the state's unit, and its time (s)
  std::string state = {};    // the state with this error
  std::string unit = {};     // " rad"
  double from_afar = 0;      // fraction of the normal impulses of all contacts
  std::string trouble = {};  // reason of an early end of the simulation, or ""; `error` is then infinite

  // "q.block is off by 0.012 m at 0.85 s, 1.2 % of its movement; 0.3 % of the impulse acts from a distance"
  std::string sentence() const;
};

// For a task whose scene has rigid contacts (Task::simulated); `relaxation` (m) of the motion.
ContactSimulation simulate_contacts(const Task& task, const Trajectory& motion, double relaxation,
                                    const std::stop_token& stop = {});

// Throws ArgumentError if the motion starts with a contact below its plane, ToolError if a stop request interrupts it.
void check_contacts_at_start(const Task& task, const std::stop_token& stop);

}  // namespace dyntape
