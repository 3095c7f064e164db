// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/identification/excitation_limits.h>

#include <cmath>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/model/configuration.h>

namespace dyntape {

using dynamics::Model;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace detail {

ExcitationLimits excitation_limits(const Model<double>& model, const ExcitationOptions& options) {
  if (options.harmonics < 2 || options.samples < 4 * options.harmonics || !(options.period > 0) ||
      !(options.margin > 0 && options.margin <= 1)) {
    throw ArgumentError(
        "excitation: expected two harmonics or more, four samples a harmonic or more, a period "
        "and a margin that are positive");
  }
  ExcitationLimits limits{VectorXd(model.nv), MatrixXd(model.nv, 3)};
  for (const dynamics::Joint<double>& joint : model.joints) {
    if (!is_single(joint.type)) {
      throw ArgumentError("excitation: joint \"" + joint.name + "\" is a " + to_string(joint.type) +
                          "; only joints with one degree of freedom can be driven through a series");
    }
    const auto or_default = [](double limit, double otherwise) {
      return std::isfinite(limit) ? limit : otherwise;
    };
    const double lower = or_default(joint.limits.lower, -options.position);
    const double upper = or_default(joint.limits.upper, options.position);
    const double reach[] = {0.5 * (upper - lower), or_default(joint.limits.velocity, options.velocity),
                            options.acceleration};
    for (int d = 0; d < 3; ++d) {
      if (!(reach[d] > 0)) {
        throw ArgumentError("excitation: joint \"" + joint.name + "\" has no room to move");
      }
      limits.reach(joint.idx_v, d) = options.margin * reach[d];
    }
    limits.middle[joint.idx_v] = 0.5 * (lower + upper);
  }
  return limits;
}

}  // namespace detail

FourierSeries random_series(const Model<double>& model, const ExcitationOptions& options,
                            unsigned long seed) {
  const detail::ExcitationLimits limits = detail::excitation_limits(model, options);
  const int H = options.harmonics;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  FourierSeries series{options.period, MatrixXd(model.nv, 2 * H + 1)};
  const VectorXd times = times_of_period(options.period, options.samples);
  // Rest at t = 0: v(0) = sum a_k and a(0) = w sum k b_k vanish.
  const VectorXd of_b = VectorXd::LinSpaced(H, 1, H);
  for (int j = 0; j < model.nv; ++j) {
    VectorXd a(H), b(H);
    for (double& x : a) x = normal(random);
    for (double& x : b) x = normal(random);
    a.array() -= a.mean();
    b -= of_b * (of_b.dot(b) / of_b.squaredNorm());
    series.coefficients.row(j) << 0, a.transpose(), b.transpose();
  }
  for (int j = 0; j < model.nv; ++j) {
    double scale = std::numeric_limits<double>::infinity();
    for (int d = 0; d < 3; ++d) {
      const MatrixXd basis = FourierSeries::basis(options.period, H, d, times);
      const double most = (series.coefficients.row(j) * basis).cwiseAbs().maxCoeff();
      scale = std::min(scale, limits.reach(j, d) / most);
    }
    series.coefficients.row(j) *= scale;
    series.coefficients(j, 0) = limits.middle[j];
  }
  return series;
}

Samples sample(const Model<double>& model, const FourierSeries& series, const VectorXd& times) {
  if (series.coefficients.rows() != model.nv) {
    throw ArgumentError("sample: the series has " + std::to_string(series.coefficients.rows()) +
                        " joints, model \"" + model.name + "\" expects " + std::to_string(model.nv));
  }
  Samples samples{
      MatrixXd(model.nq, times.size()), series.velocities(times), series.accelerations(times), {}, times};
  const VectorXd neutral = dynamics::neutral(model);
  const MatrixXd positions = series.positions(times);
  for (Eigen::Index i = 0; i < times.size(); ++i) {
    samples.q.col(i) = dynamics::integrate<double>(model, neutral, positions.col(i));
  }
  return samples;
}

}  // namespace dyntape
