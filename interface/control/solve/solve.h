// SPDX-License-Identifier: BSD-3-Clause
//
// Solves an optimal control problem, refines the mesh until re-simulation reproduces the trajectory, and verifies
// it.
//
//   const Solution s = solve(problem);
//   if (s.success()) plot(s.motion.t, s.motion.x);
//   else std::cerr << s.verdict() << "\n";
//   for (const MeshRound& mesh : s.meshes) std::cerr << mesh.intervals << ": " << mesh.cost << "\n";
//
// Use this function unless the mesh is given: optimise() (optimise.h) solves on one mesh.  `dyntape solve` and Python's
// Problem.solve call the same loop.
//
// Steps:
//
// - Call optimise() on the first mesh.
// - The verification marks an interval if its re-simulation differs, a constraint is violated between points, or
// the quadrature of the cost is inaccurate.  Split these intervals and solve again from the last motion, with a small
// initial barrier parameter.
// If more than a quarter of the intervals is marked, halve all.
// - If `cost_change` is finite, halve all intervals once more and compare the costs.  While the costs differ,
// split all intervals in which the controls of the two meshes differ.
// Once they agree, split until the quadrature is as accurate as `cost_change`.
//
// On a mesh that will be refined, the solver stops when the cost has settled (settling.h); the last mesh is solved
// to the tolerance.
//
// First mesh: options.mesh, by default 20 intervals of radau-3; with `warm` the last mesh of that solution.
// `is_graded` adds a node after each instant with a constraint (at_fraction()), since controls may jump there.  If a
// mesh takes 3 times the iterations of the last mesh (at least 120), halves all intervals and starts from the guess.
//
// Errors.  Those of optimise() on the first mesh.  If a finer mesh cannot be solved, the result is that of the last
// solved mesh, and Solution::refinement_trouble has the reason.
#pragma once

#include <memory>

#include <dyntape/interface/control/solve/optimise.h>

namespace dyntape {

struct SolveOptions : OptimiseOptions {
  // Radau's points: order 5; controls may jump at nodes, so that limits hold along constrained arcs.
  SolveOptions() { mesh.scheme = radau(3), mesh.intervals = 20; }

  // A solution of this problem, or of one with other values.  The solve starts on its last mesh from its point and
  // multipliers.
  std::shared_ptr<const Solution> warm = {};
  int refinements = 20;       // most refinements
  int most_intervals = 5000;  // most intervals of all phases together
  double cost_change =
      1e-4;  // largest relative difference of the cost from the coarser mesh; infinite: not checked
  bool is_graded = true;
};

// The limits of iterations and time in options.solver hold for all meshes together.
Solution solve(const Problem& problem, const SolveOptions& options = {});
Solution solve(const Phases& phases, const SolveOptions& options = {});

// One vector per phase (intervals): the error of each interval divided by its tolerance; above 1: to be split.
using MeshFaults = std::vector<Eigen::VectorXd>;

// Refines from a solved first mesh, for callers with their own first solve or additional demands.
struct RefineSteps {
  int refinements = 0, most_intervals = 0;
  double cost_change = HUGE_VAL;
  std::function<OptimiseOptions()> options;                           // for the next mesh
  std::function<void(const Solution&, MeshFaults&)> add_faults = {};  // adds errors of further conditions
  std::function<void(StagedNlp& finer)> prepare = {};  // changes the problem; then the usual barrier is used
  std::function<void(int intervals)> begin = {};       // called before each finer mesh is solved
  std::function<void(const Solution&)> solved = {};    // called after each finer mesh is solved
};
// Replaces `program` and `solution` by those of the finest solved mesh.
void refine(std::unique_ptr<StagedNlp>& program, Solution& solution, const RefineSteps& steps);

// An entry for Solution::meshes.
MeshRound round_of(const Solution& solution);

// Interpolates the trajectories of all phases onto the mesh of `program` and clamps the values to the variable
// bounds.
std::vector<double> warm_start(const std::vector<Trajectory>& motions, const StagedNlp& program);

}  // namespace dyntape
