// SPDX-License-Identifier: BSD-3-Clause
//
// Secant approximations of the curvature that Gauss-Newton omits, for each stage, from the first derivatives of the
// iterations.
//
//   secants.learn(stages, before, x, u, adjoint);   // after each linearisation; stages[k].H is Gauss-Newton's
//   if (secants.help()) ... stages[k].H + secants.of_stage(k)   // may be indefinite
//
// Over a step s of a stage's (x, u) the gradient of its Lagrangian, g + (A | B)^T lambda_{k+1}, changes by the true
// curvature times s.  A rank-one update of S makes (H + S) s equal to this change (SR1, with its skipping rule in
// units of the steps).  If S predicted a change worse than no S, it is reset.  Along the last step of all stages the
// true curvature is known, and so are the errors of H and of H + S: help() is true if H was far off and S less.  If
// H is accurate, S adds noise.
//
// Sources: J. Dennis, D. Gay, R. Welsch, ACM TOMS 7 (1981), NL2SOL: two models, the better is used; J. Nocedal, S.
// Wright, Numerical Optimization, 6.2.
#pragma once

#include <vector>

#include <dyntape/interface/control/riccati/riccati.h>

namespace dyntape {

class StageSecants {
 public:
  // adjoint: (n_x x N + 1), for the motion x, u of the linearisation; before: the previous linearisation.
  void learn(const std::vector<StageColumns>& stages, const std::vector<StageSlopes>& before,
             const Eigen::MatrixXd& x, const Eigen::MatrixXd& u, const Eigen::MatrixXd& adjoint);
  bool help() const { return help_; }
  const Eigen::MatrixXd& of_stage(std::size_t k) const { return S_[k]; }  // of the size of the stage's H

 private:
  struct Curvatures {  // s.H s, s.(true - H) s, s.(true - H - S) s, summed over the stages
    double known = 0, missing = 0, left = 0;
  };
  void begin(const std::vector<StageColumns>& stages);
  void find_steps(const Eigen::MatrixXd& x, const Eigen::MatrixXd& u);
  double change_of_slope(const StageColumns& now, const StageSlopes& before, const double* lambda);
  void change(Eigen::MatrixXd& S, const StageColumns& now, const StageSlopes& before, const double* s,
              const double* lambda, Curvatures& along);

  std::vector<Eigen::MatrixXd> S_;
  // Rows padded (columns.h).
  Eigen::MatrixXd z_, s_;      // (n_z x N) where they were linearised; the steps there
  Eigen::VectorXd size_;       // (n_z) the largest step of each entry; ones after them
  Eigen::VectorXd y_, r_, w_;  // the errors of H and of H + S; work
  Eigen::VectorXd squares_, scaled_;
  bool help_ = false;
};

}  // namespace dyntape
