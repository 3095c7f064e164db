// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/identification/estimator.h>

#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/factorisations.h>

namespace dyntape {
namespace {

using dynamics::Model;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double condition_of(const MatrixXd& A) {
  const VectorXd s = singular_values(A).values;
  const double least = s[s.size() - 1];
  return least > 0 ? s[0] / least : HUGE_VAL;
}

void check_torques(const MatrixXd& tau, Eigen::Index nv, Eigen::Index count) {
  if (tau.rows() == nv && tau.cols() == count) {
    if (tau.allFinite()) return;
    throw ArgumentError("estimate: tau has an entry that is not finite, expected numbers");
  }
  throw ArgumentError("estimate: tau is " + std::to_string(tau.rows()) + " x " + std::to_string(tau.cols()) +
                      ", expected " + std::to_string(nv) + " x " + std::to_string(count));
}

}  // namespace

BaseEstimator::BaseEstimator(const Model<double>& model, const BaseParameters& base, const Samples& samples,
                             const VectorXd& sigma)
    : W_(stacked_base_regressor(model, base, samples)), sigma_(sigma) {
  if (sigma.size() != base.nv(model) || !(sigma.array() > 0).all() || !sigma.allFinite())
    throw ArgumentError("estimator: sigma needs " + std::to_string(base.nv(model)) +
                        " positive entries, one a torque of model \"" + model.name + "\"");
  if (!W_.allFinite())
    throw ArgumentError("estimator: the regressor of q, v and a is not finite, expected samples of numbers");
  if (W_.rows() < W_.cols())
    throw ArgumentError("estimator: " + std::to_string(samples.count()) + " samples give " +
                        std::to_string(W_.rows()) + " torques for " + std::to_string(W_.cols()) +
                        " base parameters");
  for (Eigen::Index t = 0; t < samples.count(); ++t) {
    W_.middleRows(t * base.nv(model), base.nv(model)).array().colwise() /= sigma.array();
  }
  length_ = W_.colwise().norm();
  for (double& x : length_) x = x > 0 ? x : 1;
  qr_.compute(W_ * length_.cwiseInverse().asDiagonal());
  const Eigen::Index n = W_.cols();
  condition_ = condition_of(qr_.matrixQR().topRows(n).triangularView<Eigen::Upper>());
  if (!(condition_ < 1e12))
    throw NumericalError(
        "estimator: the motion does not excite all base parameters, the condition number of "
        "the regressor is " +
        std::to_string(condition_));
}

VectorXd BaseEstimator::whitened(const MatrixXd& tau) const {
  check_torques(tau, sigma_.size(), W_.rows() / sigma_.size());
  const MatrixXd scaled = sigma_.cwiseInverse().asDiagonal() * tau;
  return scaled.reshaped();
}

VectorXd BaseEstimator::estimate(const MatrixXd& tau) const {
  const VectorXd beta = qr_.solve(whitened(tau));
  return beta.cwiseQuotient(length_);
}

MatrixXd BaseEstimator::residuals(const VectorXd& beta, const MatrixXd& tau) const {
  const VectorXd left = whitened(tau) - W_ * beta;
  return sigma_.asDiagonal() * left.reshaped(tau.rows(), tau.cols());
}

MatrixXd BaseEstimator::covariance() const {
  const Eigen::Index n = W_.cols();
  MatrixXd inverse = MatrixXd::Identity(n, n);
  qr_.matrixQR().topRows(n).triangularView<Eigen::Upper>().solveInPlace(inverse);
  inverse = length_.cwiseInverse().asDiagonal() * inverse;
  return inverse * inverse.transpose();
}

VectorXd BaseEstimator::standard_deviation() const { return covariance().diagonal().cwiseSqrt(); }

Identification identify(const Model<double>& model, const BaseParameters& base, const Samples& samples) {
  const BaseEstimator unweighted(model, base, samples, VectorXd::Ones(base.nv(model)));
  const MatrixXd left = unweighted.residuals(unweighted.estimate(samples.tau), samples.tau);
  const double freedom = static_cast<double>(left.size() - base.rank()) /
                         static_cast<double>(base.nv(model));  // of each joint, on average
  if (!(freedom > 0))
    throw ArgumentError("identify: " + std::to_string(samples.count()) +
                        " samples leave no residual from which the noise could be estimated");
  VectorXd sigma = (left.rowwise().squaredNorm() / freedom).cwiseSqrt();
  // Torques without noise: rounding is what is left, and no joint must weigh infinitely.
  const double least = 1e-12 * std::max(samples.tau.cwiseAbs().maxCoeff(), 1e-300);
  sigma = sigma.cwiseMax(least);
  const BaseEstimator weighted(model, base, samples, sigma);
  return {weighted.estimate(samples.tau), weighted.standard_deviation(), sigma, weighted.condition()};
}

}  // namespace dyntape
