// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/sensitivity/quadratic_findings.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/factorisations.h>
#include <dyntape/interface/control/sensitivity/nearest_point.h>

namespace dyntape {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kDependent = 1e-10;   // of a row: what the rows before leave of one that depends on them
constexpr double kFlatOfUnit = 1e-10;  // of Q, whose diagonal is one: no curvature
constexpr double kActive =
    1e-9;  // of the numbers that a row adds up: the row is active; of the gradient: no multiplier
constexpr double kNear = 1e-6;               // likewise: the row may be active
constexpr double kRoundingOfSearch = 1e-13;  // of how far the search went
constexpr double kDescent =
    1e-8;  // of the gradient along directions without curvature: what counts as descent

double norm_or_zero(const VectorXd& v) { return v.size() ? v.norm() : 0; }

// Orthonormal columns, whose span is what M maps to zero.
MatrixXd kernel_of(const MatrixXd& M) {
  if (M.size() == 0) return MatrixXd::Identity(M.cols(), M.cols());
  return orthonormal_basis(M.transpose(), kDependent).complement();
}

// Of rows of length one and orthonormal directions: rows that are rounding become zero.
MatrixXd without_rounding(MatrixXd product) {
  for (Index j = 0; j < product.rows(); ++j) {
    if (!(product.row(j).norm() > kDependent)) product.row(j).setZero();
  }
  return product;
}

NearestPoint nearest_in_cone(const VectorXd& z0, const MatrixXd& rows) {
  const VectorXd zero = VectorXd::Zero(rows.rows());
  return nearest_point(z0, without_rounding(rows), zero, zero);
}

// Curvature H = V diag(e) V^T of a subspace, and which part of it is flat.
struct Curvature {
  explicit Curvature(const MatrixXd& H, double most) : V(MatrixXd::Zero(H.rows(), H.cols())), e(H.rows()) {
    if (H.rows() == 0) return;
    SymmetricEigen eigen = symmetric_eigen(H);
    V = std::move(eigen.vectors), e = std::move(eigen.values);
    while (flat < e.size() && e[flat] <= kFlatOfUnit * most) ++flat;
  }
  auto flat_directions() const { return V.leftCols(flat); }
  // J with J J^T the inverse of H, to which `more` is added where it is flat.
  MatrixXd inverse_root(double more) const {
    VectorXd scale = e;
    scale.head(flat).setConstant(more);
    return V * scale.cwiseSqrt().cwiseInverse().asDiagonal();
  }

  MatrixXd matrix() const {
    VectorXd own = e;
    own.head(flat).setZero();
    return V * own.asDiagonal() * V.transpose();
  }

  MatrixXd V;
  VectorXd e;
  Index flat = 0;
};

// Keeps orthonormal directions of rows, and takes in rows that do not depend on those before.
class RowSpan {
 public:
  explicit RowSpan(Index n) : directions_(n, 0) {}
  bool take(VectorXd row) {
    const double length = row.norm();
    for (int again = 0; again < 2; ++again) row -= directions_ * (directions_.transpose() * row);
    if (!(row.norm() > kDependent * length)) return false;
    directions_.conservativeResize(Eigen::NoChange, directions_.cols() + 1);
    directions_.rightCols(1) = row.normalized();
    return true;
  }

 private:
  MatrixXd directions_;
};

class QuadraticSearch {
 public:
  explicit QuadraticSearch(const QuadraticProgram& p) : p_(p), n_(p_.q.size()) {}

  QuadraticFindings run() && {
    found_.why = "no proof of a solution, of none, or of descent without end was found to rounding";
    look();
    return std::move(found_);
  }

 private:
  void look() {
    if (!meet_equalities()) return;
    most_ = p_.Q.cwiseAbs().maxCoeff();
    const Curvature curvature(Z_.transpose() * p_.Q * Z_, most_);
    f_ = Z_.transpose() * (p_.Q * at_ + p_.q), C_ = without_rounding(p_.G * Z_), d_ = p_.h - p_.G * at_;
    off_ = kRoundingOfSearch * (p_.h.cwiseAbs().array() + at_.norm());
    if (!minimise(curvature)) return;
    struct Polished {
      double off;
      VectorXd w, u;
    };
    std::vector<Polished> polished;
    const VectorXd w = w_, u = u_;
    for (const std::vector<Index>& rows : {nearly_active(), held_}) {
      w_ = w, u_ = u;
      polish(curvature.matrix(), rows);
      polished.push_back({distance_from_conditions(), w_, u_});
    }
    if (polished[1].off < polished[0].off) std::swap(polished[0], polished[1]);
    for (Polished& one : polished) {
      w_ = std::move(one.w), u_ = std::move(one.u);
      if (fulfils_conditions()) return classify();
    }
  }

  double distance_from_conditions() const {
    const VectorXd x = at_ + Z_ * w_, rest = p_.Q * x + p_.q + p_.G.transpose() * u_;
    const double beyond = std::max(0.0, most_of(p_.G * x - p_.h));
    return std::hypot((Z_.transpose() * rest).norm(), most_ * beyond);
  }

  // A point where A x = b, or multipliers that prove that there is none.
  bool meet_equalities() {
    at_ = p_.b.size() ? least_norm_solution(p_.A, p_.b, kDependent) : VectorXd::Zero(n_);
    Z_ = kernel_of(p_.A);
    const VectorXd missed = p_.b - p_.A * at_;
    if (!(norm_or_zero(missed) > kActive * norm_or_zero(p_.b))) return true;
    return prove_infeasible(-missed, VectorXd::Zero(p_.h.size()));
  }

  // nu with A^T nu = -of, as far as there is one.
  VectorXd equality_multipliers(const VectorXd& of) const {
    if (p_.b.size() == 0) return VectorXd::Zero(0);
    return least_norm_solution(p_.A.transpose(), -of, kDependent);
  }

  bool prove_infeasible(const VectorXd& nu, const VectorXd& lambda) {
    const double sum = p_.b.dot(nu) + p_.h.dot(lambda);
    const double length = std::hypot(norm_or_zero(nu), norm_or_zero(lambda));
    const VectorXd left = p_.A.transpose() * nu + p_.G.transpose() * lambda;
    if (!(sum < 0) || !(left.norm() <= kActive * length)) return false;
    found_.outcome = QpStatus::kInfeasible;
    found_.certificate.nu = nu / -sum, found_.certificate.lambda = lambda / -sum;
    found_.why = "no x fulfils the constraints: weighed with certificate() they add up to 0 <= -1";
    return false;
  }

  // Proximal steps in the directions without curvature; one step where there are none.
  bool minimise(const Curvature& curvature) {
    const auto flat = curvature.flat_directions();
    const double gradient = norm_or_zero(p_.q) + most_ * at_.norm();
    VectorXd center = VectorXd::Zero(curvature.flat);
    double more = most_ > 0 ? most_ : std::max(norm_or_zero(f_), 1e-300);
    if (most_ > 0) travel_ = p_.q.norm() / most_;
    double before = 0;
    for (int step = 0; step < 60; ++step, more *= step < 7 ? 0.1 : 1) {
      const MatrixXd J = curvature.inverse_root(more);
      const VectorXd z0 = J.transpose() * (more * (flat * center) - f_);
      NearestPoint nearest = nearest_point(z0, C_ * J, d_, off_);
      if (nearest.is_empty)
        return prove_infeasible(equality_multipliers(p_.G.transpose() * nearest.ray), nearest.ray);
      if (!nearest.is_found) return false;
      w_ = J * nearest.z, u_ = std::move(nearest.multipliers), held_ = std::move(nearest.held);
      travel_ = std::max(travel_, norm_or_zero(J * z0));
      if (step == 0 && !is_bounded(flat, gradient)) return false;
      const VectorXd next = flat.transpose() * w_;
      const double move = norm_or_zero(next - center);
      if (more * move <= 1e-12 * (gradient + most_ * norm_or_zero(w_)) && move >= before / 2) return true;
      center = next, before = move;
    }
    return false;
  }

  // Projects the descent onto the directions in which nothing ends it.
  bool is_bounded(const MatrixXd& flat, double gradient) {
    const VectorXd slope = flat.transpose() * f_;
    if (!(norm_or_zero(slope) > kFlatOfUnit * gradient)) return true;
    const NearestPoint d = nearest_in_cone(-slope, C_ * flat);
    if (!d.is_found) return false;
    if (!(d.z.norm() > kDescent * slope.norm())) return true;
    const VectorXd direction = Z_ * (flat * d.z);
    if (most_of(p_.G * direction) > kActive * direction.norm()) return false;
    found_.outcome = QpStatus::kUnbounded;
    found_.solution = {.x = at_ + Z_ * w_, .nu = {}, .lambda = {}};
    found_.certificate.x = direction / -p_.q.dot(direction);
    found_.why = "the cost falls without end along certificate().x";
    return false;
  }
  static double most_of(const VectorXd& v) { return v.size() ? v.maxCoeff() : 0; }

  // Rows that the search holds and those that are near.  Some of these may be open all the same.
  std::vector<Index> nearly_active() const {
    std::vector<Index> near = held_;
    const VectorXd left = d_ - C_ * w_, x = at_ + Z_ * w_;
    for (Index j = 0; j < left.size(); ++j) {
      const bool is_near = left[j] <= kNear / kActive * nearly(j, x);
      if (is_near && std::find(held_.begin(), held_.end(), j) == held_.end()) near.push_back(j);
    }
    return near;
  }

  // Solves the first-order conditions as equations, with `rows` at equality.
  void polish(const MatrixXd& H, const std::vector<Index>& rows) {
    meet_conditions(H, rows);
    const MatrixXd C = C_(held_, Eigen::all);
    u_.setZero();
    if (held_.empty()) return;
    const VectorXd of_held = least_norm_solution(C.transpose(), -(H * w_ + f_), kDependent);
    u_(held_) = of_held;
  }

  void meet_conditions(const MatrixXd& H, const std::vector<Index>& rows) {
    const Index n = H.rows(), m = Index(rows.size());
    MatrixXd K = MatrixXd::Zero(n + m, n + m);
    const MatrixXd C = C_(rows, Eigen::all);
    K.topLeftCorner(n, n) = H, K.topRightCorner(n, m) = C.transpose(), K.bottomLeftCorner(m, n) = C;
    VectorXd s = stacked(w_, u_(rows)), right = stacked(-f_, d_(rows));
    if (s.size() == 0) return;
    const LeastNormSolver equations(K, kDependent);
    for (int again = 0; again < 2; ++again) s += equations.solve(right - K * s);
    const VectorXd off = right - K * s;
    if (off.norm() <= 1e-12 * (right.norm() + s.norm())) w_ = s.head(n);
  }

  bool fulfils_conditions() {
    const VectorXd x = at_ + Z_ * w_;
    gradient_ = p_.q.norm() + (p_.Q * x).norm() + 1e-3 * most_ * x.norm();
    if (u_.size() && u_.minCoeff() < -kActive * gradient_) return false;
    u_ = u_.cwiseMax(0);
    const VectorXd rest = p_.Q * x + p_.q + p_.G.transpose() * u_;
    const VectorXd nu = equality_multipliers(rest);
    if ((rest + p_.A.transpose() * nu).norm() > kActive * (gradient_ + norm_or_zero(u_))) return false;
    left_ = p_.h - p_.G * x;
    for (Index j = 0; j < left_.size(); ++j) {
      if (left_[j] < -nearly(j, x)) return false;
    }
    found_.outcome = QpStatus::kSolved, found_.status = SensitivityStatus::kGood, found_.why.clear();
    found_.solution = {.x = x, .nu = nu, .lambda = u_};
    x_ = x;
    return true;
  }
  double nearly(Index j, const VectorXd& x) const {
    return kActive * (std::abs(p_.h[j]) + x.norm()) + kRoundingOfSearch * travel_;
  }

  void classify() {
    RowSpan span(n_);
    bool depends = false;
    for (Index j = 0; j < p_.b.size(); ++j) {
      const bool is_new = span.take(p_.A.row(j).transpose());
      if (is_new) found_.equal.push_back(j);
      depends |= !is_new;
    }
    std::vector<Index> weak;
    for (Index j = 0; j < left_.size(); ++j) {
      if (!(left_[j] <= nearly(j, x_))) continue;
      if (!(u_[j] > kActive * gradient_)) {
        weak.push_back(j), found_.weak.push_back(std::size_t(j));
        continue;
      }
      const bool is_new = span.take(p_.G.row(j).transpose());
      if (is_new) found_.strong.push_back(j);
      depends |= !is_new;
    }
    for (Index j : weak) {
      const bool is_new = span.take(p_.G.row(j).transpose());
      if (is_new) found_.open.push_back(j);
      depends |= !is_new;
    }
    const MatrixXd T = kernel_of(stacked(p_.A, p_.G(found_.strong, Eigen::all)));
    const Curvature curvature(T.transpose() * p_.Q * T, most_);
    const bool needs_weak = curvature.flat > 0;
    if (needs_weak && !only_zero(p_.G(weak, Eigen::all) * (T * curvature.flat_directions())))
      return say(SensitivityStatus::kNoStrictMinimum,
                 "the minimum is not strict: other x have the same cost");
    found_.needs_open = needs_weak;
    if (depends)
      return say(SensitivityStatus::kDependentRows,
                 "the active rows depend on each other: their multipliers are not unique");
    if (!weak.empty())
      say(SensitivityStatus::kWeaklyActive,
          "row " + std::to_string(weak[0]) + " of G x <= h is active with multiplier zero" +
              (weak.size() > 1 ? ", and " + std::to_string(weak.size() - 1) + " more" : ""));
  }

  // Returns true if only zero fulfils B d <= 0: the rows add up to zero with positive weights, and leave no direction.
  static bool only_zero(const MatrixXd& all) {
    const MatrixXd B = without_rounding(all);
    if (kernel_of(B).cols() > 0) return false;
    const VectorXd sum = B.colwise().sum();
    const NearestPoint d = nearest_in_cone(-sum, B);
    return d.is_found && d.z.norm() <= kDescent * B.norm();
  }

  void say(SensitivityStatus status, std::string why) { found_.status = status, found_.why = std::move(why); }

  const QuadraticProgram& p_;
  Index n_;
  VectorXd at_, f_, d_, off_, w_, u_, left_, x_;
  MatrixXd Z_, C_;
  std::vector<Index> held_;
  QuadraticFindings found_;
  double most_ = 0, travel_ = 0, gradient_ = 0;
};

}  // namespace

QuadraticFindings quadratic_findings(const QuadraticProgram& p) { return QuadraticSearch(p).run(); }

}  // namespace dyntape
