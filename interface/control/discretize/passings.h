// SPDX-License-Identifier: BSD-3-Clause
//
// Finds inequalities and bounds that hold at the points of a mesh, but not between them.
//
//   for (const Passing& p : find_passings(problem, motion, extents).rows)   // extents: extents_of() in verify.h
//     if (p.excess > 1e-3) std::cerr << p.text() << "\n";            // "keep out is 0.0002 at 0.47 s, bounded by 0.04"
//
// Method.  States are evaluated along cubics between points (resampled.h), controls and accelerations along the
// scheme's polynomials: at eight times between neighbouring points, then at the extremum near the worst of these.
//
// The excess of an inequality row g is a length: |g - limit| / |g'|, with each variable in units of its movement in
// that interval, at least half of its movement in the whole motion.  So an excess of 1e-3 means the same for a
// distance, its square and its inverse: the motion must move aside by 1e-3 of its way through the interval.
//
// - If a term has a length of its own (Term::length), the excess is relative to that.
// - Controls and accelerations count with five times their whole movement, since polynomials overshoot at jumps on
// every mesh.
// - The excess of a bound on a state or an acceleration is relative to its whole movement.
// - Controls are not searched if polynomials are clamped at their limits (Trajectory::limit_controls).  Otherwise
// their excess is relative to their range or their whole movement, whichever is larger.
// - Excesses that the solver's widening of bounds explains are not reported.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/control/discretize/trajectory.h>
#include <dyntape/interface/control/problem/problem.h>

namespace dyntape {

struct Passing {
  std::string name;     // of the row or variable: "keep out", "cone[1]", "v.elbow"
  double value, limit;  // the extreme value, and the bound that it exceeds
  double time;          // s
  int interval;         // of the mesh
  double excess;        // relative, see above
  std::string text() const;
};

struct Passings {
  std::vector<Passing> rows = {};     // the worst time of each row and variable, largest excess first
  Eigen::VectorXd of_intervals = {};  // (intervals) the largest excess in each
  double worst() const { return rows.empty() ? 0 : rows.front().excess; }
};

// `extents` (n_x): the movement of each state.
Passings find_passings(const Problem& problem, const Trajectory& motion, const Eigen::VectorXd& extents);

}  // namespace dyntape
