// SPDX-License-Identifier: BSD-3-Clause
//
// Checks a motion against the limits of the robot's file and the clearances of the task, also between mesh points.
//
//   for (const LimitExcess& e : limit_excesses(task, motion)) std::cout << e.text() << "\n";
//   velocity of panda_joint1 is 2.41 rad/s at 0.52 s, rated for 2.175
//
// A velocity or effort limit of zero means no limit, as in files without limits.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/files/task/task.h>

namespace dyntape {

enum class LimitOf { kRobot, kClearance, kFloor };

struct LimitExcess {
  std::string quantity, joint,
      unit;                     // "velocity", "panda_joint1", "rad/s"; "clearance", "hand from post", "m"
  double value, limit, time;    // largest excess, and its time (s)
  bool between_points = false;  // true: the limit holds at the mesh's points; a finer mesh may fix it
  LimitOf of = LimitOf::kRobot;
  std::string text() const;
};

// Returns the worst excess of each joint and quantity, in the order of the joints, then the clearances.  Rounding
// and the solver's widening of bounds are not an excess.  Limits are those of the robot, independent of the task's
// bounds.  Rows of the task are checked by the verification (verify.h, passings.h).
//
// - Between mesh points an excess counts from demands.integration_error of the range on (of the limit, if
// one-sided).
// - Clearances are evaluated so often that two bodies move between evaluations by at most a sixteenth of the
// required distance of their centres, but at most 4096 times per interval.
// - Between points a clearance is too small from integration_error of that distance on, but at most a thousandth of
// it; at the points from a micrometre plus a millionth of it on.
std::vector<LimitExcess> limit_excesses(const Task& task, const Trajectory& motion);

}  // namespace dyntape
