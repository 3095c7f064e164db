// SPDX-License-Identifier: BSD-3-Clause
//
// Solves a dense convex quadratic program and finds out what its solution is; QuadraticLayer (quadratic_layer.h) derives it.
//
//   const QuadraticFindings f = quadratic_findings(p);      // p: Q has a diagonal of about one, rows of A and G have length one or zero
//
// Equalities are eliminated.  The dual active-set method minimises the rest (nearest_point.h), with proximal steps in the directions
// without curvature, onto which the slope is projected to find descent without end.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/control/nlp/sensitivity_status.h>
#include <dyntape/interface/control/sensitivity/quadratic_program.h>

namespace dyntape {

struct QuadraticFindings {
  QpStatus outcome = QpStatus::kUnknown;
  SensitivityStatus status = SensitivityStatus::kNotASolution;
  std::string why;
  QuadraticSolution solution, certificate;
  std::vector<std::size_t> weak;  // active inequalities with multiplier zero
  // Rows that do not depend on those before: of A; of G with a multiplier; of G, weak.
  std::vector<Eigen::Index> equal, strong, open;
  bool needs_open = false;  // the minimum is not strict without the weak rows
};
QuadraticFindings quadratic_findings(const QuadraticProgram& p);

inline Eigen::MatrixXd stacked(const Eigen::MatrixXd& above, const Eigen::MatrixXd& below) {
  Eigen::MatrixXd M(above.rows() + below.rows(), above.cols());
  M.topRows(above.rows()) = above, M.bottomRows(below.rows()) = below;
  return M;
}

}  // namespace dyntape
