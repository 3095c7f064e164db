// SPDX-License-Identifier: BSD-3-Clause
#include "policy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/motion/robot_configuration.h>

namespace dyntape::python {
namespace {

bool is_finite(const double* x, std::size_t n) {
  return std::all_of(x, x + n, [](double value) { return std::isfinite(value); });
}

// Runs, and throws GuardViolation unless the states that left a branch are none: rows of those get NaN.
void run(const Kernels& kernels, Order order, Points points, const Strides& strides, std::size_t n_x) {
  const CompiledFunction& function = kernels.function;
  std::vector<std::uint32_t> status(points.count);
  points.strides = &strides, points.status = status.data();
  const auto workspace = const_cast<Kernels&>(kernels).pool.take(
      [&] { return std::make_unique<CompiledFunction::Workspace>(function); });
  if (!function.run(order, points, *workspace)) return;
  for (std::size_t k = 0; k < points.count; ++k) {
    if (status[k] == 0) continue;
    if (is_finite(points.x + k * strides.x, n_x)) function.check({status[k], k}, points.count);
    std::fill_n(points.y + k * strides.y, strides.y, std::numeric_limits<double>::quiet_NaN());
  }
}

// (nx x nt) how the entries of a state x = (q, v, motors) change with increments of the moving frame.
Eigen::MatrixXd of_increments(const dynamics::Model<double>& model, const double* x, std::size_t nx) {
  const Eigen::Index nq = model.nq, nv = model.nv, rest = Eigen::Index(nx) - nq;
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(nq + rest, nv + rest);
  N.bottomRightCorner(rest, rest).setIdentity();
  const Eigen::VectorXd q = Eigen::VectorXd::Map(x, nq), none = Eigen::VectorXd::Zero(nv);
  const Eigen::VectorXd home =
      configuration_rate<double>(model, q, none);  // towards directions of length one
  for (Eigen::Index k = 0; k < nv; ++k)
    N.col(k).head(nq) = configuration_rate<double>(model, q, Eigen::VectorXd::Unit(nv, k)) - home;
  return N;
}

}  // namespace

Policy::Policy(std::shared_ptr<const RecordedFunction> f, nb::handle parameters, const std::string& call,
               int nx, int n_u)
    : f_(std::move(f)) {
  const std::string name = call + ": policy \"" + f_->function.name + "\"";
  if (f_->n_x() != static_cast<std::size_t>(nx) || f_->n_y() != static_cast<std::size_t>(n_u))
    throw ArgumentError(name + " takes " + std::to_string(f_->n_x()) + " values and returns " +
                        std::to_string(f_->n_y()) + "; expected a function of the state (" +
                        std::to_string(nx) + ",) that returns the commands (" + std::to_string(n_u) + ",)");
  if (n_p() == 0 && !parameters.is_none())
    throw ArgumentError(name + " was recorded without parameters; expected no parameters");
  if (n_p() > 0 && parameters.is_none())
    throw ArgumentError(name + " has " + std::to_string(n_p()) + " parameters; expected parameters (" +
                        std::to_string(n_p()) + ",) or (worlds, " + std::to_string(n_p()) + ")");
  values_ = kernels_of(*f_, Order::kValue);
  if (n_p() == 0) return;
  parameters_ = numbers(parameters, call + ": parameters");
  const auto columns = static_cast<std::ptrdiff_t>(n_p());
  const Shape& shape = parameters_.shape;
  if ((shape.size() != 1 && shape.size() != 2) || shape.back() != columns)
    throw ArgumentError(call + ": expected parameters of shape (" + std::to_string(n_p()) +
                        ",) or (worlds, " + std::to_string(n_p()) + "), got " + shape_text(shape));
  if (shape.size() == 2) worlds_ = static_cast<std::size_t>(shape[0]);
}

void Policy::prepare_derivatives() {
  CodegenOptions options;
  options.order = Order::kFirst;
  options.route = Route::kTiered;
  slopes_ = std::make_shared<Kernels>(CompiledFunction::make(all_as_variables(f_->function), options));
}

void Policy::commands(const PolicyRows& rows, double* u) const {
  Points points;
  points.count = rows.count, points.x = rows.x, points.y = u;
  points.p = parameters(rows.first);
  const Strides strides{
      .x = rows.stride_x, .p = worlds_ ? n_p() : 0, .w = 0, .y = f_->n_y(), .jacobian = 0, .hessian = 0};
  run(*values_, Order::kValue, points, strides, f_->n_x());
}

void Policy::derivatives(const dynamics::Model<double>& model, const double* x, std::size_t world,
                         PolicySlopes& slopes) const {
  const std::size_t n_x = f_->n_x(), n_u = f_->n_y(), n = n_x + n_p();
  std::vector<double> all(x, x + n_x);
  if (n_p() > 0) all.insert(all.end(), parameters(world), parameters(world) + n_p());
  const Pattern& pattern = slopes_->function.jacobian_pattern();
  std::vector<double> nonzeros(pattern.nnz());
  slopes.u.resize(Eigen::Index(n_u));
  Points points;
  points.x = all.data(), points.y = slopes.u.data();
  if (!nonzeros.empty()) points.jacobian = nonzeros.data();
  run(*slopes_, Order::kFirst, points,
      {.x = n, .p = 0, .w = 0, .y = n_u, .jacobian = pattern.nnz(), .hessian = 0}, n_x);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(Eigen::Index(n_u), Eigen::Index(n));
  for (std::size_t k = 0; k < nonzeros.size(); ++k)
    J(Eigen::Index(pattern.row[k]), Eigen::Index(pattern.col[k])) = nonzeros[k];
  slopes.by_x = J.leftCols(Eigen::Index(n_x)) * of_increments(model, x, n_x);
  slopes.by_p = J.rightCols(Eigen::Index(n_p()));
}

}  // namespace dyntape::python
