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
// success() is the whole verdict, the same as that of the command `dyntape solve`: the solver converged, and what was
// found meets `VerifyOptions`, computed anew.  converged() is the solver's own word alone.  Where a motion converges and is
// re-simulated to something else, use a finer mesh.
//
// Errors.  ArgumentError: a start of the wrong size, or with entries that are no numbers.  NumericalError: derivatives
// that are not those of the functions, with the first rows and variables by name; functions that are not finite at the
// start.  How the solve ended is no error but a status.
#pragma once

#include <dyntape/interface/control/discretize/collocation.h>
#include <dyntape/interface/control/discretize/verify.h>
#include <dyntape/interface/control/nlp/derivative_check.h>
#include <dyntape/interface/control/nlp/kkt.h>
#include <dyntape/interface/control/nlp/solver_options.h>

namespace dyntape {

enum class OptimiseStep { kChecking, kSolving, kVerifying };

// What a solution has to meet, computed anew, before it is called one.
struct VerifyOptions {
  // Most that the motion may break a constraint by, relative to nominal values (verify.h).
  double violation = 1e-6;
  // Of the gradient of the Lagrangian, relative to nominal values (kkt.h); or ten times the solver's tolerance, which weighs
  // it by large multipliers, where that is more.  Optima of the shipped tasks stay below 1e-6; multipliers that are lost
  // leave it near one.
  double stationarity = 1e-4;
  // Of multipliers times distances from their bounds (kkt.h), where one unit is a hundredth of what the cost amounts to.
  double complementarity = 1e-5;
  // Most that an interval may differ from its re-simulation, as a part of how far the motion moves each state (verify.h).  A
  // thousandth of the motion is what a controller corrects without being seen to, and less than a robot's masses are
  // known to; a mesh that is fine enough for its motion stays below it by orders.
  double integration_error = 1e-3;
};

// The first-order conditions, and the second-order one where it is known; NaN meets nothing.
bool is_optimal(const KktResiduals& kkt, StationaryPoint order, const VerifyOptions& demands);
bool is_feasible(const Verification& verification, const VerifyOptions& demands);
bool is_accurate(const Verification& verification, const VerifyOptions& demands);

struct OptimiseOptions {
  MeshOptions mesh = {};
  SolverOptions solver = {};  // a request to solver.stop ends the verification's simulations as well
  bool check_derivatives = true;
  bool verify = true;  // false: success() is silent on what the motion is worth
  VerifyOptions demands = {};
  std::function<void(OptimiseStep)> enter = {};  // told of each step when it begins
};

struct Solution {
  NlpSolution nlp;
  Trajectory motion;
  DerivativeCheck derivatives;
  KktResiduals kkt;  // relative to the nominal values of the last round (ipopt.h), as the verification is
  Verification verification;
  double build_seconds = 0, check_seconds = 0, verify_seconds = 0;  // the solve's: nlp.times

  VerifyOptions demands = {};  // that success() asks for

  bool converged() const { return nlp.status == SolveStatus::kSolved; }
  bool success() const {
    return converged() && is_optimal(kkt, nlp.stationary_point, demands) &&
           is_feasible(verification, demands) && is_accurate(verification, demands);
  }
  double cost() const { return nlp.objective; }
};

Solution optimise(const Problem& problem, const OptimiseOptions& options = {});

// What of it goes before a solve: the errors above, and the check of the derivatives where it is asked for.
DerivativeCheck checked_start(Nlp& nlp, const std::string& problem, const std::vector<double>& start,
                              bool check_derivatives);

// The demands, with the stationarity that a solver's tolerance allows.
VerifyOptions allowing(VerifyOptions demands, const SolverOptions& solver);

// The same on a program that exists already, from any start (a warm one, say).  The program's own mesh and kind of
// Hessian hold; options.mesh is not read.
Solution optimise(Collocation& nlp, const std::vector<double>& start, const OptimiseOptions& options);

}  // namespace dyntape
