// SPDX-License-Identifier: BSD-3-Clause
//
// The block `terms` of a task file: ready terms by name, each a row of one table (term_keys.cpp).
//
//   terms {
//     term upright {                   ; its name behind the word
//       type    frame_orientation      ; a function of the stage, less `target`
//       frame   panda_hand
//       target  "3.14159 0 0"
//       role    cost                   ; or equality: it is zero; or inequality: it lies between `lower` and `upper`
//       moves   still                  ; or circle, file: the target over time (moving_target.h)
//       where   running                ; or start, end, at a share of the duration
//       weight  10
//     }
//   }
//
//   for (const TaskTerm& term : read_terms(file, task, model)) add(term, problem);
//
// A cost with bounds weighs what lies beyond them: a soft limit (penalties.h).  What is wrong is noted in the section
// (Section::finish reports it); without a robot the keys are known but not read.
#pragma once

#include <vector>

#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/moving_target.h>
#include <dyntape/interface/files/task/task.h>

namespace dyntape {

struct TaskTerm {
  Term term;              // of a target that moves: without its function
  TargetOverTime target;  // empty: it stands still
  std::function<Term(const StageFunction& target)> with_target;
  std::string frame = {};  // whose origin follows a target that moves
};

// task: its scene and the unit of its controls.
std::vector<TaskTerm> read_terms(io::Section& file, const Task& task, const dynamics::Model<double>* model);

// A target that moves is a parameter of the problem, "<name of the term> target".
void add(const TaskTerm& term, Problem& problem);

}  // namespace dyntape
