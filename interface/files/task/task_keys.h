// SPDX-License-Identifier: BSD-3-Clause
//
// The keys of a task file: asked for here and nowhere else, each with what it means.
//
//   const TaskSpec spec = read_task_file(read_file(path), path, settings);
//
//   for (const io::Question& q : task_questions()) ...            // the list of all keys (dyntape check-config --keys)
//
// Errors: FileError with every problem of the file.
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

// The robot, what acts on it and where it is driven, of a scene file or as the task's own keys say; false if there is no
// such robot, which the file has noted.
bool read_task_scene(io::Section& file, TaskSpec& spec);
std::string read_task_name(io::Section& file, const std::string& fallback);
// The other keys.  Without a model, keys over its joints are known but not read.
void read_task_keys(io::Section& file, TaskSpec& spec, const dynamics::Model<double>* model);

// What other files that are solved or controlled have as well: horizon.intervals and the mesh, the block mpc, whose disturbances differ.
enum class WithLimitedMemory { kNo, kYes };  // of Ipopt alone
MeshOptions read_mesh(io::Section& file, WithLimitedMemory with = WithLimitedMemory::kYes,
                      const std::string& scheme = "hermite-simpson");
using ReadPush = std::function<TaskSpec::Control::Disturbance(io::Section& push)>;  // but for its time
TaskSpec::Control read_control(io::Section& file, const ReadPush& read_push);

// The block `gait` of so many feet; none: all stand.
std::optional<Gait> read_gait(io::Section& file, Eigen::Index feet, const dynamics::Model<double>* model);

// The same of a task, and what of the block `mpc` is of robots with joints (control_keys.cpp).
void read_walk(io::Section& file, TaskSpec& spec, const dynamics::Model<double>* model);
TaskSpec::Control::Disturbance read_hit(io::Section& push, const dynamics::Model<double>* model);
void read_plant(io::Section& file, TaskSpec& spec, const dynamics::Model<double>* model);

// The blocks `solver` and `contact_implicit`, and notes what the file says that the method ddp does not know (method_keys.cpp).
void read_solver(io::Section& file, TaskSpec& spec);
void read_continuation(io::Section& file, TaskSpec& spec, const dynamics::Model<double>* model);
void note_ddp_keys(io::Section& file, const TaskSpec& spec);

// The block `periodic` (periodic_motion.cpp).
std::optional<TaskSpec::Periodic> read_periodic(io::Section& file, const TaskSpec& spec,
                                                const dynamics::Model<double>* model);

// The block `costs` (cost_keys.cpp).
TaskSpec::Costs read_costs(io::Section& file, const dynamics::Model<double>* model);

// Every key that a task file may have, in the order of reading.
std::vector<io::Question> task_questions();

}  // namespace dyntape
