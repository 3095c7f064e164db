// SPDX-License-Identifier: BSD-3-Clause
//
// A problem, or a motion in phases, on meshes: variables by stage, rows in blocks, and costs.
//
//   StagedProgram program = discretize(problem, {.scheme = hermite_simpson(), .intervals = 40});
//   StagedNlp nlp(std::move(program));                                    // staged_nlp.h: what solvers evaluate
//
// Variables: z = (x, a, u) of every point, in the order of time, phase by phase.  A node and the points before it within its
// interval are a stage.  Boundary values are variables with equal bounds.  Bounds hold at every point, midpoints included.
//
// Functions of a point (record_stage.h) are recorded and derived once and evaluated at all points: y(x).  Everything else is
// linear in variables and in what they give,
//   rows    g = A x + B y(x)            costs    f = b . y(x)
// so that the Jacobian is A + B dy/dx, and the Hessian of sigma f + lambda . g that of w . y with w = B^T lambda + sigma b: a
// block a point.  A row block is some consecutive rows of A and B, which know what they are:
//
//   defect    alpha x_j + h beta f_j, summed over the points j of an interval         (scheme.h)
//   control   what the scheme demands of the controls of an interval
//   path      rows of terms at a point;  instant: rows of terms that stand at an instant (at_fraction() in problem.h)
//   link      x(0) of a phase less what a link makes of x(T) of the one before it, or of the last one where a motion is closed
//
// Of a phase the defects of all intervals come first, then controls, paths, instants, the end last, and the link from it.  A new kind of
// row is a function in discretize.cpp that appends its blocks, and its name in staged_names.cpp.
//
// Where a scheme leaves the last point unused (Euler), or the first (Radau), its controls and accelerations stay at the guess and its
// path rows are left out; in a motion they are what the scheme's polynomial is there.
//
// Free duration (problem.h).  The phase is scaled_time(problem): one more state in z, and times of points are shares until a
// motion says otherwise.  Multiple shooting (multiple_shooting.h): the rate is what steps make of the state, with further parameters.
//
// With Gauss-Newton's Hessian, 2 r'^T r' of the residuals r of squared costs, the curvature of rows is left out.
//
// Errors: ArgumentError for a problem or phases that do not fit together (check()), meshes that are neither one for all nor one a phase,
// different kinds of Hessian, Gauss-Newton with a cost that is no sum of squares, a program that outgrows the memory or what a solver can count
// (mesh_size.h).
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/control/discretize/evaluation.h>
#include <dyntape/interface/control/discretize/scheme.h>
#include <dyntape/interface/control/nlp/nlp.h>
#include <dyntape/interface/control/problem/phases.h>
#include <dyntape/interface/control/problem/record_stage.h>

namespace dyntape {

struct MeshOptions {
  Scheme scheme = hermite_simpson();
  int intervals = 40;
  // (intervals + 1) node times from 0 to the duration, which the last may miss by rounding; empty: evenly spaced.  Of a free
  // duration their shares count.
  std::vector<double> nodes = {};
  HessianKind hessian = HessianKind::kExact;
  CodegenOptions evaluation = {};  // how functions are made; `order` is the program's own
  // That share the points; 0: as many as there are.  Of a seven-joint arm two take longer than one on 40 intervals,
  // and save a tenth on 4000.
  unsigned threads = 1;
};

// Node times of a mesh: the last is the duration to the bit.  Of an even mesh that has no node where terms stand at an instant,
// the nearest one moves there and those between are spread evenly.  ArgumentError for what is no mesh, for node times without one
// at an instant, for fewer intervals than there are between instants.
std::vector<double> node_times(const Problem& problem, const MeshOptions& options);
// Which node of a mesh stands at a share of its duration; ArgumentError, naming the problem's terms, where none does.
std::size_t node_at_share(const Problem& problem, double share, const std::vector<double>& nodes);

// A phase on its mesh; a problem alone is one.
struct StagedPhase {
  std::string name;
  Problem asked;          // as it was given
  IntervalLength length;  // of `problem`
  Problem problem;        // over a fixed time (scaled_time.h), its rate the scheme's (Scheme::taken_by)
  MeshOptions mesh;       // evaluation.order is set
  RecordedStage stage;    // of `problem`
  std::size_t n_x, n_z;   // states, entries of a point
  std::size_t intervals, stride, points;        // stride: points from node to node
  std::size_t first_used, used;                 // points at which the stage is evaluated, one after another
  std::vector<double> t;                        // (points) s of `problem`
  std::vector<std::size_t> instants = {};       // the points at which those of `stage` stand
  std::size_t variable = 0, row = 0, cost = 0;  // its first ones
  std::size_t evaluator = 0;                    // of the node; those of the instants follow
  std::size_t squares = 0;                      // likewise of Gauss-Newton's residuals

  const Scheme& scheme() const { return mesh.scheme; }
  std::size_t variables() const { return points * n_z; }
  std::size_t variable_of(std::size_t point) const { return variable + point * n_z; }
  double step(std::size_t interval) const { return t[(interval + 1) * stride] - t[interval * stride]; }
  EvaluatorRange evaluators() const { return {evaluator, evaluator + 1 + instants.size()}; }
};

struct StagedLink {
  std::size_t from, to;           // phases
  std::string name;               // ""push-off" to "flight""
  StageFunction change;           // empty: none
  double time;                    // s of the phase before, at which it is asked
  std::ptrdiff_t evaluator = -1;  // none
};

// Rows [row, row + size) of the program: row + i is the sum over the terms of  factor * (entry first + i of variables or of y).
struct LinearTerm {
  static constexpr std::size_t kVariables = SIZE_MAX;
  double factor;
  std::size_t evaluator;  // whose results are meant, or kVariables
  std::size_t first;
};

struct RowBlock {
  enum class Kind { kDefect, kControl, kPath, kInstant, kLink };
  Kind kind;
  std::size_t phase, place;  // of a link the phase before it; which interval, point, instant or link
  std::size_t part;          // of the rows of an interval
  std::size_t row = 0, size = 0;
  std::size_t first_term = 0, last_term = 0;
};

struct CostTerm {
  double factor;
  std::size_t evaluator, output;  // entry of y
};

struct StagedProgram {
  std::string name;
  std::vector<std::string> controls;  // of the whole motion, in their order; empty: as they appear in phases
  std::vector<StagedPhase> phases;
  std::vector<StagedLink> links;
  std::vector<Evaluator> evaluators, squares;  // squares: residuals of Gauss-Newton
  std::vector<RowBlock> rows;                  // in the order of rows
  std::vector<LinearTerm> terms;               // of the rows
  std::vector<CostTerm> costs;                 // phase by phase
  NlpShape shape;                              // its patterns are empty: StagedNlp lays them out
  double record_seconds = 0;

  // The costs of a phase: costs[begin], ..., costs[end - 1].
  std::size_t end_of_costs(std::size_t phase) const {
    return phase + 1 < phases.size() ? phases[phase + 1].cost : costs.size();
  }
};

StagedProgram discretize(const Problem& problem, const MeshOptions& mesh = {});
// One mesh a phase, or one for all.
StagedProgram discretize(const Phases& phases, const std::vector<MeshOptions>& meshes);
// The same on other nodes, one list a phase; what is recorded and compiled is taken over.  A free duration is guessed anew: that
// of the nodes.
StagedProgram discretize(const StagedProgram& ready, const std::vector<std::vector<double>>& nodes);

// What changes with the values of problems alone: bounds of variables, and parameters of the functions.
void place_values(StagedProgram& program, std::size_t phase);

// Names of a variable and of a row, and of a point: "point 3 (t = 0.5 s)".
std::string variable_name(const StagedProgram& program, std::size_t i);
std::string row_name(const StagedProgram& program, std::size_t j);
std::string point_name(const StagedPhase& phase, std::size_t point);

}  // namespace dyntape
