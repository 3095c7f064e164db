// SPDX-License-Identifier: BSD-3-Clause
//
// Interpolates a motion between the points of its mesh.
//
//   const MotionBetween between(problem, motion);
//   const Stage<double> s = between.at(3, 0.25);             // a quarter of the way from point 3 to point 4
//   const Trajectory fine = resampled(problem, motion, times);
#pragma once

#include <dyntape/interface/control/discretize/trajectory.h>
#include <dyntape/interface/control/problem/problem.h>

namespace dyntape {

// States are the cubics through the motion's states and rates at neighbouring points; accelerations and controls are
// the scheme's polynomials.  Stores references: problem and motion must outlive the object.
class MotionBetween {
 public:
  MotionBetween(const Problem& problem, const Trajectory& motion);

  // At a fraction (0..1) of the way from point p to point p + 1.
  Stage<double> at(int p, double fraction) const;

 private:
  const Problem& problem_;
  const Trajectory& motion_;
  Eigen::MatrixXd rates_;                 // (n_x x points)
  std::vector<Eigen::MatrixXd> at_ends_;  // of each interval (n_x x 2); empty if the scheme uses both ends
};

// The node times, and the middle of every interval.
std::vector<double> halved(const Trajectory& motion);

// The motion at other times within its own.
Trajectory resampled(const Problem& problem, const Trajectory& motion, const std::vector<double>& times);

// x' (n_x x points) at every point of a motion.
Eigen::MatrixXd rates_of(const Problem& problem, Trajectory motion);

// The value at a fraction of length h of the cubic with these values and derivatives at both ends.
Eigen::VectorXd cubic(const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                      const Eigen::VectorXd& slope_from, const Eigen::VectorXd& slope_to, double h,
                      double fraction);

}  // namespace dyntape
