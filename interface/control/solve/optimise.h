// SPDX-License-Identifier: BSD-3-Clause
//
// Solves a problem, or a problem in phases, on a given mesh, and verifies the motion.  Use solve() (solve.h) unless
// the mesh is given.
//
//   const Solution s = optimise(problem, {.mesh = {.intervals = 40}});
//   // or solve(problem), which chooses the mesh (solve.h)
//   if (s.success()) plot(s.motion.t, s.motion.x);
//   const Solution jump = optimise(phases, {.meshes = {{.intervals = 20}, {.intervals = 10}, {.intervals = 20}}});
//
// Steps:
//
// - record and differentiate the stages
// - check the derivatives at a random point near the start, and that everything is finite there
// - solve
// - compute the optimality conditions
// - verify each phase (verify.h) and the links between phases, with the functions in plain double
//
// Errors.  The result of the solve is a status, not an error.  ArgumentError: a start of wrong size or not finite.
// NumericalError: wrong derivatives, with the first rows and variables by name; functions that are not finite at the
// start.
#pragma once

#include <dyntape/interface/control/discretize/staged_nlp.h>
#include <dyntape/interface/control/nlp/solver_options.h>
#include <dyntape/interface/control/solve/solution.h>

namespace dyntape {

enum class OptimiseStep { kChecking, kSolving, kVerifying };

struct OptimiseOptions {
  MeshOptions mesh = {};
  std::vector<MeshOptions> meshes = {};  // one per phase; empty: `mesh` for all
  SolverOptions solver = {};             // solver.stop also ends the simulations of the verification
  bool check_derivatives = true;
  bool verify = true;  // false: success() does not depend on re-simulation
  VerifyOptions demands = {};
  // The cost of the first mesh's initial motion.  If the cost is close to zero, its error is relative to a
  // thousandth of this cost.
  double cost_at_start = 0;
  std::function<void(OptimiseStep)> enter = {};  // called at the beginning of each step
};

Solution optimise(const Problem& problem, const OptimiseOptions& options = {});
Solution optimise(const Phases& phases, const OptimiseOptions& options = {});

// Checks the program before a solve: throws the errors listed above and, if requested, compares derivatives with
// finite differences.
DerivativeCheck checked_start(Nlp& nlp, const std::string& problem, const std::vector<double>& start,
                              bool check_derivatives);

// Returns `demands`, with a stationarity of at least ten times the solver's tolerance.
VerifyOptions allowing(VerifyOptions demands, const SolverOptions& solver);

// Solves an existing program from any start, e.g. a warm start.  The program has its own meshes and kind of Hessian;
// options.mesh and .meshes are ignored.
Solution optimise(StagedNlp& nlp, const std::vector<double>& start, const OptimiseOptions& options);

}  // namespace dyntape
