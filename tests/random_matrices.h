// SPDX-License-Identifier: BSD-3-Clause
//
// Matrices of normal numbers, the same in every run.
#pragma once

#include <Eigen/Core>
#include <random>

namespace dyntape::test {

class RandomMatrices {
 public:
  explicit RandomMatrices(unsigned seed) : engine_(seed) {}
  Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index cols) {
    return Eigen::MatrixXd::NullaryExpr(rows, cols, [&] { return normal_(engine_); });
  }
  Eigen::VectorXd vector(Eigen::Index n) { return matrix(n, 1); }
  int below(int n) { return int(engine_() % unsigned(n)); }

 private:
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
};

}  // namespace dyntape::test
