// SPDX-License-Identifier: BSD-3-Clause
//
// Estimates base parameters from measured motions and torques, with the Cramer-Rao bound of the errors.
//
//   BaseEstimator estimator(arm, base, samples, sigma);       // sigma (nv): standard deviation of the torques
//   VectorXd beta = estimator.estimate(samples.tau);
//   VectorXd error = estimator.standard_deviation();          // Cramer-Rao bound, one per parameter
//
// tau_t = Y_b(t) beta + noise of covariance diag(sigma^2), independent from sample to sample:
//   Fisher information  F = sum_t Y_b^T diag(sigma^-2) Y_b
//   Cramer-Rao bound    cov(beta) >= F^-1 for every unbiased estimate; weighted least squares reaches it
// The full theta has a singular F for every motion (docs/math.md, I.12), so the bound is for beta.
//
// Complexity.  The constructor factorises the whitened regressor, scaled to unit columns, once (QR).  An estimate is
// a matrix-vector product and a triangular solve.
//
// Errors.  ArgumentError: wrong sizes, a sigma that is not positive, fewer rows than parameters.  NumericalError:
// the motion does not excite all base parameters.
#pragma once

#include <Eigen/QR>

#include <dyntape/interface/identification/base_parameters.h>

namespace dyntape {

class BaseEstimator {
 public:
  BaseEstimator(const dynamics::Model<double>& model, const BaseParameters& base, const Samples& samples,
                const Eigen::VectorXd& sigma);

  Eigen::VectorXd estimate(const Eigen::MatrixXd& tau) const;  // tau (nv x N) -> beta (rank)
  Eigen::MatrixXd residuals(const Eigen::VectorXd& beta, const Eigen::MatrixXd& tau) const;  // tau - Y_b beta

  Eigen::MatrixXd covariance() const;          // (rank x rank) inverse of F, both triangles
  Eigen::VectorXd standard_deviation() const;  // (rank) root of the diagonal of the covariance
  // Condition number of Y_b with columns of unit length; independent of units.
  double condition() const { return condition_; }

 private:
  Eigen::VectorXd whitened(const Eigen::MatrixXd& tau) const;

  Eigen::MatrixXd W_;                         // whitened regressor (N nv x rank)
  Eigen::VectorXd sigma_, length_;            // (nv); (rank) of the columns of W_
  Eigen::HouseholderQR<Eigen::MatrixXd> qr_;  // of W_ with columns of unit length
  double condition_ = 0;
};

// Estimates beta with unknown noise.  An unweighted fit gives the standard deviation of each joint's torque; a
// second fit weights the residuals with it.
struct Identification {
  Eigen::VectorXd beta, standard_deviation;  // (rank)
  Eigen::VectorXd sigma;                     // (nv) of the torques
  double condition = 0;
};
Identification identify(const dynamics::Model<double>& model, const BaseParameters& base,
                        const Samples& samples);

}  // namespace dyntape
