// SPDX-License-Identifier: BSD-3-Clause
//
// Reads the guides of a task's motion between start and goal: waypoints, and a reference motion from a file.
//
//   waypoints {
//     waypoint above {                            ; the word `waypoint`, then its name
//       at 0.4                                    ; a share of the duration, given or free
//       frame panda_hand { position "0.5 0 0.4" } ; or q, as in goals
//     }
//   }
//   reference { file motion.csv  q 10  v 1 }      ; followed at its own times, from t = 0 on
//
//   const std::vector<TaskWaypoint> waypoints = read_waypoints(file, scene, model);
//   for (const TaskWaypoint& w : waypoints) problem.add(term_of(w, scene));
//
// A reference is a table in the format of solve and simulate: an increasing column t (s), then q.<joint> and
// v.<joint>; other columns are ignored.  The reference is linear between rows, and constant before the first and
// after the last row.  Its values are parameters of time: nothing is recorded again, and a controller follows them
// in the plant's time.  Every joint of the robot must be on a line.
//
// Faults are noted in the section (Section::finish reports them).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/task/task_spec.h>

namespace dyntape {

// In the order of time.
std::vector<TaskWaypoint> read_waypoints(io::Section& file, const RobotScene& scene,
                                         const dynamics::Model<double>* model);
Term term_of(const TaskWaypoint& waypoint, const RobotScene& scene);

std::optional<ReferenceMotion> read_reference(io::Section& file, const std::string& task_file,
                                              bool is_free_time, const RobotScene& scene,
                                              const dynamics::Model<double>* model);
// Adds the term and its parameter to the problem.
void follow(Problem& problem, const ReferenceMotion& reference);

}  // namespace dyntape
