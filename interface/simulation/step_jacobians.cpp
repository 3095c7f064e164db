// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/simulation/step_jacobians.h>

#include <algorithm>

namespace dyntape {

StepJacobians::StepJacobians(const RecordedJacobians& recorded, int nx, int n_z, int nt,
                             const CodegenOptions& options)
    : pattern_(recorded.pattern),
      function_(CompiledFunction::make(recorded.function, options)),
      workspace_(function_),
      nx_(nx),
      n_z_(n_z),
      nt_(nt) {
  variables_ =
      Eigen::VectorXd::Zero(Eigen::Index(function_.n_x()));  // those of dx stay zero, and are not read
  parameters_ = Eigen::VectorXd::Zero(Eigen::Index(function_.n_p()));
  non_zeros_ = Eigen::VectorXd::Zero(Eigen::Index(pattern_.nnz()));
  all_ = Eigen::MatrixXd::Zero(Eigen::Index(pattern_.rows), Eigen::Index(pattern_.cols));
}

void StepJacobians::evaluate(const double* z, const double* arguments, const double* x_next) {
  const Eigen::Index n_y = all_.cols() - n_z_, others = n_y - nt_;
  std::copy_n(z, n_z_, variables_.data());
  std::copy_n(arguments + nx_ + 2, others, variables_.data() + n_z_ + nt_);
  std::copy_n(x_next, nx_, std::copy_n(arguments, nx_ + 2, parameters_.data()));
  const Points points{.x = variables_.data(), .p = parameters_.data(), .y = non_zeros_.data()};
  function_.check(function_.run(Order::kValue, points, workspace_));
  for (std::size_t k = 0; k < pattern_.nnz(); ++k)
    all_(pattern_.row[k], pattern_.col[k]) = non_zeros_[Eigen::Index(k)];
  matrix_ = all_.bottomRightCorner(nt_, n_y);
  if (n_z_ == 0) return;
  matrix_ -= all_.bottomLeftCorner(nt_, n_z_) *
             all_.topLeftCorner(n_z_, n_z_).partialPivLu().solve(all_.topRightCorner(n_z_, n_y));
}

}  // namespace dyntape
