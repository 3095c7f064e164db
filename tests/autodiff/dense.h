// SPDX-License-Identifier: BSD-3-Clause
//
// Derivatives as dense matrices at a point, through derive(): what small tests compare with.
#pragma once

#include <Eigen/Core>
#include <vector>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/evaluate/interpret.h>

namespace dyntape::testing {

// (n_y x n_x)
inline Eigen::MatrixXd jacobian(const Function& f, const std::vector<double>& x,
                                const std::vector<double>& p = {}) {
  const Derivatives d = derive(f, Order::kFirst);
  const std::vector<double> all = evaluate(d.function, x, p, std::vector<double>(f.n_w()));
  Eigen::MatrixXd j =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(f.n_y()), static_cast<Eigen::Index>(f.n_x()));
  for (std::size_t k = 0; k < d.jacobian.nnz(); ++k) j(d.jacobian.row[k], d.jacobian.col[k]) = all[d.n_y + k];
  return j;
}

// (n_x x n_x), both triangles, of the sum of weights times outputs.
inline Eigen::MatrixXd hessian(const Function& f, const std::vector<double>& x,
                               const std::vector<double>& weights, const std::vector<double>& p = {}) {
  const SparseFunction h = sparse_hessian(f);
  const std::vector<double> entries = evaluate(h.function, x, p, weights);
  const auto n = static_cast<Eigen::Index>(f.n_x());
  Eigen::MatrixXd full = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t k = 0; k < entries.size(); ++k) {
    full(h.pattern.row[k], h.pattern.col[k]) = full(h.pattern.col[k], h.pattern.row[k]) = entries[k];
  }
  return full;
}

}  // namespace dyntape::testing
