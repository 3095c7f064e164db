// SPDX-License-Identifier: BSD-3-Clause
//
// Base parameters from measured motions and torques, and how well any unbiased method could know them.
//
//   BaseEstimator estimator(arm, base, samples, sigma);       // sigma (nv): standard deviation of the torques
//   VectorXd beta = estimator.estimate(samples.tau);
//   VectorXd error = estimator.standard_deviation();          // Cramer-Rao bound, one a parameter
//
// tau_t = Y_b(t) beta + noise of covariance diag(sigma^2), independent from sample to sample:
//   Fisher information  F = sum_t Y_b^T diag(sigma^-2) Y_b
//   Cramer-Rao bound    cov(beta) >= F^-1 for every unbiased estimate; weighted least squares reaches it
// For the full theta F is singular whatever the motion (docs/math.md, I.12): the bound is one on beta.
// Everything comes from the QR factorisation of the whitened regressor, scaled to unit columns, once; an
// estimate is then a product and a triangular solve.
//
// Errors.  ArgumentError: sizes that do not fit, a sigma that is not positive, fewer rows than parameters;
// NumericalError: the motion does not excite all base parameters.
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

  Eigen::MatrixXd covariance() const;          // (rank x rank) inverse of the information, both triangles
  Eigen::VectorXd standard_deviation() const;  // (rank) root of the diagonal of the bound
  // Condition number of Y_b with columns of unit length, which units do not change.
  double condition() const { return condition_; }

 private:
  Eigen::VectorXd whitened(const Eigen::MatrixXd& tau) const;

  Eigen::MatrixXd W_;                         // whitened regressor (N nv x rank)
  Eigen::VectorXd sigma_, length_;            // (nv); (rank) of the columns of W_
  Eigen::HouseholderQR<Eigen::MatrixXd> qr_;  // of W_ with columns of unit length
  double condition_ = 0;
};

// Estimate with noise that is not known: weighted least squares in which the residuals of an unweighted pass
// give the standard deviation of each joint's torque.
struct Identification {
  Eigen::VectorXd beta, standard_deviation;  // (rank)
  Eigen::VectorXd sigma;                     // (nv) of the torques
  double condition = 0;
};
Identification identify(const dynamics::Model<double>& model, const BaseParameters& base,
                        const Samples& samples);

}  // namespace dyntape
