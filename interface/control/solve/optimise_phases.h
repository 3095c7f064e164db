// SPDX-License-Identifier: BSD-3-Clause
//
// From a motion in phases (phases.h) to a verified one, as optimise.h does it for a single problem:
//
//   const PhasedSolution s = optimise(jump, {.meshes = {{.intervals = 20}, {.intervals = 10}, {.intervals = 20}}});
//   if (s.success()) plot(s.motions[1].t, s.motions[1].x);                    // the flight, from t = 0
//   s.begin(1)                                                                // s, when it begins
//
// Each phase is verified by itself (verify.h); `link_violation` is what links lack, found by running them as they are, relative to the
// nominal values of the states that they set.
//
// Errors: those of optimise.h and phased_collocation.h.
#pragma once

#include <dyntape/interface/control/discretize/phased_collocation.h>
#include <dyntape/interface/control/solve/optimise.h>

namespace dyntape {

struct PhasedOptions {
  std::vector<MeshOptions> meshes = {{}};  // one a phase, or one for all
  SolverOptions solver = {};
  bool check_derivatives = true;
  bool verify = true;
  VerifyOptions demands = {};
};

struct PhasedSolution {
  NlpSolution nlp;
  std::vector<Trajectory> motions;  // one a phase, each from t = 0
  DerivativeCheck derivatives;
  KktResiduals kkt;
  std::vector<Verification> verifications;  // one a phase
  double link_violation = 0;
  double build_seconds = 0, check_seconds = 0, verify_seconds = 0;

  VerifyOptions demands = {};  // that success() asks for

  bool converged() const { return nlp.status == SolveStatus::kSolved; }
  bool success() const;  // as of a Solution, of every phase, and links within demands.violation
  double cost() const { return nlp.objective; }
  double begin(std::size_t phase) const;  // s; ArgumentError where there is no such phase
  // All points of phases with as many states, one after another in time; where two phases meet there are two.
  struct States {
    Eigen::VectorXd t;  // (points) s
    Eigen::MatrixXd x;  // (n_x x points)
  };
  States states() const;
};

PhasedSolution optimise(const Phases& phases, const PhasedOptions& options = {});

// The same on a program of these phases that exists already, from any start; options.mesh is not read.
PhasedSolution optimise(PhasedCollocation& nlp, const Phases& phases, const std::vector<double>& start,
                        const OptimiseOptions& options);

}  // namespace dyntape
