// SPDX-License-Identifier: BSD-3-Clause
//
// What a solve found, computed anew, and whether it is what was asked for.
//
//   const Solution s = optimise(problem);                        // optimise.h
//   if (s.success()) plot(s.motion.t, s.motion.x);
//   const Solution jump = optimise(phases, {.meshes = ...});
//   jump.phases[1].motion                                        // the flight, from t = 0; it begins at phases[1].begin
//
// success() is the verdict of every door: `dyntape solve`, C++ and Python.  The solver converged, and what was found meets
// `VerifyOptions`.  converged() is the solver's own word alone.  Where a motion converges and is re-simulated to something
// else, use a finer mesh.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include <dyntape/interface/control/discretize/verify.h>
#include <dyntape/interface/control/nlp/derivative_check.h>
#include <dyntape/interface/control/nlp/kkt.h>
#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

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
  // Most that an inequality or a bound may be passed between points, relative to how far the motion moves in that interval (passings.h).
  double between = 1e-3;
  // Most that the scheme's quadrature may differ from the integral of the costs, relative to the sum of their magnitudes.
  double cost_error = 5e-3;
};

// What came of one mesh.
struct MeshRound {
  int intervals = 0, iterations = 0;
  double seconds = 0;  // of the solve and its verification
  double cost = 0, relative_defect = 0;
  SolveStatus status = SolveStatus::kSolverError;
  double relaxation = 0;              // m, of rigid contacts (implicit_contacts.h); 0: there are none
  double passed = 0, cost_error = 0;  // the largest excess between points; the error of the quadrature
};

// The first-order conditions, and the second-order one where it is known; NaN meets nothing.
bool is_optimal(const KktResiduals& kkt, StationaryPoint order, const VerifyOptions& demands);
bool is_feasible(const Verification& verification, const VerifyOptions& demands);
// Whether the motion is what its controls do, keeps its rows between points, and costs what the solver says: what a finer mesh mends.
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
  // The whole motion; of phases one after another, so that where two meet there are two points of one time.  It has the
  // controls of all phases, by name, zero where a phase has none; of phases with different numbers of states it has no points.
  Trajectory motion;
  // The worst of all phases and of the links between them; intervals are counted through, names begin with the phase: "flight: v.knee".
  Verification verification;
  std::vector<SolvedPhase> phases;  // of a problem alone one
  double link_violation = 0;  // what links lack, relative to the nominal values of the states that they set
  DerivativeCheck derivatives;
  KktResiduals kkt;  // relative to the nominal values of the last round (ipopt.h), as the verification is
  double cost_at_start = 0;  // OptimiseOptions::cost_at_start, or that of this mesh's start if it is more
  double build_seconds = 0, check_seconds = 0, verify_seconds = 0;  // the solve's: nlp.times

  VerifyOptions demands = {};  // that success() asks for

  std::vector<MeshRound> meshes = {};   // coarsest first; of solve() (solve.h)
  std::string refinement_trouble = {};  // why a finer mesh was given up, or ""
  // How far the cost is from that of a coarser mesh, relative to its size; NaN of one mesh.  The coarser one is the last before all intervals
  // were split in which controls had changed (SolveOptions::cost_change); if none was split for that, it is the mesh before.
  double cost_change = std::numeric_limits<double>::quiet_NaN();

  bool converged() const { return nlp.status == SolveStatus::kSolved; }
  bool success() const {
    return converged() && is_optimal(kkt, nlp.stationary_point, demands) &&
           is_feasible(verification, demands) && is_accurate(verification, demands);
  }
  double cost() const { return nlp.objective; }
  int iterations() const;       // on all meshes
  std::string verdict() const;  // a sentence for people, the same for `dyntape solve`, C++ and Python
};

// Parts of verdicts.  " The constraint violated most is goal of panda_hand[0], by 2.1e-01 of its magnitude.", or "" where all hold.
std::string of_violated(const Solution& solution);
// What was done about the mesh, or could be: " after 3 refinements of the mesh."
std::string of_mesh(const Solution& solution);

// One motion of several; `controls` names those of the whole in their order, empty: as they appear.
Trajectory whole_motion(const std::vector<SolvedPhase>& phases,
                        const std::vector<std::vector<std::string>>& controls_of_phases,
                        std::vector<std::string> controls = {});
Verification whole_verification(const std::vector<SolvedPhase>& phases, double link_violation);

}  // namespace dyntape
