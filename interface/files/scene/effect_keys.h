// SPDX-License-Identifier: BSD-3-Clause
//
// Reads the `effects` block of scene and task files.  The effects' own descriptions define the keys
// (dynamics/effects/parameters.h), so a new effect has its keys at once.
//
//   effects
//   {
//     gravity         off                                          ; or { vector "0 0 -1.62" }
//     joint_damping   robot                                        ; the file's values
//     armature        { elbow 0.1  shoulder 0.2 }                  ; only the first parameter: one number per joint
//     joint_friction  { torque robot  smoothing 0.01 }             ; parameters by name
//     wrenches        { wrench { frames "tool"  force "0 0 -5" } } ; lists: one block per item
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
