// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/identification/base_parameters.h>

#include <cmath>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/mimic.h>
#include <dyntape/interface/identification/rank_revealing_qr.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {
namespace {

using dynamics::Data;
using dynamics::JointColumns;
using dynamics::MimicModel;
using dynamics::MimicRule;
using dynamics::Model;
using dynamics::RegressorData;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Regressors of all samples, one below the other, `columns` of them.
MatrixXd stack(const Model<double>& model, const JointColumns& joint_columns,
               const std::vector<MimicRule>& mimics, const Samples& samples,
               const std::vector<int>* columns) {
  const MimicModel<double> leaders(model, mimics);
  Data<double> data(model);
  RegressorData<double> regressor(model, joint_columns);
  const Eigen::Index width = columns ? static_cast<Eigen::Index>(columns->size()) : regressor.Y.cols();
  MatrixXd W = MatrixXd::Zero(samples.count() * leaders.nv, width);
  for (Eigen::Index i = 0; i < samples.count(); ++i) {
    dynamics::torque_regressor<double>(
        model, data, regressor, expand_configuration<double>(leaders, samples.q.col(i)),
        expand_tangent<double>(leaders, samples.v.col(i)), expand_tangent<double>(leaders, samples.a.col(i)));
    auto rows = W.middleRows(i * leaders.nv, leaders.nv);
    for (int k = 0; k < model.nv; ++k) {  // G^T Y
      const dynamics::FollowedEntry& entry = leaders.v_entries[static_cast<std::size_t>(k)];
      if (columns) {
        rows.row(entry.index) += entry.factor * regressor.Y(k, *columns);
      } else {
        rows.row(entry.index) += entry.factor * regressor.Y.row(k);
      }
    }
  }
  return W;
}

// "mcy2 + 0.425 m3 - Ixx3": the combination of one base parameter, its own column first.
std::string combination_text(const Eigen::RowVectorXd& row, int own, const std::vector<std::string>& names) {
  std::string text = names[static_cast<std::size_t>(own)];
  for (Eigen::Index j = 0; j < row.size(); ++j) {
    const double c = row[j];
    if (j == own || c == 0) continue;
    text += c < 0 ? " - " : " + ";
    if (std::abs(std::abs(c) - 1) > 1e-9) text += io::with_digits(std::abs(c), 4) + " ";
    text += names[static_cast<std::size_t>(j)];
  }
  return text;
}

}  // namespace

std::vector<std::string> parameter_names(const Model<double>& model, const JointColumns& columns) {
  std::vector<std::string> names = dynamics::inertial_parameter_names(model.njoints());
  const auto add = [&](bool wanted, const char* kind) {
    for (int i = 0; wanted && i < model.njoints(); ++i) {
      if (is_single(model.joints[i].type)) names.push_back(kind + std::to_string(i + 1));
    }
  };
  add(columns.armature, "armature");
  add(columns.viscous, "viscous");
  add(columns.coulomb, "coulomb");
  return names;
}

VectorXd parameter_values(const Model<double>& model, const JointColumns& columns) {
  std::vector<double> values;
  for (double x : VectorXd(dynamics::inertial_parameters(model))) values.push_back(x);
  const auto add = [&](bool wanted, auto field) {
    for (int i = 0; wanted && i < model.njoints(); ++i) {
      if (is_single(model.joints[i].type)) values.push_back(model.joints[i].*field);
    }
  };
  add(columns.armature, &dynamics::Joint<double>::armature);
  add(columns.viscous, &dynamics::Joint<double>::damping);
  add(columns.coulomb, &dynamics::Joint<double>::friction);
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

Samples random_samples(const Model<double>& model, int count, unsigned long seed,
                       const std::vector<MimicRule>& mimics) {
  const MimicModel<double> leaders(model, mimics);
  std::mt19937_64 random(seed);
  const auto uniform = [&](double bound) {
    return bound * (2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1);
  };
  Samples samples{
      MatrixXd(leaders.nq, count), MatrixXd(leaders.nv, count), MatrixXd(leaders.nv, count), {}, {}};
  for (int i = 0; i < count; ++i) {
    samples.q.col(i) = random_configuration(leaders, random);
    for (double& v : samples.v.col(i)) v = uniform(2);
    for (double& a : samples.a.col(i)) a = uniform(5);
  }
  return samples;
}

BaseParameters base_parameters(const Model<double>& model, const BaseOptions& options) {
  if (model.nv == 0) throw ArgumentError("base_parameters: model \"" + model.name + "\" has no joint");
  const std::vector<std::string> names = parameter_names(model, options.columns);
  const auto n = static_cast<Eigen::Index>(names.size());
  // Twice as many rows as columns: a random state leaves no direction out by accident.
  const int rows = model.nv - static_cast<int>(options.mimics.size());
  const int states = static_cast<int>(2 * n / rows) + 10;
  const MatrixXd W = stack(model, options.columns, options.mimics,
                           random_samples(model, states, options.seed, options.mimics), nullptr);
  const ColumnSpace space = column_space(W, options.tolerance);

  BaseParameters base;
  base.columns = options.columns;
  base.mimics = options.mimics;
  base.independent = space.independent;
  base.least_kept = space.least_kept;
  base.most_dropped = space.most_dropped;
  const Eigen::Index rank = space.rank();
  base.regrouping = MatrixXd::Zero(rank, n);
  for (Eigen::Index i = 0; i < rank; ++i) {
    base.regrouping(i, space.independent[static_cast<std::size_t>(i)]) = 1;
    for (std::size_t j = 0; j < space.dependent.size(); ++j) {
      // What is rounding in the least squares is zero by structure.
      const double c = space.combination(i, static_cast<Eigen::Index>(j));
      if (std::abs(c) > 1e-11) base.regrouping(i, space.dependent[j]) = c;
    }
    const int own = space.independent[static_cast<std::size_t>(i)];
    base.names.push_back(combination_text(base.regrouping.row(i), own, names));
  }
  for (int j : space.dependent) {
    if (W.col(j).norm() <= 1e-13 * W.colwise().norm().maxCoeff()) base.unidentifiable.push_back(j);
  }
  base.scale = W(Eigen::all, space.independent).colwise().norm() / std::sqrt(static_cast<double>(W.rows()));
  return base;
}

MatrixXd stacked_base_regressor(const Model<double>& model, const BaseParameters& base,
                                const Samples& samples) {
  const Eigen::Index n = samples.count();
  if (samples.v.cols() != n || samples.a.cols() != n) {
    throw ArgumentError("samples: q has " + std::to_string(n) + " columns, v " +
                        std::to_string(samples.v.cols()) + ", a " + std::to_string(samples.a.cols()) +
                        "; expected as many of each");
  }
  return stack(model, base.columns, base.mimics, samples, &base.independent);
}

}  // namespace dyntape
