// SPDX-License-Identifier: BSD-3-Clause
//
// Solves a problem, or a motion in phases, on one given mesh, and verifies the motion.
//
//   const Solution s = optimise(problem, {.mesh = {.intervals = 40}});
//   // or solve(problem), which chooses the mesh (solve.h)
//   if (s.success()) plot(s.motion.t, s.motion.x);
//   const Solution jump = optimise(phases, {.meshes = {{.intervals = 20}, {.intervals = 10}, {.intervals = 20}}});
//
// Steps: record and derive the stages, check the derivatives at a random point near the start, check that everything is finite
// there, let the solver solve, compute the optimality conditions anew, verify each phase (verify.h) and the links between them,
// which are run as they are.
//
// Errors.  ArgumentError: a start of the wrong size, or with entries that are no numbers.  NumericalError: derivatives
// that are not those of the functions, with the first rows and variables by name; functions that are not finite at the
// start.  How the solve ended is no error but a status.
#pragma once

#include <dyntape/interface/control/discretize/staged_nlp.h>
#include <dyntape/interface/control/nlp/solver_options.h>
#include <dyntape/interface/control/solve/solution.h>

namespace dyntape {

enum class OptimiseStep { kChecking, kSolving, kVerifying };

struct OptimiseOptions {
  MeshOptions mesh = {};
  std::vector<MeshOptions> meshes = {};  // of phases, one each; empty: `mesh` for all
  SolverOptions solver = {};  // a request to solver.stop ends the verification's simulations as well
  bool check_derivatives = true;
  bool verify = true;  // false: success() is silent on what the motion is worth
  VerifyOptions demands = {};
  // The cost of the motion that the first mesh began with: errors of a cost that nearly vanishes are measured by a thousandth of it.
  double cost_at_start = 0;
  std::function<void(OptimiseStep)> enter = {};  // told of each step when it begins
};

Solution optimise(const Problem& problem, const OptimiseOptions& options = {});
Solution optimise(const Phases& phases, const OptimiseOptions& options = {});

// What of it goes before a solve: the errors above, and the check of the derivatives where it is asked for.
DerivativeCheck checked_start(Nlp& nlp, const std::string& problem, const std::vector<double>& start,
                              bool check_derivatives);

// The demands, with the stationarity that a solver's tolerance allows.
VerifyOptions allowing(VerifyOptions demands, const SolverOptions& solver);

// The same on a program that exists already, from any start (a warm one, say).  The program's own meshes and kind of Hessian hold;
// options.mesh and .meshes are not read.
Solution optimise(StagedNlp& nlp, const std::vector<double>& start, const OptimiseOptions& options);

}  // namespace dyntape
