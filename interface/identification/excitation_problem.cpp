// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/identification/excitation_problem.h>

#include <cmath>
#include <random>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/model/configuration.h>

namespace dyntape {

using dynamics::Model;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// (displacement from neutral, v, a) -> Y_b, column after column.
Function record_base_regressor(const Model<double>& model, const BaseParameters& base) {
  const Model<AD> taped = model.cast<AD>();
  const auto nv = static_cast<std::size_t>(model.nv);
  return record("base_regressor", 3 * nv, [&](const VectorXad& x) -> VectorXad {
    dynamics::Data<AD> data(taped);
    dynamics::RegressorData<AD> regressor(taped, base.columns);
    const VectorXad d = x.head(model.nv), v = x.segment(model.nv, model.nv), a = x.tail(model.nv);
    const VectorXad q = dynamics::integrate<AD>(taped, dynamics::neutral(taped), d);
    const MatrixXad Y =
        dynamics::torque_regressor<AD>(taped, data, regressor, q, v, a)(Eigen::all, base.independent);
    return Y.reshaped();
  });
}

}  // namespace

ExcitationLimits excitation_limits(const Model<double>& model, const ExcitationOptions& options) {
  if (options.harmonics < 2 || options.samples < 4 * options.harmonics || !(options.period > 0) ||
      !(options.margin > 0 && options.margin <= 1))
    throw ArgumentError(
        "excitation: expected two harmonics or more, four samples a harmonic or more, a period "
        "and a margin that are positive");
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
      if (!(reach[d] > 0))
        throw ArgumentError("excitation: joint \"" + joint.name + "\" has no room to move");
      limits.reach(joint.idx_v, d) = options.margin * reach[d];
    }
    limits.middle[joint.idx_v] = 0.5 * (lower + upper);
  }
  return limits;
}

FourierSeries random_series(const Model<double>& model, const ExcitationOptions& options,
                            unsigned long seed) {
  const ExcitationLimits limits = excitation_limits(model, options);
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
  if (series.coefficients.rows() != model.nv)
    throw ArgumentError("sample: the series has " + std::to_string(series.coefficients.rows()) +
                        " joints, model \"" + model.name + "\" expects " + std::to_string(model.nv));
  Samples samples{
      MatrixXd(model.nq, times.size()), series.velocities(times), series.accelerations(times), {}, times};
  const VectorXd neutral = dynamics::neutral(model);
  const MatrixXd positions = series.positions(times);
  for (Eigen::Index i = 0; i < times.size(); ++i) {
    samples.q.col(i) = dynamics::integrate<double>(model, neutral, positions.col(i));
  }
  return samples;
}

ExcitationProblem::ExcitationProblem(const Model<double>& model, const BaseParameters& base,
                                     const ExcitationOptions& options)
    : model_(model),
      base_(base),
      options_(options),
      width_(2 * options.harmonics + 1),
      times_(times_of_period(options.period, options.samples)),
      slope_(compact(vjp(record_base_regressor(model, base)))),
      workspace_(slope_) {
  for (int d = 0; d < 3; ++d) {
    basis_[d] = FourierSeries::basis(options.period, options.harmonics, d, times_);
  }
  make_shape();
}

bool ExcitationProblem::objective(const double* x, double& value) {
  if (!update(x)) return false;
  value = value_;
  return std::isfinite(value);
}

bool ExcitationProblem::gradient(const double* x, double* gradient) {
  if (!update(x)) return false;
  conditions_.push_back(condition_);
  errors_.push_back(std::exp(-log_det_ / (2.0 * base_.rank())));
  const MatrixXd derivatives = regressor_slopes();
  const Eigen::Index nv = model_.nv;
  MatrixXd sum = MatrixXd::Zero(nv, width_);
  VectorXd state(3 * nv), of_state(3 * nv);
  for (Eigen::Index t = 0; t < times_.size(); ++t) {
    state << displacements_.col(t), samples_.v.col(t), samples_.a.col(t);
    const MatrixXd weights = derivatives.middleRows(t * nv, nv);
    slope_(state.data(), nullptr, weights.data(), of_state.data(), workspace_);
    for (int d = 0; d < 3; ++d) sum += of_state.segment(d * nv, nv) * basis_[d].col(t).transpose();
  }
  Eigen::Map<RowMajorMatrix>(gradient, nv, width_) = sum;
  return sum.allFinite();
}

bool ExcitationProblem::constraints(const double* x, double* g) {
  const MatrixXd c = series(x).coefficients;
  Eigen::Map<MatrixXd> rows(g, times_.size(), 3 * model_.nv);
  for (int j = 0; j < model_.nv; ++j) {
    for (int d = 0; d < 3; ++d) rows.col(3 * j + d) = (c.row(j) * basis_[d]).transpose();
  }
  return true;
}

bool ExcitationProblem::jacobian(const double*, double* nonzeros) {
  for (int j = 0; j < model_.nv; ++j) {
    for (int d = 0; d < 3; ++d) {
      for (Eigen::Index t = 0; t < times_.size(); ++t) {
        for (int k = d == 0 ? 0 : 1; k < width_; ++k) *nonzeros++ = basis_[d](k, t);
      }
    }
  }
  return true;
}

std::vector<double> ExcitationProblem::flat(const FourierSeries& series) {
  std::vector<double> x(static_cast<std::size_t>(series.coefficients.size()));
  Eigen::Map<RowMajorMatrix>(x.data(), series.coefficients.rows(), series.coefficients.cols()) =
      series.coefficients;
  return x;
}

FourierSeries ExcitationProblem::series(const double* x) const {
  return {options_.period, Eigen::Map<const RowMajorMatrix>(x, model_.nv, width_)};
}

// RowMajorMatrix: for each joint position, velocity, acceleration, each at all times.
void ExcitationProblem::make_shape() {
  const ExcitationLimits limits = excitation_limits(model_, options_);
  std::vector<std::vector<std::uint32_t>> columns;
  for (int j = 0; j < model_.nv; ++j) {
    for (int d = 0; d < 3; ++d) {
      for (Eigen::Index t = 0; t < times_.size(); ++t) {
        const double middle = d == 0 ? limits.middle[j] : 0;
        const double reach = d > 0 && t == 0 ? 0 : limits.reach(j, d);
        shape_.g_lower.push_back(middle - reach);
        shape_.g_upper.push_back(middle + reach);
        auto& row = columns.emplace_back();
        for (int k = d == 0 ? 0 : 1; k < width_; ++k) {
          row.push_back(static_cast<std::uint32_t>(j * width_ + k));
        }
      }
    }
  }
  const auto n = static_cast<std::size_t>(model_.nv * width_);
  shape_.x_lower.assign(n, -std::numeric_limits<double>::infinity());
  shape_.x_upper.assign(n, std::numeric_limits<double>::infinity());
  shape_.jacobian = pattern_from_rows(columns, n);
  shape_.hessian.rows = shape_.hessian.cols = n;
  shape_.hessian_kind = HessianKind::kLimitedMemory;
}

// The regressor at these coefficients, its factor and the criterion; nothing where they are the last ones.
bool ExcitationProblem::update(const double* x) {
  FourierSeries looked_at = series(x);
  if (series_.coefficients.size() && looked_at.coefficients == series_.coefficients) return usable_;
  series_ = std::move(looked_at);
  samples_ = sample(model_, series_, times_);
  displacements_ = series_.positions(times_);
  W_ = stacked_base_regressor(model_, base_, samples_) * base_.scale.cwiseInverse().asDiagonal();
  const Eigen::Index r = W_.cols();
  R_ = triangular_factor(W_);
  const bool vectors = options_.criterion == ExcitationCriterion::kCondition;
  svd_ = singular_values(R_, vectors);
  const VectorXd& s = svd_.values;
  usable_ = s.allFinite() && s[r - 1] > 1e-13 * s[0];
  if (!usable_) return false;
  condition_ = s[0] / s[r - 1];
  log_det_ = 2 * s.array().log().sum();
  value_ = vectors ? std::log(condition_) : -log_det_ / static_cast<double>(r);
  return true;
}

// Derivative of the criterion by the entries of Y_b, (N nv x r).
MatrixXd ExcitationProblem::regressor_slopes() const {
  const Eigen::Index r = W_.cols();
  MatrixXd P;  // slope = W P, symmetric
  if (options_.criterion == ExcitationCriterion::kCondition) {
    const VectorXd &s = svd_.values, first = svd_.right.col(0), last = svd_.right.col(r - 1);
    P = first * first.transpose() / (s[0] * s[0]) - last * last.transpose() / (s[r - 1] * s[r - 1]);
  } else {
    MatrixXd inverse = MatrixXd::Identity(r, r);
    R_.triangularView<Eigen::Upper>().solveInPlace(inverse);
    P = inverse * inverse.transpose() * (-2 / static_cast<double>(r));
  }
  return W_ * P * base_.scale.cwiseInverse().asDiagonal();
}

}  // namespace dyntape
