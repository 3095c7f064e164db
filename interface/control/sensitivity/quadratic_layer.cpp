// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/sensitivity/quadratic_layer.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/sensitivity/quadratic_findings.h>

namespace dyntape {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMostAsymmetry = 1e-10;  // of Q: symmetric, not negative

[[noreturn]] void refuse_quadratic(const std::string& what) {
  throw ArgumentError("quadratic program: " + what);
}

std::string size_text(const MatrixXd& M) {
  return std::to_string(M.rows()) + " x " + std::to_string(M.cols());
}

void check_shape(const char* name, const MatrixXd& M, Eigen::Index rows, Eigen::Index cols) {
  if (M.rows() != rows || M.cols() != cols)
    refuse_quadratic(std::string(name) + " is " + size_text(M) + ", expected " + std::to_string(rows) +
                     " x " + std::to_string(cols));
}

// Roots of Q's diagonal, those that are zero taken as the greatest of the others, or 1: 1 / root is how far x goes
// for one.
VectorXd roots_of(const MatrixXd& Q) {
  const double most = Q.diagonal().maxCoeff();
  VectorXd roots = Q.diagonal().cwiseMax(0).cwiseSqrt();
  for (double& root : roots) {
    if (!(root > 1e-14 * std::sqrt(most))) root = most > 0 ? std::sqrt(most) : 1;
  }
  return roots;
}

void check_finite(const QuadraticProgram& p) {
  const auto check = [](const char* name, const auto& M) {
    if (!M.allFinite()) refuse_quadratic(std::string(name) + " has an entry that is no finite number");
  };
  check("Q", p.Q), check("q", p.q), check("A", p.A), check("b", p.b), check("G", p.G);
  for (double h : p.h) {
    if (!(h > -HUGE_VAL)) refuse_quadratic("h has an entry that is no number above minus infinity");
  }
}

// With all sizes as they are needed: A and G may be left out.
QuadraticProgram checked(QuadraticProgram p) {
  const Eigen::Index n = p.q.size();
  if (n == 0) refuse_quadratic("there are no variables");
  if (p.A.size() == 0 && p.b.size() == 0) p.A.resize(0, n);
  if (p.G.size() == 0 && p.h.size() == 0) p.G.resize(0, n);
  check_shape("Q", p.Q, n, n);
  check_shape("A", p.A, p.b.size(), n);
  check_shape("G", p.G, p.h.size(), n);
  check_finite(p);
  const VectorXd inverse = roots_of(p.Q).cwiseInverse();
  const MatrixXd scaled = inverse.asDiagonal() * p.Q * inverse.asDiagonal();
  if ((scaled - scaled.transpose()).cwiseAbs().maxCoeff() > kMostAsymmetry)
    refuse_quadratic("Q is not symmetric");
  const MatrixXd shifted = scaled + kMostAsymmetry * MatrixXd::Identity(n, n);
  if (Eigen::LLT<MatrixXd>(shifted).info() != Eigen::Success)
    refuse_quadratic("Q is not positive semidefinite, so that minima need not be unique");
  p.Q = (p.Q + p.Q.transpose()).eval() / 2;
  return p;
}

MatrixXd or_zero(const char* name, const MatrixXd& change, const MatrixXd& like) {
  if (change.size() == 0) return MatrixXd::Zero(like.rows(), like.cols());
  check_shape(name, change, like.rows(), like.cols());
  return change;
}

// Divides each row by its length, or by one, and returns the divisors.
VectorXd normalise_rows(MatrixXd& M) {
  VectorXd lengths = M.rowwise().norm();
  for (Index j = 0; j < M.rows(); ++j) {
    if (!(lengths[j] > 0)) lengths[j] = 1;
    M.row(j) /= lengths[j];
  }
  return lengths;
}

// Sums of terms of these sizes: sums that are rounding become zero.
VectorXd without_rounding(VectorXd sums, const VectorXd& sizes) {
  for (Index i = 0; i < sums.size(); ++i) {
    if (std::abs(sums[i]) <= 1e-14 * sizes[i]) sums[i] = 0;
  }
  return sums;
}

}  // namespace

const char* to_string(QpStatus status) {
  switch (status) {
    case QpStatus::kSolved:
      return "solved";
    case QpStatus::kInfeasible:
      return "infeasible";
    case QpStatus::kUnbounded:
      return "unbounded";
    case QpStatus::kUnknown:
      return "unknown";
  }
  return "";
}

QuadraticLayer::QuadraticLayer(const QuadraticProgram& program) : program_(checked(program)) {
  roots_ = roots_of(program_.Q);
  const VectorXd inverse = roots_.cwiseInverse();
  scaled_ = program_;
  scaled_.Q = inverse.asDiagonal() * program_.Q * inverse.asDiagonal();
  scaled_.q = program_.q.cwiseProduct(inverse);
  scaled_.A = program_.A * inverse.asDiagonal(), scaled_.G = program_.G * inverse.asDiagonal();
  for (Index j = 0; j < program_.h.size(); ++j) {  // rows that every x fulfils, by far
    if (program_.h[j] == HUGE_VAL) scaled_.G.row(j).setZero(), scaled_.h[j] = 1;
  }
  of_A_ = normalise_rows(scaled_.A), of_G_ = normalise_rows(scaled_.G);
  scaled_.b = scaled_.b.cwiseQuotient(of_A_), scaled_.h = scaled_.h.cwiseQuotient(of_G_);
  QuadraticFindings found = quadratic_findings(scaled_);
  outcome_ = found.outcome, status_ = found.status, why_ = std::move(found.why),
  weak_ = std::move(found.weak);
  equal_ = std::move(found.equal), strong_ = std::move(found.strong), open_ = std::move(found.open);
  solution_ = none();
  if (outcome_ == QpStatus::kSolved) solution_ = unscaled(found.solution);
  if (outcome_ == QpStatus::kUnbounded) solution_.x = unscaled(found.solution).x;
  certificate_ = unscaled(found.certificate);
  if (!has_derivatives()) return;
  Rows all = strong_;
  all.insert(all.end(), open_.begin(), open_.end());
  all_held_ = conditions(all);
  held_ = found.needs_open ? all_held_ : conditions(strong_);
}

QuadraticSolution QuadraticLayer::none() const {
  const auto nan = [](const VectorXd& like) { return VectorXd::Constant(like.size(), NAN).eval(); };
  return {nan(program_.q), nan(program_.b), nan(program_.h)};
}

QuadraticSolution QuadraticLayer::unscaled(const QuadraticSolution& s) const {
  QuadraticSolution own = s;
  if (s.x.size()) own.x = s.x.cwiseQuotient(roots_);
  if (s.nu.size()) own.nu = s.nu.cwiseQuotient(of_A_);
  if (s.lambda.size()) own.lambda = s.lambda.cwiseQuotient(of_G_);
  return own;
}

QuadraticLayer::Conditions QuadraticLayer::conditions(const Rows& kept) const {
  const Index n = program_.q.size(), of_A = Index(equal_.size()), of_G = Index(kept.size());
  Conditions c{equal_, kept, MatrixXd::Zero(n + of_A + of_G, n + of_A + of_G), {}};
  c.K.topLeftCorner(n, n) = scaled_.Q;
  c.K.block(n, 0, of_A, n) = scaled_.A(equal_, Eigen::all);
  c.K.block(n + of_A, 0, of_G, n) = scaled_.G(kept, Eigen::all);
  c.K.topRightCorner(n, of_A + of_G) = c.K.bottomLeftCorner(of_A + of_G, n).transpose();
  c.factors.compute(c.K);
  return c;
}

// In the units of the solve.
QuadraticSolution QuadraticLayer::solve(const Conditions& c, const QuadraticSolution& right) const {
  const Index n = program_.q.size(), of_A = Index(c.equal.size());
  const VectorXd sides = stacked(right.x, stacked(right.nu(c.equal), right.lambda(c.kept)));
  VectorXd s = c.factors.solve(sides);
  s += c.factors.solve(sides - c.K * s);
  QuadraticSolution step{s.head(n), VectorXd::Zero(right.nu.size()), VectorXd::Zero(right.lambda.size())};
  step.nu(c.equal) = s.segment(n, of_A);
  step.lambda(c.kept) = s.tail(s.size() - n - of_A);
  return step;
}

// To first order the weak rows stay constraints: a quadratic program of its own.
QuadraticSolution QuadraticLayer::one_sided(const QuadraticSolution& right) const {
  const QuadraticProgram p{.Q = scaled_.Q,
                           .q = -right.x,
                           .A = stacked(scaled_.A(equal_, Eigen::all), scaled_.G(strong_, Eigen::all)),
                           .b = stacked(right.nu(equal_), right.lambda(strong_)),
                           .G = scaled_.G(open_, Eigen::all),
                           .h = right.lambda(open_)};
  const QuadraticLayer layer(p);
  if (!layer.has_derivatives()) return none();
  const QuadraticSolution& s = layer.solution();
  QuadraticSolution step{s.x, VectorXd::Zero(right.nu.size()), VectorXd::Zero(right.lambda.size())};
  step.nu(equal_) = s.nu.head(Index(equal_.size())), step.lambda(strong_) = s.nu.tail(Index(strong_.size()));
  step.lambda(open_) = s.lambda;
  return step;
}

// Along `step`, in the units of the solve, `right` being what changes.
void QuadraticLayer::measure(const QuadraticSolution& right, QuadraticSolution& step) const {
  step.from = open_.empty() ? -HUGE_VAL : 0, step.to = HUGE_VAL;
  const auto limit = [&](double left, double rate) {
    if (rate < 0) step.to = std::min(step.to, left / -rate);
    if (rate > 0) step.from = std::max(step.from, -left / rate);
  };
  std::vector<bool> is_held(std::size_t(program_.h.size()), false);
  for (Index j : held_.kept) is_held[std::size_t(j)] = true;
  for (std::size_t j : weak_) is_held[j] = true;
  for (Index j : strong_) limit(std::max(0.0, solution_.lambda[j] * of_G_[j]), step.lambda[j]);
  const VectorXd x = solution_.x.cwiseProduct(roots_);
  for (Index j = 0; j < program_.h.size(); ++j) {
    if (is_held[std::size_t(j)] || program_.h[j] == HUGE_VAL) continue;
    limit(std::max(0.0, scaled_.h[j] - scaled_.G.row(j).dot(x)),
          right.lambda[j] - scaled_.G.row(j).dot(step.x));
  }
}

QuadraticSolution QuadraticLayer::forward(const QuadraticProgram& change) const {
  const QuadraticProgram& p = program_;
  const QuadraticSolution& s = solution_;
  const MatrixXd Q = or_zero("a change of Q", change.Q, p.Q), A = or_zero("a change of A", change.A, p.A),
                 G = or_zero("a change of G", change.G, p.G);
  const VectorXd q = or_zero("a change of q", change.q, p.q), b = or_zero("a change of b", change.b, p.b),
                 h = or_zero("a change of h", change.h, p.h);
  if (!has_derivatives()) return none();
  const VectorXd rest = (Q + Q.transpose()) / 2 * s.x + q + A.transpose() * s.nu + G.transpose() * s.lambda;
  const double of_x = s.x.norm(), of_nu = s.nu.norm(), of_lambda = s.lambda.norm();
  const VectorXd sizes = Q.rowwise().norm() * of_x + q.cwiseAbs() + A.colwise().norm().transpose() * of_nu +
                         G.colwise().norm().transpose() * of_lambda;
  const QuadraticSolution right{
      -without_rounding(rest, sizes).cwiseQuotient(roots_),
      without_rounding(b - A * s.x, b.cwiseAbs() + A.rowwise().norm() * of_x).cwiseQuotient(of_A_),
      without_rounding(h - G * s.x, h.cwiseAbs() + G.rowwise().norm() * of_x).cwiseQuotient(of_G_)};
  QuadraticSolution step =
      status_ == SensitivityStatus::kWeaklyActive ? one_sided(right) : solve(held_, right);
  measure(right, step);
  return unscaled(step);
}

QuadraticProgram QuadraticLayer::backward(const VectorXd& slope, WeakRows weak) const {
  const QuadraticProgram& p = program_;
  check_shape("the slope", slope, p.q.size(), 1);
  const QuadraticSolution& s = solution_;
  QuadraticSolution k = none();
  if (has_derivatives()) {
    k = unscaled(
        solve(weak == WeakRows::kHeld ? all_held_ : held_,
              {slope.cwiseQuotient(roots_), VectorXd::Zero(p.b.size()), VectorXd::Zero(p.h.size())}));
  }
  const MatrixXd square = k.x * s.x.transpose();
  return {.Q = -(square + square.transpose()) / 2,
          .q = -k.x,
          .A = -(s.nu * k.x.transpose() + k.nu * s.x.transpose()),
          .b = k.nu,
          .G = -(s.lambda * k.x.transpose() + k.lambda * s.x.transpose()),
          .h = k.lambda};
}

}  // namespace dyntape
