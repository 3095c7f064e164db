// SPDX-License-Identifier: BSD-3-Clause
//
// Optimises a motion for the identification of base parameters, within the limits of the robot.
//
//   Excitation e = optimal_excitation(arm, base_parameters(arm), {.period = 10});
//   e.series.positions(times);                 // the motion to drive
//   e.condition, e.random_condition            // of the stacked base regressor; median of random motions
//
// minimise   -1/r log det F   or   log cond(Y_b)      F = sum_t Y_b^T Y_b, columns in units of base.scale
// over       the coefficients of a Fourier series of each joint
// subject to position, velocity and acceleration limits at the sample times, and rest at t = 0
//
// kLogDet minimises the volume of the confidence ellipsoid, i.e. the mean error; the optimum does not depend on
// units.  kCondition makes the errors equal.  For the UR5 with default units, relative to random series:
//
// - log det halves the mean error and leaves the condition unchanged
// - the condition number falls from 10 to 4 and the mean error stays
//
// The limits are linear in the coefficients.  Gradients are exact: d(-log det F) = -2 <Y_b F^-1, d Y_b>, with one
// reverse sweep of the recorded base regressor per sample (docs/math.md, I.13 to I.15).  Ipopt solves the program.
//
// Errors.  ArgumentError: a joint of several degrees of freedom, limits without interior, options out of range.  The
// result of Ipopt is in `status`.
#pragma once

#include <vector>

#include <dyntape/interface/control/nlp/status.h>
#include <dyntape/interface/identification/base_parameters.h>
#include <dyntape/interface/identification/fourier_series.h>

namespace dyntape {

enum class ExcitationCriterion { kLogDet, kCondition };

struct ExcitationOptions {
  ExcitationCriterion criterion = ExcitationCriterion::kLogDet;
  int harmonics = 5;
  double period = 10;    // s
  int samples = 60;      // times at which F is summed and limits hold
  double margin = 0.95;  // fraction of each limit in use; the rest is reserve for times between samples
  double position = 3.141592653589793;  // limits if the robot's file has none: rad or m
  double velocity = 2;                  // rad/s or m/s
  double acceleration = 10;             // rad/s^2 or m/s^2; robot files have no such limit
  int starts = 20;                      // random series; the best is the initial guess
  unsigned long seed = 1;
  int max_iterations = 100;
};

struct Excitation {
  FourierSeries series;
  Samples samples;                         // at the sample times, torques empty
  double condition = 0;                    // of Y_b in units of base.scale
  double random_condition = 0;             // median of the random series
  double log_det = 0, random_log_det = 0;  // of F; of the best random series
  // One entry per gradient evaluation: condition, and mean semi-axis of the confidence ellipsoid, exp(-log det F / 2
  // r).
  std::vector<double> conditions, errors;
  SolveStatus status = SolveStatus::kSolverError;
  int iterations = 0;
  double seconds = 0;
};

Excitation optimal_excitation(const dynamics::Model<double>& model, const BaseParameters& base,
                              const ExcitationOptions& options = {});

// A random series that is at rest at t = 0; each joint is scaled until it touches its first limit.
FourierSeries random_series(const dynamics::Model<double>& model, const ExcitationOptions& options,
                            unsigned long seed);

// The states of the series at these times.
Samples sample(const dynamics::Model<double>& model, const FourierSeries& series,
               const Eigen::VectorXd& times);

// cond(Y_b) of the samples, columns in units of base.scale.
double condition(const dynamics::Model<double>& model, const BaseParameters& base, const Samples& samples);

}  // namespace dyntape
