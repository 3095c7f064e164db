// SPDX-License-Identifier: BSD-3-Clause
//
// What a robot's file says and a motion leaves out, in one note: elements that nothing reads, damping and friction that no
// effect has act, limits that nothing holds.
//
//   note_left_out(scene.notes, scene.urdf, found.left_out, scene.robot, Limits::kByChoice);
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

// A simulation holds the limits that its file chooses; a problem that is solved holds them all.
enum class LimitsOfFile { kByChoice, kHeld };

// In the place of such a note that is there.
void note_left_out(std::vector<std::string>& notes, const std::string& urdf,
                   const std::vector<std::string>& elements, const RobotScene& scene, LimitsOfFile limits);

}  // namespace dyntape
