// SPDX-License-Identifier: BSD-3-Clause
//
// What the robot's file says the robot can do, how near the task lets it come to what stands around, and where a motion
// goes beyond.
//
//   for (const LimitExcess& e : limit_excesses(task, motion)) std::cout << e.text() << "\n";
//   velocity of panda_joint1 is 2.41 rad/s at 0.52 s, rated for 2.175
//
// A velocity or an effort limit of zero is none: files that know no limit say so.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/files/task/task.h>

namespace dyntape {

enum class LimitOf { kRobot, kClearance };

struct LimitExcess {
  std::string quantity, joint,
      unit;                     // "velocity", "panda_joint1", "rad/s"; "clearance", "hand from post", "m"
  double value, limit, time;    // where it is exceeded most (s)
  bool between_points = false;  // at the points of the mesh it is kept: a finer one may keep it
  LimitOf of = LimitOf::kRobot;
  std::string text() const;
};

// Of each joint and quantity the worst, in the order of the joints; rounding and the solver's widening of bounds are
// no excess.  What is kept at the points of the mesh is looked at between them, where an excess is one from
// demands.integration_error of the range on (of the limit, where it is one-sided).  Clearances are looked at so often that what
// two bodies move from one look to the next is at most a sixteenth of how far their centres have to be apart (but no more
// than 4096 times an interval); between points of the mesh they are too small from integration_error of that distance on, but
// never from more than a thousandth, at the points from a micrometre and a millionth of it on.
// Limits are those of the robot, whatever the task bounds; clearances come last.  Rows of the task are the verification's
// (verify.h, passings.h).
std::vector<LimitExcess> limit_excesses(const Task& task, const Trajectory& motion);

}  // namespace dyntape
