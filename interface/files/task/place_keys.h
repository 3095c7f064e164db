// SPDX-License-Identifier: BSD-3-Clause
//
// The keys of a task file that speak of places: where a frame shall be, what stands around, what bodies keep clear of.
//
//   const std::optional<FrameTarget> target = read_frame_target(goal, model);
//   const Surroundings around = read_surroundings(file, model);
//
// What is wrong is noted in the section (Section::finish reports it).  Without a robot nobody knows its frames: their
// names are deferred.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/task/task_spec.h>
#include <dyntape/interface/motion/robot_terms.h>

namespace dyntape {

// A key that names a link of the robot; "" where there is none of this name.
std::string read_link(io::Section& block, const std::string& key, const dynamics::Model<double>* model);

// The block `thrusters`.
std::vector<Thruster> read_thrusters(io::Section& file, const dynamics::Model<double>* model);

// The block `contacts`; their places are for the start to tell.
enum class Cones { kLimits, kLimitsOrBarriers };
std::vector<HeldContact> read_contacts(io::Section& file, const dynamics::Model<double>* model,
                                       Cones cones = Cones::kLimitsOrBarriers);

// The floor's height (m), contacts.floor; none: the file does not say.
std::optional<double> read_floor(io::Section& file);

// The block `frame` of a goal, if there is one.
std::optional<FrameTarget> read_frame_target(io::Section& end, const dynamics::Model<double>* model);

// The blocks `obstacles` and `bodies`.
Surroundings read_surroundings(io::Section& file, const dynamics::Model<double>* model);

}  // namespace dyntape
