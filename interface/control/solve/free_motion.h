// SPDX-License-Identifier: BSD-3-Clause
//
// An alternative start for a solver: the motion that the problem makes with the controls of its guess.
//
//   solution.nlp = solve_or_let_go(nlp, start, options, [&] { return nlp.variables(*free_motion(nlp)); });
//
// A guess is often the straight line from start to goal.  If this line needs forces beyond all limits, e.g. a pole
// at rest at an angle, a solver may stop where no step reduces the violation, although a falling and swinging motion
// is near.
#pragma once

#include <functional>
#include <optional>

#include <dyntape/interface/control/discretize/staged_nlp.h>
#include <dyntape/interface/control/nlp/solver_options.h>

namespace dyntape {

// Simulates from the problem's start with the controls of the guess, clamped to their bounds, at the points of the
// program.  The error at a given goal is subtracted in proportion to time.  Returns nothing if the start is not
// completely given, or the simulation fails.
std::optional<Trajectory> free_motion(const StagedNlp& program);

// solve_nlp from a start; if it fails (solver_options.h), again from `elsewhere`, if given.
NlpSolution solve_or_let_go(Nlp& program, const std::vector<double>& start, const SolverOptions& options,
                            const std::function<std::optional<std::vector<double>>()>& elsewhere);

}  // namespace dyntape
