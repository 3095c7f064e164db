// SPDX-License-Identifier: BSD-3-Clause
//
// A solve in units of the program's nominal values, and again where these turn out to have been too large (ipopt.h, "Rounds").
#pragma once

#include <functional>

#include <dyntape/interface/control/nlp/solver_options.h>

namespace dyntape {

// Of the scaled program, from a start, and with `warm` (or null) going on from that solution's multipliers as well: a round behind the first
// begins where the one before ended.
using RoundSolver = std::function<NlpSolution(Nlp&, const std::vector<double>&, const SolverOptions&,
                                              const NlpSolution* warm)>;

// What is left of the iterations and the time after a solve.
SolverOptions less(SolverOptions options, const NlpSolution& spent);
// The last of two solves, with the iterations and times of both.
NlpSolution joined(NlpSolution first, NlpSolution last);

// `solve` sees the scaled program; options of iterations and time hold for all rounds together.
NlpSolution solve_in_rounds(Nlp& problem, const std::vector<double>& start, const SolverOptions& options,
                            const RoundSolver& solve);

}  // namespace dyntape
