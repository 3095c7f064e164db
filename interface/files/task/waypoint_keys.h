// SPDX-License-Identifier: BSD-3-Clause
//
// What leads a task's motion between its start and its goal: waypoints, and a motion from a file that it follows.
//
//   waypoints {
//     waypoint above {                            ; its name behind the word
//       at 0.4                                    ; a share of the duration, given or free
//       frame panda_hand { position "0.5 0 0.4" } ; or q, as in goals
//     }
//   }
//   reference { file motion.csv  q 10  v 1 }      ; followed at its own times, from t = 0 on
//
//   const std::vector<TaskWaypoint> waypoints = read_waypoints(file, model);
//   for (const TaskWaypoint& w : waypoints) problem.add(term_of(w, scene));
//
// A reference is a table as solve and simulate write it: a column t, increasing (s), then q.<joint> and v.<joint>, others as
// they like. Between rows it is interpolated along straight lines, before the first and behind the last it stays.  Its values
// are parameters of time: nothing is recorded anew, and a controller follows it in the plant's time.  Of robots whose joints
// are on lines.
//
// What is wrong is noted in the section (Section::finish reports it).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/task/task_spec.h>

namespace dyntape {

std::vector<TaskWaypoint> read_waypoints(io::Section& file,
                                         const dynamics::Model<double>* model);  // in the order of time
Term term_of(const TaskWaypoint& waypoint, const RobotScene& scene);

std::optional<ReferenceMotion> read_reference(io::Section& file, const std::string& task_file,
                                              bool is_free_time, const dynamics::Model<double>* model);
// Adds the term and its parameter to the problem.
void follow(Problem& problem, const ReferenceMotion& reference);

}  // namespace dyntape
