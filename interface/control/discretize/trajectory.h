// SPDX-License-Identifier: BSD-3-Clause
//
// A trajectory at the points of a mesh, with the scheme's interpolation of the controls.
//
//   const Trajectory motion = collocation.trajectory(solution.x);
//   motion.x.col(k)        // state at time motion.t[k]
//   motion.node(i)         // index of the point at mesh node i
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include <dyntape/interface/control/discretize/scheme.h>

namespace dyntape {

struct Trajectory {
  Eigen::VectorXd t;  // (points) s, increasing
  Eigen::MatrixXd x;  // (n_x x points)
  Eigen::MatrixXd a;  // (n_a x points)
  Eigen::MatrixXd u;  // (n_u x points)
  Scheme scheme;
  // Limits of the controls between points, (n_u) or empty.  Values between points are clamped to them: a polynomial
  // through points at a limit would exceed the limit, e.g. where a control switches from one limit to the other.
  Eigen::VectorXd u_lower = {}, u_upper = {};

  // Sets these limits, widened by the fraction kSlack of a control's range or movement.  A control that reaches a
  // limit smoothly exceeds the limit by less; clamping such a control would lose more accuracy than it gains.
  void limit_controls(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
    constexpr double kSlack = 9e-4;
    u_lower = lower, u_upper = upper;
    for (Eigen::Index i = 0; i < u.rows(); ++i) {
      const double range = upper[i] - lower[i], moved = u.row(i).maxCoeff() - u.row(i).minCoeff();
      const double slack = kSlack * (std::isfinite(range) ? std::max(range, moved) : moved);
      if (std::isfinite(slack)) u_lower[i] -= slack, u_upper[i] += slack;
    }
  }

  int points() const { return static_cast<int>(t.size()); }
  int intervals() const { return (points() - 1) / (scheme.points() - 1); }
  int node(int interval) const { return interval * (scheme.points() - 1); }
  std::vector<double> nodes() const {  // times of the nodes, s
    std::vector<double> times;
    for (int k = 0; k <= intervals(); ++k) times.push_back(t[node(k)]);
    return times;
  }

  // The control at a fraction (0..1) of an interval: the scheme's interpolation, clamped to the limits.
  Eigen::VectorXd control(int interval, double fraction) const {
    Eigen::VectorXd value = u.middleCols(node(interval), scheme.points()) * scheme.control_weights(fraction);
    if (u_lower.size() > 0) value = value.cwiseMax(u_lower).cwiseMin(u_upper);
    return value;
  }
  Eigen::VectorXd acceleration(int interval, double fraction) const {
    return a.middleCols(node(interval), scheme.points()) * scheme.control_weights(fraction);
  }

  // Sets controls and accelerations of the first and the last point from the motion, if the scheme does not use
  // these points.
  void extend_to_unused() {
    const auto give = [&](int point, int interval, double fraction) {
      u.col(point) = control(interval, fraction).eval(),
      a.col(point) = acceleration(interval, fraction).eval();
    };
    if (!scheme.uses_first_point()) give(0, 0, 0);
    if (!scheme.uses_last_point()) give(points() - 1, intervals() - 1, 1);
  }
};

}  // namespace dyntape
