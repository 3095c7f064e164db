// SPDX-License-Identifier: BSD-3-Clause
//
// A step of sequential quadratic programming of a program whose rows are equations and whose variables are free or held: one
// linear system, stage by stage.
//
//   QpSubproblem model(nlp);
//   if (EqualityQp::fits(nlp.shape())) ...
//   EqualityQp qp(model);
//   if (model.expand(x, lambda)) NlpSolution next = qp.solve();              // x + dx, and the multipliers there
//
//   H dx + J^T lambda = - grad f,     J dx = - (g - what g is to be)
//
// Where limits are soft (penalties.h: RelaxedBarrier), that is the whole real-time iteration: its time is the same each step,
// near limits and far from them.
//
// Where H has no minimum on the rows the status is "step failed", and the point stays.
#pragma once

#include <dyntape/interface/control/mpc/qp_subproblem.h>
#include <dyntape/interface/control/nlp/solution.h>
#include <dyntape/interface/control/riccati/stage_kkt.h>

namespace dyntape {

class EqualityQp {
 public:
  static bool fits(const NlpShape& shape);

  explicit EqualityQp(QpSubproblem& model);

  NlpSolution solve();  // from the point that the model is of

  // As StructuredInteriorPoint's, of the last step.
  Eigen::MatrixXd derivatives(const std::vector<std::size_t>& held);

 private:
  QpSubproblem& model_;
  StagewiseKkt kkt_;
  KktVector right_, step_;
  KktDiagonal diagonal_;
  bool has_factor_ = false;
};

}  // namespace dyntape
