// SPDX-License-Identifier: BSD-3-Clause
//
// The cost at the end of a motion, y = f(x, p), with its gradient and Hessian by x as dense matrices.
//
//   EndCost end(compiled);
//   end.expand(x, p, g, H);
#pragma once

#include <Eigen/Core>
#include <vector>

#include <dyntape/codegen/compiled_function.h>

namespace dyntape {

// Of the end alone, so what it takes does not matter.
class EndCost {
 public:
  explicit EndCost(const CompiledFunction& f)
      : function_(f), workspace_(function_), J_(f.jacobian_pattern().nnz()), H_(f.hessian_pattern().nnz()) {}

  double value(const Eigen::VectorXd& x, const Eigen::VectorXd& p) {
    double y = 0;
    function_.value(x.data(), p.data(), &y, workspace_);
    return y;
  }
  // Its gradient and Hessian.
  void expand(const Eigen::VectorXd& x, const Eigen::VectorXd& p, Eigen::VectorXd& g, Eigen::MatrixXd& H) {
    const double one = 1;
    double y = 0;
    function_.second_order(x.data(), p.data(), &one, &y, J_.data(), H_.data(), workspace_);
    g.setZero(x.size()), H.setZero(x.size(), x.size());
    const Pattern &of_J = function_.jacobian_pattern(), &of_H = function_.hessian_pattern();
    for (std::size_t k = 0; k < of_J.nnz(); ++k) g[of_J.col[k]] = J_[k];
    for (std::size_t k = 0; k < of_H.nnz(); ++k)
      H(of_H.row[k], of_H.col[k]) = H(of_H.col[k], of_H.row[k]) = H_[k];
  }

 private:
  CompiledFunction function_;
  CompiledFunction::Workspace workspace_;
  std::vector<double> J_, H_;
};

}  // namespace dyntape
