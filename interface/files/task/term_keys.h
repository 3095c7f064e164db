// SPDX-License-Identifier: BSD-3-Clause
//
// Reads the block `terms` of a task file: ready terms by name, each a row of a table (term_keys.cpp).
//
//   terms {
//     term upright {                   ; the word `term`, then its name
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
// A cost with bounds penalises values beyond them: a soft limit (penalties.h).  Faults are noted in the section
// (Section::finish reports them).  Without a robot the keys are known but not read.
#pragma once

#include <vector>

#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/task/task_spec.h>

namespace dyntape {

// task: its scene, and the unit of its controls.
std::vector<TermSpec> read_terms(io::Section& file, const TaskSpec& task,
                                 const dynamics::Model<double>* model);

// Contradictions, each with a key of the term.
std::vector<SpecFault> faults_of(const TermSpec& term, const TaskSpec& task);

// A moving target is a parameter of the problem, "<name of the term> target".
void add(const TermSpec& term, const TaskSpec& task, Problem& problem);
// Whether a moving target is a place or a rotation (moving_target.h).
TargetOverTime target_over_time(const TermSpec& term);
// The first term that draws the origin of a frame to a moving target; null: none.
const TermSpec* follower(const std::vector<TermSpec>& terms);

}  // namespace dyntape
