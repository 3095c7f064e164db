// SPDX-License-Identifier: BSD-3-Clause
//
// Combines the data of a robot's file that a motion ignores into one note: unread elements, damping and friction
// without effect, limits without constraint.
//
//   note_left_out(scene.notes, scene.urdf, found.left_out, scene.robot, Limits::kByChoice);
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

// A simulation applies the limits that its file chooses; an optimal control problem applies all of them.
enum class LimitsOfFile { kByChoice, kHeld };

// Replaces an existing note of this kind.
void note_left_out(std::vector<std::string>& notes, const std::string& urdf,
                   const std::vector<std::string>& elements, const RobotScene& scene, LimitsOfFile limits);

}  // namespace dyntape
