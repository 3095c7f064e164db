// SPDX-License-Identifier: BSD-3-Clause
//
// Notes on a robot's file as people read them: what is said of many places in the same words is one line.
//
//   for (const std::string& note : folded(robot.notes)) std::cout << "note: " << note << "\n";
//   // panda.urdf:41: 38 rotations and axes snapped to a right angle, by at most 3.2e-06 rad (--verbose lists them)
#pragma once

#include <string>
#include <vector>

namespace dyntape {

std::vector<std::string> folded(const std::vector<std::string>& notes);

}  // namespace dyntape
