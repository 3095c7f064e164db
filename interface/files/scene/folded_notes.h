// SPDX-License-Identifier: BSD-3-Clause
//
// Combines notes on a robot's file: equal notes for many lines become one.
//
//   for (const std::string& note : folded(robot.notes)) std::cout << "note: " << note << "\n";
//   // panda.urdf:41: 38 rotations and axes snapped to a right angle, by at most 3.2e-06 rad (--verbose lists them)
#pragma once

#include <string>
#include <vector>

namespace dyntape {

std::vector<std::string> folded(const std::vector<std::string>& notes);

}  // namespace dyntape
