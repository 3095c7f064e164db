// SPDX-License-Identifier: BSD-3-Clause
//
// What of a task does not go together, whoever says it: a file, whose reader tells the place, or a program.
//
//   for (const SpecFault& fault : faults_of(spec)) std::cerr << fault.key << ": " << fault.message << "\n";
//
// Errors: ArgumentError where the robot's driven joints are wrong (robot_scene.h).
#pragma once

#include <vector>

#include <dyntape/interface/files/task/task_spec.h>

namespace dyntape {

std::vector<SpecFault> faults_of(const TaskSpec& spec);

// The same with every state and weight in full, and with what follows from it: contacts of a gait have schedules; of rigid
// contacts the simulation of the scene tells what a motion is off by.
TaskSpec completed(TaskSpec spec);

constexpr const char* kRigidScheme = "radau-1";  // the scheme of scenes with rigid contacts

// Of the method ddp, which knows no limits of states.
SpecFault limits_of_states(const std::string& key);

// Of a motion that goes on for ever (periodic_motion.cpp).
std::vector<SpecFault> periodic_faults(const TaskSpec& spec);

}  // namespace dyntape
