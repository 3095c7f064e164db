// SPDX-License-Identifier: BSD-3-Clause
//
// Motions of task files that go on for ever: the block `closed`, and what it makes of the task (next_step.h).
//
//   keys.closed = read_closed(file, task, model);             // before phases are known,
//   check_closed(file, task, keys, *model);                   // and what does not fit them
//   place_last_step(task, keys);                              // when contacts have places, before the problem is composed
//   close_motion(task, keys);                                 // behind that: task.closing
#pragma once

#include <dyntape/interface/task/task_keys.h>

namespace dyntape {

std::optional<TaskKeys::Closed> read_closed(io::Section& file, const Task& task,
                                            const dynamics::Model<double>* model);
void check_closed(io::Section& file, const Task& task, const TaskKeys& keys,
                  const dynamics::Model<double>& model);

// A contact that does not stand at the start stood a step behind the one whose part it plays.
void place_last_step(Task& task, const TaskKeys& keys);

// What has landed when the motion begins stands at its place, and the end becomes the start.
void close_motion(Task& task, const TaskKeys& keys);

}  // namespace dyntape
