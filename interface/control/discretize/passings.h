// SPDX-License-Identifier: BSD-3-Clause
//
// Finds inequalities and bounds that hold at the points of a mesh, but not between them.
//
//   for (const Passing& p : find_passings(problem, motion, extents).rows)   // extents: extents_of() in verify.h
//     if (p.excess > 1e-3) std::cerr << p.text() << "\n";                  // "keep out is 0.0002 at 0.47 s, bounded by 0.04"
//
// Looks at states along the cubics between points (resampled.h), at controls and accelerations along the scheme's polynomials:
// at eight places from one point to the next, and then at the extremum beside the worst of these.
//
// The excess of an inequality row g is a length: |g - limit| / |g'|, with each variable in units of its movement in that
// interval, at least half of its movement in the whole motion.  So an excess of 1e-3 of a distance, of its square and of its
// inverse all mean the same: the motion has to move aside by 1e-3 of its way through the interval.  Controls and accelerations
// count by five times their whole movement, because polynomials overshoot where these jump, on every mesh.  The excess of a bound
// of a state or an acceleration is measured by its whole movement.  Controls are not searched where
// polynomials are cut at their limits (Trajectory::limit_controls), else by their range or their whole movement, whichever is
// larger.  Excesses that the solver's widening of bounds explains are left out.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/control/discretize/trajectory.h>
#include <dyntape/interface/control/problem/problem.h>

namespace dyntape {

struct Passing {
  std::string name;     // of the row or variable: "keep out", "cone[1]", "v.elbow"
  double value, limit;  // the extreme value, and the bound that it passes
  double time;          // s
  int interval;         // of the mesh
  double excess;        // relative, see above
  std::string text() const;
};

struct Passings {
  std::vector<Passing> rows = {};     // of each row and variable the worst place, the largest excess first
  Eigen::VectorXd of_intervals = {};  // (intervals) the largest excess of each
  double worst() const { return rows.empty() ? 0 : rows.front().excess; }
};

// `extents` (n_x): how far the motion moves each state.
Passings find_passings(const Problem& problem, const Trajectory& motion, const Eigen::VectorXd& extents);

}  // namespace dyntape
