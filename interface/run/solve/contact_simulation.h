// SPDX-License-Identifier: BSD-3-Clause
//
// The torques of a motion with rigid contacts, in the simulation of its scene: what contacts then do is not the solver's word.
//
//   const ContactSimulation simulated = simulate_contacts(task, motion);
//   simulated.error                 // 0.012: no position is off by more than 1.2 % of the largest movement of its kind
//
// From the motion's start, with the torque of an interval's end over the interval, at the scene's own step, and with the servos that
// the task gives the driven joints (verify.servo_stiffness, servo_damping); compared at the motion's points.  Positions only: of a
// body that lands a step earlier the velocities differ, and nothing is wrong with that.  Of a kind are lengths, and angles
// with entries of orientations.
#pragma once

#include <string>

#include <dyntape/interface/control/discretize/trajectory.h>
#include <dyntape/interface/files/task/task.h>

namespace dyntape {

struct ContactSimulation {
  double error = 0;          // the largest, as a part of the largest movement of its kind
  double off = 0, time = 0;  // in the state's unit, and when (s)
  std::string state = {};    // whose
  std::string unit = {};     // " rad"
  std::string trouble = {};  // why the simulation ended ahead of its time, or ""; `error` is then infinite

  std::string sentence() const;  // "q.block is off by 0.012 m at 0.85 s, 1.2 % of the motion"
};

// Of a task whose scene has rigid contacts (Task::simulated).
ContactSimulation simulate_contacts(const Task& task, const Trajectory& motion);

}  // namespace dyntape
