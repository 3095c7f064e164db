// SPDX-License-Identifier: BSD-3-Clause
//
// The nonlinear program of a problem, or of phases, on meshes: variables by stage, rows in blocks, and costs.
//
//   StagedProgram program = discretize(problem, {.scheme = hermite_simpson(), .intervals = 40});
//   StagedNlp nlp(std::move(program));                                    // staged_nlp.h: the interface for solvers
//
// Variables: z = (x, a, u) of every point, in order of time, phase by phase.  A stage is a node and the points
// before it in its interval.  Boundary values are variables with equal bounds.  Bounds hold at every point,
// including midpoints.
//
// Functions of a point (record_stage.h) are recorded and differentiated once and evaluated at all points: y(x).
// Rows and costs are linear in variables and in y,
//   rows    g = A x + B y(x)            costs    f = b . y(x)
// so the Jacobian is A + B dy/dx.  The Hessian of sigma f + lambda . g is that of w . y with w = B^T lambda + sigma
// b: one block per point.  A row block is a group of consecutive rows of A and B of one kind:
//
//   defect    alpha x_j + h beta f_j, summed over the points j of an interval         (scheme.h)
//   control   the scheme's conditions on the controls of an interval
//   path      rows of terms at a point;  instant: rows of terms at an instant (at_fraction() in problem.h)
//   link      x(0) of a phase minus the link's function of x(T) of the previous phase (of the last one for periodic
//             motions)
//
// Order in a phase: the defects of all intervals, then controls, paths, instants (the end last), then the link.  To
// add a kind of row, write a function in discretize.cpp that appends its blocks, and its name in staged_names.cpp.
//
// If a scheme does not use the last point (Euler) or the first (Radau), its controls and accelerations stay at the
// guess and its path rows are omitted.  In a trajectory they are values of the scheme's polynomial.
//
// Free duration (problem.h): the phase is scaled_time(problem), with one more state in z; times of points are
// fractions until a trajectory is made.  Multiple shooting (multiple_shooting.h): the rate is an integration step,
// with additional parameters.
//
// The Gauss-Newton Hessian is 2 r'^T r' of the residuals r of squared costs, without the curvature of rows.
//
// Errors.  ArgumentError for:
//
// - a problem or phases that are inconsistent (check())
// - meshes that are neither one for all nor one per phase; different kinds of Hessian
// - Gauss-Newton with a cost that is not a sum of squares
// - a program too large for memory or for a solver's integers (mesh_size.h)
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
  // (intervals + 1) node times from 0 to the duration (the last to rounding); empty: evenly spaced.  For a free
  // duration only the fractions matter.
  std::vector<double> nodes = {};
  HessianKind hessian = HessianKind::kExact;
  CodegenOptions evaluation = {};  // how functions are compiled; `order` is set by the program
  // Threads that share the points; 0: all.  For a seven-joint arm two threads are slower than one on 40 intervals,
  // and a tenth faster on 4000.
  unsigned threads = 1;
};

// Node times of a mesh; the last equals the duration exactly.  If an even mesh has no node at an instant with terms,
// the nearest node moves there and the nodes between are spread evenly.  ArgumentError for an invalid mesh, given
// times without a node at an instant, or fewer intervals than between instants.
std::vector<double> node_times(const Problem& problem, const MeshOptions& options);
// Index of the node at a fraction of the duration; ArgumentError, naming the problem's terms, if there is none.
std::size_t node_at_share(const Problem& problem, double share, const std::vector<double>& nodes);

// A phase on its mesh; a problem without phases is one.
struct StagedPhase {
  std::string name;
  Problem asked;          // as given
  IntervalLength length;  // of `problem`
  Problem problem;        // over a fixed time (scaled_time.h), with the scheme's rate (Scheme::taken_by)
  MeshOptions mesh;       // evaluation.order is set
  RecordedStage stage;    // of `problem`
  std::size_t n_x, n_z;   // states, entries of a point
  std::size_t intervals, stride, points;        // stride: points from node to node
  std::size_t first_used, used;                 // points at which the stage is evaluated, contiguous
  std::vector<double> t;                        // (points) s of `problem`
  std::vector<std::size_t> instants = {};       // indices of the points of the instants of `stage`
  std::size_t variable = 0, row = 0, cost = 0;  // index of the first of each
  std::size_t evaluator = 0;                    // of the node; those of the instants follow
  std::size_t squares = 0;                      // likewise for Gauss-Newton's residuals

  const Scheme& scheme() const { return mesh.scheme; }
  std::size_t variables() const { return points * n_z; }
  std::size_t variable_of(std::size_t point) const { return variable + point * n_z; }
  double step(std::size_t interval) const { return t[(interval + 1) * stride] - t[interval * stride]; }
  EvaluatorRange evaluators() const { return {evaluator, evaluator + 1 + instants.size()}; }
};

struct StagedLink {
  std::size_t from, to;           // phases
  std::string name;               // ""push-off" to "flight""
  StageFunction change;           // empty: equal states
  double time;                    // s, final time of the previous phase
  std::ptrdiff_t evaluator = -1;  // -1: none
};

// Rows [row, row + size) of the program: row + i sums factor * (entry first + i of variables or of y) over the
// terms.
struct LinearTerm {
  static constexpr std::size_t kVariables = SIZE_MAX;
  double factor;
  std::size_t evaluator;  // whose results are used, or kVariables
  std::size_t first;
};

struct RowBlock {
  enum class Kind { kDefect, kControl, kPath, kInstant, kLink };
  Kind kind;
  std::size_t phase, place;  // for a link the previous phase; index of the interval, point, instant or link
  std::size_t part;          // index among the rows of an interval
  std::size_t row = 0, size = 0;
  std::size_t first_term = 0, last_term = 0;
};

struct CostTerm {
  double factor;
  std::size_t evaluator, output;  // entry of y
};

struct StagedProgram {
  std::string name;
  std::vector<std::string> controls;  // all controls in their order; empty: in order of appearance in phases
  std::vector<StagedPhase> phases;
  std::vector<StagedLink> links;
  std::vector<Evaluator> evaluators, squares;  // squares: residuals of Gauss-Newton
  std::vector<RowBlock> rows;                  // in the order of rows
  std::vector<LinearTerm> terms;               // of the rows
  std::vector<CostTerm> costs;                 // phase by phase
  NlpShape shape;                              // without patterns, which StagedNlp fills in
  double record_seconds = 0;

  // The costs of a phase: costs[begin], ..., costs[end - 1].
  std::size_t end_of_costs(std::size_t phase) const {
    return phase + 1 < phases.size() ? phases[phase + 1].cost : costs.size();
  }
};

StagedProgram discretize(const Problem& problem, const MeshOptions& mesh = {});
// One mesh per phase, or one for all.
StagedProgram discretize(const Phases& phases, const std::vector<MeshOptions>& meshes);
// The same program on other nodes, one list per phase; keeps recorded and compiled functions.  The initial value of
// a free duration is that of the nodes.
StagedProgram discretize(const StagedProgram& ready, const std::vector<std::vector<double>>& nodes);

// Sets values of the problems: bounds of variables, and parameters of the functions.
void place_values(StagedProgram& program, std::size_t phase);

// Names of a variable and of a row, and of a point: "point 3 (t = 0.5 s)".
std::string variable_name(const StagedProgram& program, std::size_t i);
std::string row_name(const StagedProgram& program, std::size_t j);
std::string point_name(const StagedPhase& phase, std::size_t point);

}  // namespace dyntape
