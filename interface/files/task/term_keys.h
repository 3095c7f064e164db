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
//   for (const TermSpec& term : read_terms(file, task, model)) add(term, task, problem);
//
// A cost with bounds weighs what lies beyond them: a soft limit (penalties.h).  What is wrong is noted in the section
// (Section::finish reports it); without a robot the keys are known but not read.
#pragma once

#include <vector>

#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/task/task_spec.h>

namespace dyntape {

// task: its scene and the unit of its controls.
std::vector<TermSpec> read_terms(io::Section& file, const TaskSpec& task,
                                 const dynamics::Model<double>* model);

// What does not go together, each with a key of the term.
std::vector<SpecFault> faults_of(const TermSpec& term, const TaskSpec& task);

// A target that moves is a parameter of the problem, "<name of the term> target".
void add(const TermSpec& term, const TaskSpec& task, Problem& problem);
// Of one that moves: a place, or a turn (moving_target.h).
TargetOverTime target_over_time(const TermSpec& term);
// The first term that draws the origin of a frame to a target that moves; null: there is none.
const TermSpec* follower(const std::vector<TermSpec>& terms);

}  // namespace dyntape
