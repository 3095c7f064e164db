// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/steps/step_jacobians.h>

#include <algorithm>
#include <numeric>

namespace dyntape {

namespace {

using Eigen::Map;
using Eigen::VectorXd;

CodegenOptions values_only(CodegenOptions options) {
  options.order = Order::kValue;
  return options;
}

}  // namespace

StepJacobians::Kernel::Kernel(const Function& f, const CodegenOptions& options)
    : function(CompiledFunction::make(f, values_only(options))), workspace(function) {}

void StepJacobians::Kernel::run(std::size_t count) {
  const Points points{.count = count, .x = x.data(), .p = p.data(), .y = y.data()};
  function.check(function.run(Order::kValue, points, workspace), count);
}

StepJacobians::StepJacobians(const System& system, Integrator integrator, const CodegenOptions& options)
    : recorded_(record_jacobians(system, integrator)),
      nq_(system.model.nq),
      nv_(system.model.nv),
      nx_(nq_ + nv_ + int(lagged_motors(system).size())),
      nt_(nx_ - nq_ + nv_),
      n_u_(system.n_u),
      n_p_(system.n_p),
      points_(recorded_.points, options),
      dynamics_(recorded_.dynamics, options),
      chain_(recorded_.chain, options) {
  for (Kernel* kernel : {&points_, &dynamics_, &chain_}) {
    const Eigen::Index count = kernel == &dynamics_ ? recorded_.n_points : 1;
    kernel->x = Eigen::MatrixXd::Zero(Eigen::Index(kernel->function.n_x()), count);  // increments stay zero
    kernel->p = Eigen::MatrixXd::Zero(Eigen::Index(kernel->function.n_p()), count);
    kernel->y = Eigen::MatrixXd::Zero(Eigen::Index(kernel->function.n_y()), count);
  }
  const Pattern& pattern = recorded_.of_chain;
  rows_ = Rows::Zero(Eigen::Index(pattern.rows), recorded_.n_z + nt_ + n_u_ + n_p_);
  slopes_ = Eigen::MatrixXd::Zero(recorded_.n_dynamics, Eigen::Index(recorded_.of_dynamics.cols));
  order_.resize(pattern.nnz());
  std::iota(order_.begin(), order_.end(), 0);
  std::stable_sort(order_.begin(), order_.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return pattern.col[a] < pattern.col[b]; });
  for (int i = 0; i <= recorded_.n_points; ++i) {
    const auto is_before = [&](std::uint32_t k) {
      return pattern.col[k] < std::uint32_t(i * recorded_.n_dynamics);
    };
    of_point_.push_back(
        std::size_t(std::partition_point(order_.begin(), order_.end(), is_before) - order_.begin()));
  }
}

std::vector<const CompiledFunction*> StepJacobians::functions() const {
  return {&points_.function, &dynamics_.function, &chain_.function};
}

std::size_t StepJacobians::operations() const {
  return points_.function.operations(Order::kValue) + chain_.function.operations(Order::kValue) +
         std::size_t(recorded_.n_points) * dynamics_.function.operations(Order::kValue);
}

void StepJacobians::evaluate_kernels(const double* z, const double* arguments, const double* x_next) {
  const int n_z = recorded_.n_z, n = recorded_.n_dynamics, n_points = recorded_.n_points,
            row = 1 + nq_ + nv_ + n_u_;
  VectorXd unknowns(n_z);  // of a variational step also v'
  const int solved = std::min(n_z, nv_);
  unknowns << Map<const VectorXd>(z, solved), Map<const VectorXd>(x_next + nq_, n_z - solved);
  const Map<const VectorXd> given(arguments, nx_ + 2 + n_u_ + n_p_), end(x_next, nx_);
  points_.p << given, unknowns;
  points_.run();
  const Map<const Eigen::MatrixXd> at(points_.y.data(), row, n_points);
  dynamics_.p = at.topRows(1 + nq_);
  dynamics_.x.middleRows(nv_, nv_ + n_u_) = at.bottomRows(nv_ + n_u_);
  dynamics_.x.bottomRows(n_p_) = given.tail(n_p_).replicate(1, n_points);
  dynamics_.run(std::size_t(n_points));
  chain_.x << dynamics_.y.topRows(n).reshaped(), unknowns, VectorXd::Zero(nt_), given.segment(nx_ + 2, n_u_);
  chain_.p << given.head(nx_ + 2), at.middleRows(1, nq_).reshaped(), end;
  chain_.run();
}

// From the first point to the last: what it moves by, what comes of it, and where that enters.
void StepJacobians::chain_points() {
  const Pattern &chain = recorded_.of_chain, &derivatives = recorded_.of_dynamics;
  const Eigen::Index before = Eigen::Index(recorded_.n_points) * recorded_.n_dynamics, width = 2 * nv_ + n_u_;
  rows_.setZero();
  for (std::size_t k = of_point_.back(); k < order_.size(); ++k)
    rows_(chain.row[order_[k]], chain.col[order_[k]] - before) = chain_.y(order_[k], 0);
  for (int i = 0; i < recorded_.n_points; ++i) {
    for (std::size_t k = 0; k < derivatives.nnz(); ++k)
      slopes_(derivatives.row[k], derivatives.col[k]) =
          dynamics_.y(recorded_.n_dynamics + Eigen::Index(k), i);
    by_all_ = slopes_.leftCols(width) * rows_.middleRows(i * width, width);
    by_all_.rightCols(n_p_) += slopes_.rightCols(n_p_);
    for (std::size_t k = of_point_[std::size_t(i)]; k < of_point_[std::size_t(i) + 1]; ++k)
      rows_.row(chain.row[order_[k]]) +=
          chain_.y(order_[k], 0) * by_all_.row(chain.col[order_[k]] - i * recorded_.n_dynamics);
  }
}

void StepJacobians::evaluate(const double* z, const double* arguments, const double* x_next) {
  evaluate_kernels(z, arguments, x_next);
  chain_points();
  const int n_z = recorded_.n_z;
  const Eigen::Index others = rows_.cols() - n_z;
  const auto residual = rows_.middleRows(rows_.rows() - nt_ - n_z, n_z), end = rows_.bottomRows(nt_);
  matrix_ = end.rightCols(others);
  if (n_z)
    matrix_ -= end.leftCols(n_z) * residual.leftCols(n_z).partialPivLu().solve(residual.rightCols(others));
}

}  // namespace dyntape
