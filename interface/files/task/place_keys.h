// SPDX-License-Identifier: BSD-3-Clause
//
// Reads the keys of a task file about places: targets of frames, obstacles, and bodies that keep clear of them.
//
//   const std::optional<FrameTarget> target = read_frame_target(goal, model);
//   const Surroundings around = read_surroundings(file, model);
//
// Notes faults in the section (Section::finish reports them).  Without a robot, names of frames are deferred.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/task/task_spec.h>
#include <dyntape/interface/motion/robot_terms.h>

namespace dyntape {

// Reads the name of a link of the robot; "" if the robot has no such link.
std::string read_link(io::Section& block, const std::string& key, const dynamics::Model<double>* model);

// The block `thrusters`.
std::vector<Thruster> read_thrusters(io::Section& file, const dynamics::Model<double>* model);

// The block `contacts`; the start determines the places of the contacts.
enum class Cones { kLimits, kLimitsOrBarriers };
std::vector<HeldContact> read_contacts(io::Section& file, const dynamics::Model<double>* model,
                                       Cones cones = Cones::kLimitsOrBarriers);

// contacts.floor, the floor's height (m); none if the file does not give it.
std::optional<double> read_floor(io::Section& file);

// The block `frame` of a goal, if there is one.
std::optional<FrameTarget> read_frame_target(io::Section& end, const dynamics::Model<double>* model);

// The blocks `obstacles` and `bodies`.
Surroundings read_surroundings(io::Section& file, const dynamics::Model<double>* model);

}  // namespace dyntape
