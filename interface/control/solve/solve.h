// SPDX-License-Identifier: BSD-3-Clause
//
// Solves an optimal control problem, refines its mesh until the motion is true, and verifies it.
//
//   const Solution s = solve(problem);
//   if (s.success()) plot(s.motion.t, s.motion.x);
//   else std::cerr << s.verdict() << "\n";
//   for (const MeshRound& mesh : s.meshes) std::cerr << mesh.intervals << ": " << mesh.cost << "\n";
//
// Use this function unless the mesh is given: optimise() (optimise.h) solves on one mesh.  `dyntape solve` and Python's
// Problem.solve call the same loop.
//
// Steps: optimise() on the first mesh.  While the verification finds an interval whose re-simulation differs, a row that is passed
// between points, or costs that the quadrature misses, split the intervals where that is, and solve again from the last motion.  If more
// than a quarter of the intervals is at fault, halve all.  If asked for (`cost_change`), halve all intervals once more and compare the
// costs; while they differ, split all intervals in which the controls of the two meshes differ.
//
// A mesh that will be refined is solved until its cost has settled (settling.h); the last one is solved to the end.
//
// The first mesh: options.mesh, by default 20 intervals of radau-3; with `warm` the last mesh of that solution.  `is_graded` adds a node
// behind each instant at which a constraint stands (at_fraction()), because controls may jump there.
// A finer mesh that takes three times the iterations of the last one starts again from the guess.
//
// Errors: those of optimise() on the first mesh.  A finer mesh that cannot be solved is given up: Solution::refinement_trouble.
#pragma once

#include <memory>

#include <dyntape/interface/control/solve/optimise.h>

namespace dyntape {

struct SolveOptions : OptimiseOptions {
  // Radau's points: of order 5, and controls may jump at nodes, so that limits hold along constrained arcs.
  SolveOptions() { mesh.scheme = radau(3), mesh.intervals = 20; }

  // An earlier solution of the problem, or of one whose values differ: begins on its last mesh, with its point and multipliers.
  std::shared_ptr<const Solution> warm = {};
  int refinements = 20;       // at most
  int most_intervals = 5000;  // of all phases together
  double cost_change =
      1e-4;  // most that the cost may differ from a mesh twice as coarse where controls change, relative; infinite: not asked
  bool is_graded = true;
};

// options.solver's limits of iterations and time hold for all meshes together.
Solution solve(const Problem& problem, const SolveOptions& options = {});
Solution solve(const Phases& phases, const SolveOptions& options = {});

// Of each interval of a phase, how far it is from what is demanded: above 1 the demand is not met.
using MeshFaults = std::vector<Eigen::VectorXd>;

// The loop alone, for callers who solved the first mesh themselves, or who demand more of a motion.
struct RefineSteps {
  int refinements = 0, most_intervals = 0;
  double cost_change = HUGE_VAL;
  std::function<OptimiseOptions()> options;                           // for the next mesh
  std::function<void(const Solution&, MeshFaults&)> add_faults = {};  // of demands besides the verification's
  std::function<void(StagedNlp& finer)> prepare = {};
  std::function<void(int intervals)> begin = {};     // is told of each finer mesh
  std::function<void(const Solution&)> solved = {};  // and of what came of it
};
// Replaces `program` and `solution` by those of the finest mesh that was solved.
void refine(std::unique_ptr<StagedNlp>& program, Solution& solution, const RefineSteps& steps);

// A row for Solution::meshes.
MeshRound round_of(const Solution& solution);

// Variables of a program on another mesh: the motions of all its phases, interpolated and clamped to the variables' bounds.
std::vector<double> warm_start(const std::vector<Trajectory>& motions, const StagedNlp& program);

}  // namespace dyntape
