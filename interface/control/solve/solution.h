// SPDX-License-Identifier: BSD-3-Clause
//
// The result of a solve, with its verification.
//
//   const Solution s = optimise(problem);                        // optimise.h
//   if (s.success()) plot(s.motion.t, s.motion.x);
//   const Solution jump = optimise(phases, {.meshes = ...});
//   jump.phases[1].motion                                  // the second phase, from t = 0; starts at phases[1].begin
//
// success() is the verdict in C++, in Python and in `dyntape solve`: the solver converged, and the solution meets
// `VerifyOptions`.  converged() is the solver's status only.  If a solve converges but re-simulation differs, use a
// finer mesh.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include <dyntape/interface/control/discretize/verify.h>
#include <dyntape/interface/control/nlp/derivative_check.h>
#include <dyntape/interface/control/nlp/kkt.h>
#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

// The conditions of success(), computed independently of the solver.
struct VerifyOptions {
  // Largest violation of a constraint, relative to nominal values (verify.h).
  double violation = 1e-6;
  // Largest gradient of the Lagrangian, relative to nominal values (kkt.h); at least ten times the solver's
  // tolerance, since the solver's error is divided by a weight if multipliers are large.  Optima of the shipped tasks
  // are below 1e-6; wrong multipliers give about 1.
  double stationarity = 1e-4;
  // Largest product of a multiplier and the distance to its bound (kkt.h), in units of a hundredth of the cost.
  double complementarity = 1e-5;
  // Largest difference between an interval and its re-simulation, relative to the range of each state (verify.h).  A
  // thousandth of the motion is below the accuracy of a robot's masses, and a controller corrects it easily.  A mesh
  // that resolves the motion is better by orders of magnitude.
  double integration_error = 1e-3;
  // Largest violation of an inequality or bound between points, relative to the motion in that interval
  // (passings.h).
  double between = 1e-3;
  // Largest difference of the scheme's quadrature and the integral of the costs, relative to the sum of their
  // magnitudes.
  double cost_error = 5e-3;
};

// The result of one mesh.
struct MeshRound {
  int intervals = 0, iterations = 0;
  double seconds = 0;  // of the solve and its verification
  double cost = 0, relative_defect = 0;
  SolveStatus status = SolveStatus::kSolverError;
  double relaxation = 0;              // m, of rigid contacts (implicit_contacts.h); 0: no rigid contacts
  double passed = 0, cost_error = 0;  // largest violation between points; error of the quadrature
  SolveTimes times = {};              // of the solve
  double verify_seconds = 0;
};

// The first-order conditions, and the second-order one if known.  A NaN is a failure.
bool is_optimal(const KktResiduals& kkt, StationaryPoint order, const VerifyOptions& demands);
bool is_feasible(const Verification& verification, const VerifyOptions& demands);
// Returns true if re-simulation reproduces the motion, constraints hold between points, and the cost is accurate.  A
// finer mesh can fix a false result.
bool is_accurate(const Verification& verification, const VerifyOptions& demands);

struct SolvedPhase {
  std::string name;
  double begin;       // s
  Trajectory motion;  // from t = 0
  Verification verification;
  double duration() const { return motion.t[motion.points() - 1]; }
};

struct Solution {
  NlpSolution nlp;
  // The whole motion.  With phases, the point between two phases appears twice.  It has the controls of all phases
  // by name, zero in phases without them.  If phases have different numbers of states, it has no points.
  Trajectory motion;
  // The worst of all phases and links.  Intervals are numbered consecutively over all phases; names begin with the
  // phase: "flight: v.knee".
  Verification verification;
  std::vector<SolvedPhase> phases;  // one entry for a problem without phases
  double link_violation =
      0;  // largest violation of links, relative to the nominal values of the states that they set
  DerivativeCheck derivatives;
  KktResiduals kkt;  // relative to the nominal values of the last round (ipopt.h), like the verification
  double cost_at_start = 0;  // OptimiseOptions::cost_at_start, or the cost of this mesh's start if larger
  double build_seconds = 0, check_seconds = 0, verify_seconds = 0;  // of the last mesh; times()

  VerifyOptions demands = {};  // of success()

  std::vector<MeshRound> meshes = {};   // of solve() (solve.h), coarsest first
  std::string refinement_trouble = {};  // why a finer mesh was not solved, or ""
  // Relative difference of the cost from a coarser mesh; NaN if there is one mesh only.  The coarser mesh is the
  // last one before all intervals with changing controls were split (SolveOptions::cost_change), or else the
  // previous mesh.
  double cost_change = std::numeric_limits<double>::quiet_NaN();

  bool converged() const { return nlp.status == SolveStatus::kSolved; }
  bool success() const {
    return converged() && is_optimal(kkt, nlp.stationary_point, demands) &&
           is_feasible(verification, demands) && is_accurate(verification, demands);
  }
  double cost() const { return nlp.objective; }
  int iterations() const;       // on all meshes
  SolveTimes times() const;     // of the solves of all meshes
  std::string verdict() const;  // one sentence, the same in `dyntape solve`, C++ and Python
};

// Parts of verdicts.  " The constraint violated most is goal of panda_hand[0], by 2.1e-01 of its magnitude.", or "".
std::string of_violated(const Solution& solution);
// The refinement of the mesh, or advice on it: " after 3 refinements of the mesh."
std::string of_mesh(const Solution& solution);

// Joins the motions of phases.  `controls`: all controls in their order; empty: in order of appearance.
Trajectory whole_motion(const std::vector<SolvedPhase>& phases,
                        const std::vector<std::vector<std::string>>& controls_of_phases,
                        std::vector<std::string> controls = {});
Verification whole_verification(const std::vector<SolvedPhase>& phases, double link_violation);

}  // namespace dyntape
