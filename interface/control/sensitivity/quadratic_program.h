// SPDX-License-Identifier: BSD-3-Clause
//
// Data, solution and status of a dense quadratic program (quadratic_layer.h).
//
//   minimise  1/2 x.Q x + q.x   subject to  A x = b,  G x <= h
#pragma once

#include <Eigen/Core>

namespace dyntape {

struct QuadraticProgram {
  Eigen::MatrixXd Q = {};  // (n x n) symmetric
  Eigen::VectorXd q = {};  // (n)
  Eigen::MatrixXd A = {};  // (equalities x n)
  Eigen::VectorXd b = {};
  Eigen::MatrixXd G = {};  // (inequalities x n)
  Eigen::VectorXd h = {};
};

struct QuadraticSolution {
  // x (n), and the multipliers of equalities and inequalities: Q x + q + A^T nu + G^T lambda = 0.
  Eigen::VectorXd x, nu, lambda;
  // Results of forward(): the range of multiples of the change in which the active set is constant, to first order.
  double from = 0, to = 0;
};

enum class QpStatus { kSolved, kInfeasible, kUnbounded, kUnknown };
const char* to_string(QpStatus status);

}  // namespace dyntape
