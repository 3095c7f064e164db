// SPDX-License-Identifier: BSD-3-Clause
//
// The base parameters of a robot: the combinations of inertial parameters that joint torques determine.  Use them
// before an identification, since the single parameters cannot be identified.
//
//   BaseParameters base = base_parameters(arm);           // UR5: 36 of 60
//   VectorXd beta = base.regrouping * inertial_parameters(arm);
//   Y(all, base.independent) * beta == Y * theta          // Y of dynamics/algorithms/regressor.h, at every state
//   base.names[3]                                         // "mcy2 + 0.425 m3 + ..."
//
// Torques are tau = Y theta.  The columns of Y are linearly dependent at every state, so no motion determines theta.
// The combinations beta = theta_1 + K theta_2 are determined, where Y_2 = Y_1 K for the independent columns Y_1.
// The columns are found from stacked regressors at random states.  Bodies near the base keep their parameters, and
// absorb parameters of the bodies further out.
//
// Sources: M. Gautier, Numerical calculation of the base inertial parameters of robots, J. Robotic Systems 8(4),
// 1991; docs/math.md (I.9 to I.11).
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include <dyntape/dynamics/algorithms/regressor.h>
#include <dyntape/dynamics/model/mimic_rules.h>

namespace dyntape {

// States and, if known, driving torques; one sample per column.
struct Samples {
  Eigen::MatrixXd q, v, a;  // (nq x N), (nv x N), (nv x N), without mimic joints
  Eigen::MatrixXd tau;      // (nv x N), or empty
  Eigen::VectorXd time;     // (N) s, or empty

  Eigen::Index count() const { return q.cols(); }
};

struct BaseOptions {
  dynamics::JointColumns columns;  // adds armature and friction to the parameters
  unsigned long seed = 1;          // of the random states
  double tolerance = 1e-9;         // relative norm below which a column is dependent (rank_revealing_qr.h)
  // Mimic joints (dynamics/algorithms/mimic.h); samples have the other joints only.
  std::vector<dynamics::MimicRule> mimics = {};
};

struct BaseParameters {
  dynamics::JointColumns columns;
  std::vector<dynamics::MimicRule> mimics;
  std::vector<int> independent;     // (rank) columns of Y that remain
  std::vector<int> unidentifiable;  // columns of Y that are zero at every state
  Eigen::MatrixXd regrouping;       // (rank x columns of Y): beta = regrouping theta
  std::vector<std::string> names;   // (rank)
  Eigen::VectorXd scale;            // (rank) root mean square of the columns at the random states
  double least_kept, most_dropped;  // the gap of the QR diagonal that decides the rank

  int rank() const { return static_cast<int>(independent.size()); }
  // Number of torques in a sample.
  int nv(const dynamics::Model<double>& model) const { return model.nv - static_cast<int>(mimics.size()); }
};

BaseParameters base_parameters(const dynamics::Model<double>& model, const BaseOptions& options = {});

// The base regressors of all samples, stacked: (N nv x rank).
Eigen::MatrixXd stacked_base_regressor(const dynamics::Model<double>& model, const BaseParameters& base,
                                       const Samples& samples);

// Names of the columns of Y: "m1" ... "Izz7", then "armature1", "viscous1", "coulomb1", ...; the number is the
// joint's.
std::vector<std::string> parameter_names(const dynamics::Model<double>& model,
                                         const dynamics::JointColumns& columns);

// The model's values for the columns of Y: inertial parameters, armature, damping, friction.
Eigen::VectorXd parameter_values(const dynamics::Model<double>& model, const dynamics::JointColumns& columns);

// Random states within the position limits, |v| <= 2, |a| <= 5 (rad or m, s).
Samples random_samples(const dynamics::Model<double>& model, int count, unsigned long seed,
                       const std::vector<dynamics::MimicRule>& mimics = {});

}  // namespace dyntape
