// SPDX-License-Identifier: BSD-3-Clause
//
// One step of sequential quadratic programming for a program with equalities only: one linear system, solved by
// stages.
//
//   QpSubproblem model(nlp);
//   if (EqualityQp::fits(nlp.shape())) ...
//   EqualityQp qp(model);
//   if (model.expand(x, lambda)) NlpSolution next = qp.solve();              // x + dx, and the multipliers there
//
//   H dx + J^T lambda = - grad f,     J dx = - (g - bound of g)
//
// With soft limits (penalties.h: RelaxedBarrier) this is the whole real-time iteration.  Its time is constant, near
// limits and far from them.
//
// If H has no minimum on the rows, the status is "step failed" and the point does not change.
#pragma once

#include <dyntape/interface/control/mpc/qp_subproblem.h>
#include <dyntape/interface/control/nlp/solution.h>
#include <dyntape/interface/control/riccati/stage_kkt.h>

namespace dyntape {

class EqualityQp {
 public:
  static bool fits(const NlpShape& shape);

  explicit EqualityQp(QpSubproblem& model);

  NlpSolution solve();  // from the point of the model

  // Like StructuredInteriorPoint::derivatives, for the last step.
  Eigen::MatrixXd derivatives(const std::vector<std::size_t>& held);

 private:
  QpSubproblem& model_;
  StagewiseKkt kkt_;
  KktVector right_, step_;
  KktDiagonal diagonal_;
  bool has_factor_ = false;
};

}  // namespace dyntape
