// SPDX-License-Identifier: BSD-3-Clause
//
// Where a solver may begin besides the guess: the motion that a problem makes by itself.
//
//   solution.nlp = solve_or_let_go(nlp, start, options, [&] { return nlp.variables(*free_motion(nlp)); });
//
// A guess is often the line from the start to the goal.  Where that asks for forces beyond all limits, as of a pole that is to
// hang still at an angle, a solver may end where no step lessens the violation, although a motion is near that falls and swings.
#pragma once

#include <functional>
#include <optional>

#include <dyntape/interface/control/discretize/staged_nlp.h>
#include <dyntape/interface/control/nlp/solver_options.h>

namespace dyntape {

// From the problem's start, by the controls of its guess within their bounds, at the points of the program; the error at a given
// goal is taken off in proportion to time.  Nothing where the start is not given as a whole, or the motion breaks off.
std::optional<Trajectory> free_motion(const StagedNlp& program);

// solve_nlp from a start; where it gets stuck (solver_options.h), once more from `elsewhere`, if there is such a place.
NlpSolution solve_or_let_go(Nlp& program, const std::vector<double>& start, const SolverOptions& options,
                            const std::function<std::optional<std::vector<double>>()>& elsewhere);

}  // namespace dyntape
