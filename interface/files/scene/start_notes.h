// SPDX-License-Identifier: BSD-3-Clause
//
// Notes on a start that is possible, but seldom meant: joints beyond limits of the robot's file that the scene does not hold,
// and compliant contacts so deep in the ground that they throw the robot away.
//
//   for (const std::string& note : notes_of(scene)) std::cout << "note: " << note << "\n";
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/files/scene/scene.h>

namespace dyntape {

std::vector<std::string> notes_of_start(const Scene& scene);

// Those of the robot's file, then those of the start.
std::vector<std::string> notes_of(const Scene& scene);

}  // namespace dyntape
