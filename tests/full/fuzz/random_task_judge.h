// SPDX-License-Identifier: BSD-3-Clause
//
// Whether a motion that is called solved is what its task asks for, by code that shares nothing with the solvers but the
// articulated-body algorithm: chains of turns, Runge-Kutta steps, schemes and costs written out once more.
//
//   const std::string fault = fault_of(task, report, by_ddp);          // one sentence; "": none was found
//
//   ends       it begins at the start and ends at rest at the goal; by ddp to what verify.goal_error allows
//   intervals  each, integrated from its first state, ends where the next begins: to the task's 1e-3 of the motion, and off by
//              what the report says of it
//   the whole  the controls alone lead from the start to where the report's open-loop error says
//   limits     of states along the integrated intervals, of controls at the points of the mesh
//   clearance  of all bodies from all obstacles along the integrated intervals
//   cost       by the scheme's quadrature, as reported
#pragma once

#include <string>

#include <dyntape/interface/run/solve/solve_report.h>

#include "random_task.h"

namespace dyntape::testing {

std::string fault_of(const RandomTask& task, const SolveReport& report, bool by_ddp);

}  // namespace dyntape::testing
