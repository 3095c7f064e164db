// SPDX-License-Identifier: BSD-3-Clause
//
// Motions that tell most about the base parameters, within the limits of the robot.
//
//   Excitation e = optimal_excitation(arm, base_parameters(arm), {.period = 10});
//   e.series.positions(times);                 // what to drive
//   e.condition, e.random_condition            // of the stacked base regressor, and what chance would give
//
// minimise   -1/r log det F   or   log cond(Y_b)      F = sum_t Y_b^T Y_b, columns in units of base.scale
// over       the coefficients of a Fourier series of each joint
// subject to position, velocity and acceleration limits at the sample times, and rest at t = 0
//
// log det F is the volume of the confidence ellipsoid: the errors on average, and no choice of units moves the
// optimum.  The condition number makes the errors alike instead (UR5, default units: log det halves the mean
// error of random series and leaves the condition as it is; the condition goes from 10 to 4 and the mean error
// stays).  The limits are linear in the coefficients.  Gradients are exact: d(-log det F) = -2 <Y_b F^-1, d Y_b>, the inner product by one
// reverse sweep of the recorded base regressor a sample (docs/math.md, I.13 to I.15).  Solved by Ipopt.
//
// Errors.  ArgumentError: a joint that is not of one degree of freedom, limits that leave no room, options out
// of range; what Ipopt says is in `status`.
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
  int samples = 60;      // at which information is gathered and limits are held
  double margin = 0.95;  // share of every limit that is used; what is between samples needs the rest
  double position = 3.141592653589793;  // limits where the robot's file has none: rad or m
  double velocity = 2;                  // rad/s or m/s
  double acceleration = 10;             // rad/s^2 or m/s^2; files have none
  int starts = 20;                      // random series, the best of which is the start
  unsigned long seed = 1;
  int max_iterations = 100;
};

struct Excitation {
  FourierSeries series;
  Samples samples;                         // at the sample times, torques empty
  double condition = 0;                    // of Y_b in units of base.scale
  double random_condition = 0;             // median over the random series
  double log_det = 0, random_log_det = 0;  // of F; of the best random series
  // At the gradients that were asked for: condition, and mean semi-axis of the confidence ellipsoid,
  // exp(-log det F / 2 r).
  std::vector<double> conditions, errors;
  SolveStatus status = SolveStatus::kSolverError;
  int iterations = 0;
  double seconds = 0;
};

Excitation optimal_excitation(const dynamics::Model<double>& model, const BaseParameters& base,
                              const ExcitationOptions& options = {});

// A random series that rests at t = 0 and touches the limits, in each joint the first it meets.
FourierSeries random_series(const dynamics::Model<double>& model, const ExcitationOptions& options,
                            unsigned long seed);

// States of the series at these times.
Samples sample(const dynamics::Model<double>& model, const FourierSeries& series,
               const Eigen::VectorXd& times);

// cond(Y_b) over samples, columns in units of base.scale.
double condition(const dynamics::Model<double>& model, const BaseParameters& base, const Samples& samples);

}  // namespace dyntape
