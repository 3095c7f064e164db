// SPDX-License-Identifier: BSD-3-Clause
//
// Interpolates a motion between the points of its mesh and multipliers from one mesh to another; makes controls that are angles fit for it.
//
//   const MotionBetween between(problem, motion);
//   const Stage<double> s = between.at(3, 0.25);             // a quarter of the way from point 3 to point 4
//   const Trajectory fine = resampled(problem, motion, times);
//   x = without_turns(nlp, x, scaling);                      // 0.8, 7.0, 13.3 rad become 0.8, 0.72, 0.73
//   NlpSolution warm = with_multipliers_of(coarse, solution, fine, x);   // a start for the solve on another mesh
#pragma once

#include <dyntape/interface/control/discretize/staged_nlp.h>

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

// Returns the point x of the program `to`, with multipliers of a solution on another mesh of the same problem, for a warm start
// (SolverOptions::warm).  The multiplier of a bound or of a row at a point, divided by the weight of the point in the quadrature, is
// a function of time, which is interpolated linearly.  Rows at instants and of links keep their multipliers.  Multipliers of
// defects and of the scheme's conditions on controls are NaN: the solver estimates them.
NlpSolution with_multipliers_of(const StagedNlp& from, const NlpSolution& solution, const StagedNlp& to,
                                std::vector<double> x);

// Removes whole turns between consecutive points of controls that are angles.  If a control enters a problem only by its sine and
// cosine, a solver may add whole turns to it at single points.  The points are right, but the control that is interpolated between
// them spins.  Returns x with the nearest turns for each control whose values differ by more than half a turn, if objective and
// constraints are the same with them to 1e-9 of their nominal values.  Controls with a bound stay.
std::vector<double> without_turns(StagedNlp& nlp, std::vector<double> x, const NlpScaling& scaling = {});

}  // namespace dyntape
