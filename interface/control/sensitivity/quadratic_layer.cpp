// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/sensitivity/quadratic_layer.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/riccati/interior_point.h>

namespace dyntape {

namespace {

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

class QuadraticNlp : public Nlp {
 public:
  explicit QuadraticNlp(const QuadraticProgram& p)
      : p_(p), roots_(roots_of(p.Q)), is_curved_(p.Q.diagonal().maxCoeff() > 0) {
    const auto n = std::size_t(p.q.size()), of_A = std::size_t(p.b.size()), of_G = std::size_t(p.h.size());
    shape_.x_lower.assign(n, -HUGE_VAL), shape_.x_upper.assign(n, HUGE_VAL);
    shape_.g_lower.assign(p.b.begin(), p.b.end()), shape_.g_upper = shape_.g_lower;
    shape_.g_lower.insert(shape_.g_lower.end(), of_G, -HUGE_VAL);
    shape_.g_upper.insert(shape_.g_upper.end(), p.h.begin(), p.h.end());
    rows_.resize(p.A.rows() + p.G.rows(), p.q.size());
    rows_ << p.A, p.G;
    std::vector<std::vector<std::uint32_t>> all(of_A + of_G), lower(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (auto& row : all) row.push_back(std::uint32_t(i));
      for (std::size_t j = 0; j <= i; ++j) lower[i].push_back(std::uint32_t(j));
    }
    shape_.jacobian = pattern_from_rows(all, n), shape_.hessian = pattern_from_rows(lower, n);
  }

  const NlpShape& shape() const override { return shape_; }
  bool objective(const double* x, double& value) override {
    const auto at = vector(x);
    const VectorXd slope = p_.Q * at / 2 + p_.q;
    value = at.dot(slope);
    return std::isfinite(value);
  }
  bool gradient(const double* x, double* gradient) override {
    const VectorXd slope = p_.Q * vector(x);
    VectorXd::Map(gradient, p_.q.size()) = slope + p_.q;
    return true;
  }
  bool constraints(const double* x, double* g) override {
    VectorXd::Map(g, rows_.rows()) = rows_ * vector(x);
    return true;
  }
  bool jacobian(const double*, double* nonzeros) override {
    for (Eigen::Index j = 0; j < rows_.rows(); ++j)
      for (Eigen::Index i = 0; i < rows_.cols(); ++i) *nonzeros++ = rows_(j, i);
    return true;
  }
  bool hessian(const double*, double sigma, const double*, double* nonzeros) override {
    for (Eigen::Index i = 0; i < rows_.cols(); ++i)
      for (Eigen::Index j = 0; j <= i; ++j) *nonzeros++ = sigma * p_.Q(i, j);
    return true;
  }

  // y = roots x, in which Q has a diagonal of ones.  How large it is: at first as far as the cost draws it and the
  // constraints let it or push it; later as it was found.
  NlpScaling scaling(const std::vector<double>& at, const NlpScaling& before) override {
    const double drawn = p_.q.cwiseQuotient(roots_).cwiseAbs().maxCoeff();
    const VectorXd norms = (rows_ * roots_.cwiseInverse().asDiagonal()).rowwise().norm();
    double size = before.x.empty() ? first_size(drawn, norms)
                                   : vector(at.data()).cwiseProduct(roots_).cwiseAbs().maxCoeff();
    if (!(size > 0)) size = before.x.empty() ? 1 : before.x[0] * roots_[0];
    NlpScaling m;
    m.objective = size * std::max(is_curved_ ? size : 0, drawn);
    if (!(m.objective > 0)) m.objective = 1;
    for (double root : roots_) m.x.push_back(size / root);
    for (double norm : norms) m.g.push_back(norm > 0 ? norm * size : 1);
    return m;
  }
  std::string constraint_name(std::size_t j) const override {
    const auto of_A = std::size_t(p_.b.size());
    return j < of_A ? "A x = b, row " + std::to_string(j) : "G x <= h, row " + std::to_string(j - of_A);
  }

 private:
  Eigen::Map<const VectorXd> vector(const double* x) const { return {x, p_.q.size()}; }
  double first_size(double drawn, const VectorXd& norms) const {
    double forced = 0, room = 0;
    for (Eigen::Index j = 0; j < norms.size(); ++j) {
      if (!(norms[j] > 0)) continue;
      const bool is_equal = j < p_.b.size();
      const double bound = is_equal ? p_.b[j] : p_.h[j - p_.b.size()];
      if (is_equal || bound < 0) forced = std::max(forced, std::abs(bound) / norms[j]);
      if (!is_equal && std::isfinite(bound)) room = std::max(room, bound / norms[j]);
    }
    const bool is_held = room > 0 && (drawn <= 0 || !is_curved_ || room < drawn);
    return std::max(is_held ? room : is_curved_ ? drawn : 0, forced);
  }

  const QuadraticProgram& p_;
  VectorXd roots_;
  bool is_curved_;
  MatrixXd rows_;
  NlpShape shape_;
};

MatrixXd or_zero(const char* name, const MatrixXd& change, const MatrixXd& like) {
  if (change.size() == 0) return MatrixXd::Zero(like.rows(), like.cols());
  check_shape(name, change, like.rows(), like.cols());
  return change;
}

// Orthonormal columns, whose span is what M maps to zero.
MatrixXd kernel_of(const MatrixXd& M) {
  Eigen::ColPivHouseholderQR<MatrixXd> qr(M.transpose());
  qr.setThreshold(kMostAsymmetry);
  const MatrixXd all = qr.householderQ();
  return all.rightCols(all.cols() - qr.rank());
}

// Of the cone C w <= 0 the point w = -c - C^T u that is nearest to -c, zero where c draws nothing along it: u >= 0 makes it least,
// which rows of C count being found one after another.
// C. L. Lawson, R. J. Hanson, Solving Least Squares Problems, 1974, chapter 23.
VectorXd nearest_in_cone(const VectorXd& c, const MatrixXd& C) {
  std::vector<Eigen::Index> rows;
  VectorXd u = VectorXd::Zero(C.rows()), w = -c;
  for (Eigen::Index step = 0; step < 10 * C.rows(); ++step) {
    VectorXd beyond = C * w;
    for (Eigen::Index j : rows) beyond[j] = 0;
    Eigen::Index most = 0;
    if (!(beyond.maxCoeff(&most) > 1e-13 * c.norm())) break;
    rows.push_back(most);
    while (!rows.empty()) {
      const VectorXd next = C(rows, Eigen::all).transpose().colPivHouseholderQr().solve(-c);
      double share = 1;  // of the way there that all stay above zero
      for (std::size_t k = 0; k < rows.size(); ++k) {
        if (next[Eigen::Index(k)] <= 0)
          share = std::min(share, u[rows[k]] / (u[rows[k]] - next[Eigen::Index(k)]));
      }
      for (std::size_t k = 0; k < rows.size(); ++k)
        u[rows[k]] += share * (next[Eigen::Index(k)] - u[rows[k]]);
      if (next.minCoeff() > 0) break;
      std::erase_if(rows, [&](Eigen::Index j) {
        const bool leaves = u[j] <= 1e-14 * u.maxCoeff();
        if (leaves) u[j] = 0;
        return leaves;
      });
    }
    w = -c - C.transpose() * u;
  }
  return w;
}

}  // namespace

QuadraticLayer::QuadraticLayer(const QuadraticProgram& program, double tolerance)
    : program_(checked(program)) {
  QuadraticNlp nlp(program_);
  const NlpSolution s =
      solve_with_riccati(nlp, std::vector<double>(nlp.shape().n(), 0.0), {.tolerance = tolerance});
  solve_status_ = s.status;
  slopes_.emplace(nlp, s);
  const auto vector = [](const std::vector<double>& v) {
    return VectorXd::Map(v.data(), Eigen::Index(v.size()));
  };
  solution_ = split({.x = vector(s.x), .lambda = vector(s.lambda), .bound_multiplier = {}});
  if (solve_status_ != SolveStatus::kSolved && status() > SensitivityStatus::kDependentRows) certify();
  if (status() > SensitivityStatus::kDependentRows) return;
  const SolutionStep& c = slopes_->correction();
  solution_ = split({.x = vector(s.x) + c.x, .lambda = vector(s.lambda) + c.lambda, .bound_multiplier = {}});
  solution_.lambda = solution_.lambda.cwiseMax(0);
}

// In variables in which Q has a diagonal of ones, of rows of length one, without those that any x fulfils.
void QuadraticLayer::certify() {
  constexpr double kMargin = 1e-6, kMostOff = 1e-8;  // of the length of what proves
  const QuadraticProgram& p = program_;
  const VectorXd inverse = roots_of(p.Q).cwiseInverse();
  const Eigen::Index of_A = p.b.size(), m = of_A + p.h.size();
  MatrixXd rows(m, p.q.size());
  VectorXd sides(m), lengths(m);
  rows << p.A * inverse.asDiagonal(), p.G * inverse.asDiagonal();
  sides << p.b, p.h;
  for (Eigen::Index j = 0; j < m; ++j) {
    if (sides[j] == HUGE_VAL) rows.row(j).setZero(), sides[j] = 0;
    const double length = rows.row(j).norm();
    lengths[j] = length > 0 ? length : 1;
    rows.row(j) /= lengths[j], sides[j] /= lengths[j];
  }
  outcome_ = QpStatus::kUnknown;
  const auto most = [](const VectorXd& v) { return v.size() ? v.cwiseAbs().maxCoeff() : 0.0; };

  const MatrixXd balanced = kernel_of(rows.transpose());
  if (balanced.cols() > 0 && most(sides) > 0) {
    const VectorXd scaled = sides / most(sides);
    VectorXd y = balanced * nearest_in_cone(balanced.transpose() * scaled, -balanced.bottomRows(m - of_A));
    y.tail(m - of_A) = y.tail(m - of_A).cwiseMax(0);
    if (scaled.dot(y) < -kMargin * y.norm() && (rows.transpose() * y).norm() <= kMostOff * y.norm()) {
      const VectorXd bound_multipliers = (y / -sides.dot(y)).cwiseQuotient(lengths);
      certificate_.nu = bound_multipliers.head(of_A), certificate_.lambda = bound_multipliers.tail(m - of_A);
      outcome_ = QpStatus::kInfeasible;
      why_ = "no x fulfils the constraints: weighed with certificate() they add up to 0 <= -1";
      return;
    }
  }

  MatrixXd flat(p.q.size() + of_A, p.q.size());
  flat << inverse.asDiagonal() * p.Q * inverse.asDiagonal(), rows.topRows(of_A);
  const MatrixXd directions = kernel_of(flat);
  VectorXd slope = inverse.cwiseProduct(p.q);
  if (directions.cols() == 0 || slope.isZero(0)) return;
  slope /= most(slope);
  const MatrixXd G = rows.bottomRows(m - of_A);
  const VectorXd d = directions * nearest_in_cone(directions.transpose() * slope, G * directions);
  const VectorXd beyond = VectorXd(G * d).cwiseMax(0);
  if (!(slope.dot(d) < -kMargin * d.norm()) || beyond.norm() > kMostOff * d.norm()) return;
  certificate_.x = inverse.cwiseProduct(d);
  certificate_.x /= -p.q.dot(certificate_.x);
  outcome_ = QpStatus::kUnbounded;
  why_ = "the cost falls without end along certificate().x";
}

QuadraticSolution QuadraticLayer::split(const SolutionStep& step) const {
  return {step.x, step.lambda.head(program_.b.size()), step.lambda.tail(program_.h.size()), step.from,
          step.to};
}

std::vector<std::size_t> QuadraticLayer::weak() const {
  std::vector<std::size_t> rows = slopes_->weak_rows();
  for (std::size_t& row : rows) row -= std::size_t(program_.b.size());
  return rows;
}

QuadraticSolution QuadraticLayer::forward(const QuadraticProgram& change) {
  const QuadraticProgram& p = program_;
  const QuadraticSolution& s = solution_;
  const MatrixXd Q = or_zero("a change of Q", change.Q, p.Q), A = or_zero("a change of A", change.A, p.A),
                 G = or_zero("a change of G", change.G, p.G);
  const VectorXd q = or_zero("a change of q", change.q, p.q), b = or_zero("a change of b", change.b, p.b),
                 h = or_zero("a change of h", change.h, p.h);
  VectorXd rows(p.b.size() + p.h.size());
  rows << b - A * s.x, h - G * s.x;
  const VectorXd curved = (Q + Q.transpose()) / 2 * s.x, equal = A.transpose() * s.nu,
                 kept = G.transpose() * s.lambda;
  const VectorXd derivatives = -(curved + q + equal + kept);
  return split(slopes_->solve(derivatives, rows));
}

QuadraticProgram QuadraticLayer::backward(const VectorXd& slope) {
  check_shape("the slope", slope, program_.q.size(), 1);
  const QuadraticSolution& s = solution_;
  const QuadraticSolution k =
      split(slopes_->solve(slope, VectorXd::Zero(program_.b.size() + program_.h.size())));
  const MatrixXd square = k.x * s.x.transpose();
  return {.Q = -(square + square.transpose()) / 2,
          .q = -k.x,
          .A = -(s.nu * k.x.transpose() + k.nu * s.x.transpose()),
          .b = k.nu,
          .G = -(s.lambda * k.x.transpose() + k.lambda * s.x.transpose()),
          .h = k.lambda};
}

}  // namespace dyntape
