// SPDX-License-Identifier: BSD-3-Clause
//
// A motion in phases as one: what is reported, drawn and written.  Of a task without phases it is that motion itself.
//
//   report.solution = whole(task, phases);
//   report.solution.motion.u        controls of the task: forces of all contacts, zero where a phase does not hold them
//
// Where phases meet there are two points of one time.  Rows and states of a verification have the phase before them,
// "flight: v.knee", and its intervals are counted through.
#pragma once

#include <dyntape/interface/control/solve/optimise_phases.h>
#include <dyntape/interface/files/task/limits.h>

namespace dyntape {

// The task itself, or its phases.
std::vector<const Task*> parts_of(const Task& task);

Solution whole(const Task& task, const PhasedSolution& phases);
// The worst of the phases and of the links between them.
Verification whole_verification(const Task& task, const PhasedSolution& phases);
std::vector<LimitExcess> excesses_of(const Task& task, const PhasedSolution& phases);

}  // namespace dyntape
