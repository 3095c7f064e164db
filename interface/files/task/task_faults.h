// SPDX-License-Identifier: BSD-3-Clause
//
// Finds contradictions in a task, from a file (whose reader adds the place) or from a program.
//
//   for (const SpecFault& fault : faults_of(spec)) std::cerr << fault.key << ": " << fault.message << "\n";
//
// ArgumentError: the robot's driven joints are wrong (robot_scene.h).
#pragma once

#include <vector>

#include <dyntape/interface/files/task/task_spec.h>

namespace dyntape {

std::vector<SpecFault> faults_of(const TaskSpec& spec);

// The same task with every state and weight in full, and with the consequences: a gait's contacts have schedules;
// with rigid contacts, the simulation of the scene gives the error of a motion.
TaskSpec completed(TaskSpec spec);

constexpr const char* kRigidScheme = "radau-1";  // the scheme of scenes with rigid contacts

// Faults with the method ddp, which has no limits of states.
SpecFault limits_of_states(const std::string& key);

// Faults of a periodic motion (periodic_motion.cpp).
std::vector<SpecFault> periodic_faults(const TaskSpec& spec);

}  // namespace dyntape
