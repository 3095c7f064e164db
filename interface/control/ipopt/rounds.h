// SPDX-License-Identifier: BSD-3-Clause
//
// Solves in units of the program's nominal values, and again if these were too large (ipopt.h, "Rounds").
#pragma once

#include <functional>

#include <dyntape/interface/control/nlp/solver_options.h>

namespace dyntape {

// Solves the scaled program from a start; `warm` (or null) is a solution whose multipliers are used too.  Each
// further round starts at the end of the previous one.
using RoundSolver = std::function<NlpSolution(Nlp&, const std::vector<double>&, const SolverOptions&,
                                              const NlpSolution* warm)>;

// The remaining iterations and time after a solve.
SolverOptions less(SolverOptions options, const NlpSolution& spent);
// The last of two solves, with the sums of iterations and times.
NlpSolution joined(NlpSolution first, NlpSolution last);

// `solve` gets the scaled program; limits of iterations and time hold for all rounds together.
NlpSolution solve_in_rounds(Nlp& problem, const std::vector<double>& start, const SolverOptions& options,
                            const RoundSolver& solve);

}  // namespace dyntape
