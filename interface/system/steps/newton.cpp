// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/steps/newton.h>

#include <algorithm>
#include <limits>

namespace dyntape {

namespace {

constexpr int kMostResiduals = 100;
constexpr double kLeastDamping = 0x1p-20;
constexpr double kKeeps = 0.1;      // the Jacobian, while a step is at most so much of the one before
constexpr double kStalled = 1e-10;  // of the size: where steps shrink no more below it, they are rounding
constexpr double kNewtonRounding = std::numeric_limits<double>::epsilon() / 4;

double largest_entry(const Eigen::VectorXd& x) { return x.cwiseAbs().maxCoeff(); }

}  // namespace

Newton::Newton(const CompiledFunction& residual) : residual_(residual), workspace_(residual_) {
  const auto n = Eigen::Index(residual_.n_x());
  for (Eigen::VectorXd* x : {&z_, &trial_, &r_, &d_, &d_next_}) *x = Eigen::VectorXd::Zero(n);
  non_zeros_.resize(Eigen::Index(residual_.jacobian_pattern().nnz()));
  jacobian_ = Eigen::MatrixXd::Zero(n, n);
  lu_ = Eigen::PartialPivLU<Eigen::MatrixXd>(n);
}

Newton::Outcome Newton::evaluate(Order order, const Eigen::VectorXd& z, const double* p) {
  ++residuals_;
  violation_ = residual_.run(order,
                             {.x = z.data(),
                              .p = p,
                              .y = r_.data(),
                              .jacobian = order == Order::kFirst ? non_zeros_.data() : nullptr},
                             workspace_);
  if (violation_) return Outcome::kGuard;
  return r_.allFinite() ? Outcome::kSolved : Outcome::kNotFinite;
}

// d = -J^-1 r
void Newton::solve_linear(Eigen::VectorXd& d) {
  d.noalias() = lu_.permutationP() * r_;
  lu_.matrixLU().triangularView<Eigen::UnitLower>().solveInPlace(d);
  lu_.matrixLU().triangularView<Eigen::Upper>().solveInPlace(d);
  d = -d;
}

Newton::Outcome Newton::linearise(const double* p) {
  if (const Outcome outcome = evaluate(Order::kFirst, z_, p); outcome != Outcome::kSolved) return outcome;
  const Pattern& pattern = residual_.jacobian_pattern();
  for (std::size_t k = 0; k < pattern.nnz(); ++k)
    jacobian_(pattern.row[k], pattern.col[k]) = non_zeros_[Eigen::Index(k)];
  lu_.compute(jacobian_);
  solve_linear(d_);
  return d_.allFinite() ? Outcome::kSolved : Outcome::kSingular;
}

Newton::Outcome Newton::solve(const double* p, double size) {
  residuals_ = 0;
  double a = 1;
  Outcome outcome = linearise(p);
  while (outcome == Outcome::kSolved && residuals_ < kMostResiduals) {
    const double step = last_step_ = largest_entry(d_), reach = std::max(size, largest_entry(z_) + step);
    trial_ = z_ + a * d_;
    const Outcome at_trial = evaluate(Order::kValue, trial_, p);
    if (at_trial == Outcome::kSolved) solve_linear(d_next_);
    const double next = at_trial == Outcome::kSolved ? largest_entry(d_next_) : HUGE_VAL;
    const double ratio = next == 0 ? 0 : next / step;  // of an affine residual: rounding, or 1 - a
    if (a == 1 && ratio * next <= kNewtonRounding * reach) {
      z_ = trial_ + d_next_;
      return Outcome::kSolved;
    }
    if (step <= kStalled * reach && !(ratio < 0.5)) return Outcome::kSolved;
    if (!(next <= (1 - a / 4) * step)) {
      if ((a /= 2) < kLeastDamping) return at_trial == Outcome::kSolved ? Outcome::kNoDescent : at_trial;
      continue;
    }
    z_ = trial_;
    if (a == 1 && ratio < kKeeps) {
      d_ = d_next_;
    } else {
      outcome = linearise(p);
    }
    a = std::min(1.0, 2 * a);
  }
  return outcome == Outcome::kSolved ? Outcome::kTooLong : outcome;
}

}  // namespace dyntape
