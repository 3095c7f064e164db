// SPDX-License-Identifier: BSD-3-Clause
//
// The `effects` block of scene and task files, as the effects themselves describe it (dynamics/effects/parameters.h): a
// new effect has its keys as soon as it is in the list.
//
//   effects
//   {
//     gravity         off                                          ; or { vector "0 0 -1.62" }
//     joint_damping   robot                                        ; the file's values
//     armature        { elbow 0.1  shoulder 0.2 }                  ; the first parameter alone: a number a joint
//     joint_friction  { torque robot  smoothing 0.01 }             ; parameters by name
//     wrenches        { wrench { frames "tool"  force "0 0 -5" } } ; lists: a block an item
//     contacts        { contact { shapes collision  ... } }        ; or frames, radius: collision_keys.h
//   }
//
//   dynamics::Effects<double> effects = read_effects(file, {&model, urdf});  // null: no robot, whose joints are keys
#pragma once

#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/scene/collision_keys.h>

namespace dyntape {

// Of each entry of a parameter.
io::Range range_of(const dynamics::ParameterInfo& info);

dynamics::Effects<double> read_effects(io::Section& file, const KeyedRobot& robot);

}  // namespace dyntape
