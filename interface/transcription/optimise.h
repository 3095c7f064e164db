// SPDX-License-Identifier: BSD-3-Clause
//
// From a problem to a verified motion in one call.
//
//   const Solution s = optimise(problem, {.mesh = {.intervals = 40}});
//   if (s.success()) plot(s.motion.t, s.motion.x);
//
// Steps: record and derive the stage, check the derivatives at a random point near the start, check that
// everything is finite there, let Ipopt solve, compute the optimality conditions anew, verify the motion
// (verify.h).
//
// Errors.  ArgumentError: a start of the wrong size, or with entries that are no numbers.  NumericalError: derivatives
// that are not those of the functions, with the first rows and variables by name; functions that are not finite at the
// start.  How the solve ended is no error but a status.
#pragma once

#include <dyntape/interface/solvers/derivative_check.h>
#include <dyntape/interface/solvers/kkt.h>
#include <dyntape/interface/solvers/solver_options.h>
#include <dyntape/interface/transcription/collocation.h>
#include <dyntape/interface/transcription/verify.h>

namespace dyntape {

enum class OptimiseStep { kChecking, kSolving, kVerifying };

struct OptimiseOptions {
  MeshOptions mesh = {};
  SolverOptions solver = {};  // a request to solver.stop ends the verification's simulations as well
  bool check_derivatives = true;
  bool verify = true;
  std::function<void(OptimiseStep)> enter = {};  // told of each step when it begins
};

struct Solution {
  NlpSolution nlp;
  Trajectory motion;
  DerivativeCheck derivatives;
  KktResiduals kkt;  // relative to the magnitudes of the last round (ipopt.h), as the verification is
  Verification verification;
  double build_seconds = 0, check_seconds = 0, verify_seconds = 0;  // the solve's: nlp.times

  bool success() const { return nlp.status == SolveStatus::kSolved; }
  double cost() const { return nlp.objective; }
};

Solution optimise(const Problem& problem, const OptimiseOptions& options = {});

// What of it goes before a solve: the errors above, and the check of the derivatives where it is asked for.
DerivativeCheck checked_start(Nlp& nlp, const std::string& problem, const std::vector<double>& start,
                              bool check_derivatives);

// The same on a program that exists already, from any start (a warm one, say).  The program's own mesh and kind of
// Hessian hold; options.mesh is not read.
Solution optimise(Collocation& nlp, const std::vector<double>& start, const OptimiseOptions& options);

}  // namespace dyntape
