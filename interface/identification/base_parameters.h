// SPDX-License-Identifier: BSD-3-Clause
//
// What a robot's torques can tell about its masses: the base parameters.
//
//   BaseParameters base = base_parameters(arm);           // UR5: 36 of 60
//   VectorXd beta = base.regrouping * inertial_parameters(arm);
//   Y(all, base.independent) * beta == Y * theta          // Y of dynamics/algorithms/regressor.h, at every state
//   base.names[3]                                         // "mcy2 + 0.425 m3 + ..."
//
// Torques are tau = Y theta, and the columns of Y depend on each other at every state: theta is never
// determined, whatever the motion, but the combinations beta = theta_1 + K theta_2 are, where
// Y_2 = Y_1 K for the independent columns Y_1 (M. Gautier, Numerical calculation of the base inertial
// parameters of robots, J. Robotic Systems 8(4), 1991).  The columns are found on regressors at random
// states, stacked; bodies near the base keep their parameters and take on those of the bodies behind them.
// docs/math.md (I.9 to I.11).
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include <dyntape/dynamics/algorithms/regressor.h>
#include <dyntape/dynamics/model/mimic_rules.h>

namespace dyntape {

// States and, where they are known, driving torques; one a column.
struct Samples {
  Eigen::MatrixXd q, v, a;  // (nq x N), (nv x N), (nv x N), without joints that follow others
  Eigen::MatrixXd tau;      // (nv x N), or empty
  Eigen::VectorXd time;     // (N), or empty; s

  Eigen::Index count() const { return q.cols(); }
};

struct BaseOptions {
  dynamics::JointColumns columns;  // armature and friction among the parameters
  unsigned long seed = 1;          // of the random states
  double tolerance = 1e-9;         // below it a column counts as dependent (rank_revealing_qr.h)
  // Joints that follow others (dynamics/algorithms/mimic.h): samples are then those of the others.
  std::vector<dynamics::MimicRule> mimics = {};
};

struct BaseParameters {
  dynamics::JointColumns columns;
  std::vector<dynamics::MimicRule> mimics;
  std::vector<int> independent;     // (rank) columns of Y that stay
  std::vector<int> unidentifiable;  // columns of Y that are zero at every state
  Eigen::MatrixXd regrouping;       // (rank x columns of Y): beta = regrouping theta
  std::vector<std::string> names;   // (rank)
  Eigen::VectorXd scale;            // (rank) root mean square of the columns at the random states
  double least_kept, most_dropped;  // the gap at which the rank is read off

  int rank() const { return static_cast<int>(independent.size()); }
  // Torques of a sample.
  int nv(const dynamics::Model<double>& model) const { return model.nv - static_cast<int>(mimics.size()); }
};

BaseParameters base_parameters(const dynamics::Model<double>& model, const BaseOptions& options = {});

// Base regressors of all samples, one below the other: (N nv x rank).
Eigen::MatrixXd stacked_base_regressor(const dynamics::Model<double>& model, const BaseParameters& base,
                                       const Samples& samples);

// Names of the columns of Y: "m1" ... "Izz7", then "armature1", "viscous1", "coulomb1", ..., numbers of joints.
std::vector<std::string> parameter_names(const dynamics::Model<double>& model,
                                         const dynamics::JointColumns& columns);

// Values of the columns of Y that the model holds: inertial parameters, armature, damping, friction.
Eigen::VectorXd parameter_values(const dynamics::Model<double>& model, const dynamics::JointColumns& columns);

// Random states: q within its limits, |v| <= 2, |a| <= 5 (rad or m, s).
Samples random_samples(const dynamics::Model<double>& model, int count, unsigned long seed,
                       const std::vector<dynamics::MimicRule>& mimics = {});

}  // namespace dyntape
