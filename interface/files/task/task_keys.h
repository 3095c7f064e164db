// SPDX-License-Identifier: BSD-3-Clause
//
// Asks for the keys of a task file, each with its meaning; no other file asks for them.
//
//   const TaskSpec spec = read_task_file(read_file(path), path, settings);
//
//   for (const io::Question& q : task_questions()) ...            // the list of all keys (dyntape check-config --keys)
//
// FileError: lists every problem of the file.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/info/settings.h>
#include <dyntape/interface/files/task/task_spec.h>

namespace dyntape {

TaskSpec read_task_file(const std::string& text, const std::string& path,
                        const std::vector<io::Setting>& settings);

// The robot, its effects and its driven joints, from a scene file or from the task's own keys.  False if there is no
// such robot; the file has noted the reason.
bool read_task_scene(io::Section& file, TaskSpec& spec);
std::string read_task_name(io::Section& file, const std::string& fallback);
// The other keys.  Without a model, keys over joints are known but not read.
void read_task_keys(io::Section& file, TaskSpec& spec, const dynamics::Model<double>* model);

// Keys shared with other files that are solved or controlled: horizon.intervals and the mesh, and the block mpc,
// whose disturbances differ.
enum class WithLimitedMemory { kNo, kYes };  // for Ipopt only
MeshOptions read_mesh(io::Section& file, WithLimitedMemory with = WithLimitedMemory::kYes,
                      const std::string& scheme = "hermite-simpson");
using ReadPush = std::function<TaskSpec::Control::Disturbance(io::Section& push)>;  // without its time
TaskSpec::Control read_control(io::Section& file, const ReadPush& read_push);

// The block `gait` for this number of feet; none: all feet stand.
std::optional<Gait> read_gait(io::Section& file, Eigen::Index feet, const dynamics::Model<double>* model);

// The same for a task, and the part of the block `mpc` for robots with joints (control_keys.cpp).
void read_walk(io::Section& file, TaskSpec& spec, const dynamics::Model<double>* model);
TaskSpec::Control::Disturbance read_hit(io::Section& push, const TaskSpec& spec,
                                        const dynamics::Model<double>* model);
void read_plant(io::Section& file, TaskSpec& spec, const dynamics::Model<double>* model);

// The blocks `solver` and `contact_implicit`; notes values that the method ddp does not have (method_keys.cpp).
void read_solver(io::Section& file, TaskSpec& spec);
void read_continuation(io::Section& file, TaskSpec& spec, const dynamics::Model<double>* model);
void note_ddp_keys(io::Section& file, const TaskSpec& spec);

// The block `periodic` (periodic_motion.cpp).
std::optional<TaskSpec::Periodic> read_periodic(io::Section& file, const TaskSpec& spec,
                                                const dynamics::Model<double>* model);

// The block `costs` (cost_keys.cpp).
TaskSpec::Costs read_costs(io::Section& file, const TaskSpec& spec, const dynamics::Model<double>* model);

// All keys of a task file, in the order of reading.
std::vector<io::Question> task_questions();

}  // namespace dyntape
