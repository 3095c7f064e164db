// SPDX-License-Identifier: BSD-3-Clause
//
// Reads the `constraints` block of scene files.
//
//   constraints
//   {
//     loops    { loop { frames "coupler_end rocker_end"  type point } }
//     contacts { contact { frames "FL_FOOT FR_FOOT"  radius 0.016  friction 0.7  restitution 0.3 } }
//     limits   { restitution 0 }                            ; the robot's own, hard
//   }
//
//   SceneConstraints constraints = read_constraints(file, {&model, urdf});  // null: no robot, whose frames are names
#pragma once

#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/scene/collision_keys.h>
#include <dyntape/interface/robot/scene_constraints.h>

namespace dyntape {

SceneConstraints read_constraints(io::Section& file, const KeyedRobot& robot);

}  // namespace dyntape
