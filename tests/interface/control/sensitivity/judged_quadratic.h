// SPDX-License-Identifier: BSD-3-Clause
//
// Judges a QuadraticLayer by exact rational arithmetic: outcome, proof, solution, status and derivatives.
//
//   QuadraticJudge judge(seed);                     // draws a small program of integers
//   const std::string complaint = judge.complaint();  // "": all is right
//   judge.status(), judge.outcome()                 // the exact ones
//
// The oracle shares nothing with the layer.  The simplex method with Bland's rule decides in fractions whether x >= 0 with M x = r
// exists; feasibility, descent without end, the first-order conditions of each set of active rows, and uniqueness are each such
// a question.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <dyntape/interface/control/sensitivity/quadratic_layer.h>

#include "fractions.h"

namespace dyntape::testing {

class QuadraticJudge {
 public:
  explicit QuadraticJudge(std::uint64_t seed) : engine_(seed) {
    draw();
    decide();
  }

  QpStatus outcome() const { return outcome_; }
  SensitivityStatus status() const { return status_; }

  std::string complaint() {
    const QuadraticLayer layer(in_doubles(p_));
    if (layer.outcome() != outcome_)
      return std::string("outcome \"") + to_string(layer.outcome()) + "\", expected \"" +
             to_string(outcome_) + "\"";
    if (outcome_ != QpStatus::kSolved) return of_proof(layer);
    const std::string off = of_solution(layer);
    if (!off.empty()) return off;
    if (layer.status() != status_)
      return std::string("status \"") + dyntape::to_string(layer.status()) + "\", expected \"" +
             dyntape::to_string(status_) + "\"";
    return of_derivatives(layer);
  }

 private:
  struct Program {
    FractionRows Q, A, G;
    Fractions q, b, h;
  };

  int number(int least, int most) { return least + int(engine_() % std::uint64_t(most - least + 1)); }
  Fractions row(std::size_t n, int most) {
    Fractions r(n);
    for (Fraction& entry : r) entry = number(-most, most);
    return r;
  }

  // Singular Q, rows twice, rows of both signs (an empty interior), corners with more rows than variables, rows without multiplier.
  void draw() {
    const auto n = std::size_t(number(1, 4));
    const int of_A = number(0, 4) < 3 ? 0 : number(1, 2), of_G = number(0, 5);
    FractionRows B;
    for (int i = number(0, int(n)); i > 0; --i) B.push_back(row(n, 2));
    p_.Q.assign(n, Fractions(n));
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        for (const Fractions& b : B) p_.Q[i][j] = p_.Q[i][j] + b[i] * b[j];
    const Fractions at = row(n, 2);
    const bool is_planned = number(0, 3) > 0;  // `at` is to be optimal; otherwise all is by chance
    p_.q = is_planned ? Fractions(n) : row(n, 2);
    for (std::size_t i = 0; is_planned && i < n; ++i) p_.q[i] = -dot(p_.Q[i], at);
    for (int k = 0; k < of_A + of_G; ++k) {
      const bool is_equality = k < of_A;
      FractionRows& rows = is_equality ? p_.A : p_.G;
      Fractions& sides = is_equality ? p_.b : p_.h;
      Fractions r = row(n, 2);
      if (!rows.empty() && number(0, 4) == 0) {  // the same again, in other units, or the other way round
        const int by = number(0, 2) == 0 ? -1 : number(1, 2);
        r = rows.back();
        for (Fraction& entry : r) entry = entry * by;
      }
      const Fraction slack = is_equality ? (number(0, 9) == 0 ? 1 : 0) : std::max(0, number(-3, 2));
      sides.push_back(is_planned || number(0, 1) ? dot(r, at) + slack : Fraction(number(-2, 2)));
      const int weight = is_equality ? number(-2, 2) : slack.sign() == 0 ? std::max(0, number(-2, 2)) : 0;
      for (std::size_t i = 0; is_planned && i < n; ++i) p_.q[i] = p_.q[i] - r[i] * weight;
      rows.push_back(r);
    }
    if (number(0, 9) == 0) p_.q = row(n, 2);
  }

  std::size_t n() const { return p_.q.size(); }
  std::size_t of_A() const { return p_.b.size(); }
  std::size_t of_G() const { return p_.h.size(); }

  // x free, slack >= 0.
  FractionSystem feasible(bool is_cone) const {
    std::vector<bool> is_free(n() + of_G(), true);
    for (std::size_t j = 0; j < of_G(); ++j) is_free[n() + j] = false;
    FractionSystem s(is_free);
    for (std::size_t i = 0; i < of_A(); ++i) s.row(wide(p_.A[i]), is_cone ? Fraction(0) : p_.b[i]);
    for (std::size_t j = 0; j < of_G(); ++j) {
      Fractions r = wide(p_.G[j]);
      r[n() + j] = 1;
      s.row(r, is_cone ? Fraction(0) : p_.h[j]);
    }
    return s;
  }
  Fractions wide(Fractions r) const {
    r.resize(n() + of_G());
    return r;
  }

  void decide() {
    status_ = SensitivityStatus::kNotASolution;
    if (!feasible(false).solution()) {
      outcome_ = QpStatus::kInfeasible;
      return;
    }
    FractionSystem descent = feasible(true);
    for (const Fractions& row : p_.Q) descent.row(wide(row), 0);
    descent.row(wide(p_.q), -1);
    if (descent.solution()) {
      outcome_ = QpStatus::kUnbounded;
      return;
    }
    outcome_ = QpStatus::kSolved;
    for (std::size_t set = 0; set < std::size_t(1) << of_G(); ++set)
      if (solves(set)) return classify();
    throw std::logic_error("neither bounded, nor unbounded");
  }

  // The first-order conditions with multipliers of these rows only: x, nu free; lambda or slack of each row >= 0.
  bool solves(std::size_t set) {
    std::vector<bool> is_free(n() + of_A() + of_G(), true);
    for (std::size_t j = 0; j < of_G(); ++j) is_free[n() + of_A() + j] = false;
    FractionSystem s(is_free);
    const std::size_t all = is_free.size();
    for (std::size_t i = 0; i < n(); ++i) {
      Fractions r = p_.Q[i];
      r.resize(all);
      for (std::size_t k = 0; k < of_A(); ++k) r[n() + k] = p_.A[k][i];
      for (std::size_t j = 0; j < of_G(); ++j)
        if (set >> j & 1) r[n() + of_A() + j] = p_.G[j][i];
      s.row(r, -p_.q[i]);
    }
    for (std::size_t k = 0; k < of_A() + of_G(); ++k) {
      const bool is_equality = k < of_A();
      Fractions r = is_equality ? p_.A[k] : p_.G[k - of_A()];
      r.resize(all);
      if (!is_equality && !(set >> (k - of_A()) & 1)) r[n() + k] = 1;
      s.row(r, is_equality ? p_.b[k] : p_.h[k - of_A()]);
    }
    const auto found = s.solution();
    if (!found) return false;
    const auto part = [&](std::size_t from, std::size_t count) {
      return Fractions(found->begin() + std::ptrdiff_t(from), found->begin() + std::ptrdiff_t(from + count));
    };
    x_ = part(0, n()), nu_ = part(n(), of_A()), lambda_ = part(n() + of_A(), of_G());
    for (std::size_t j = 0; j < of_G(); ++j)
      if (!(set >> j & 1)) lambda_[j] = 0;
    return true;
  }

  void classify() {
    FractionRows active = p_.A;
    for (std::size_t j = 0; j < of_G(); ++j) {
      const bool is_active = (p_.h[j] - dot(p_.G[j], x_)).sign() == 0;
      if (is_active) active.push_back(p_.G[j]);
      if (is_active && lambda_[j].sign() > 0) strong_.push_back(j);
      if (is_active && lambda_[j].sign() == 0) weak_.push_back(j);
    }
    const bool depends = rank_of(active) < active.size();
    status_ = !is_unique()     ? SensitivityStatus::kNoStrictMinimum
              : depends        ? SensitivityStatus::kDependentRows
              : !weak_.empty() ? SensitivityStatus::kWeaklyActive
                               : SensitivityStatus::kGood;
  }

  // Only zero moves along the critical cone without curvature.
  bool is_unique() const {
    std::vector<bool> is_free(n() + weak_.size(), true);
    for (std::size_t k = 0; k < weak_.size(); ++k) is_free[n() + k] = false;
    FractionSystem cone(is_free);
    const auto add = [&](const FractionRows& rows) {
      for (Fractions r : rows) r.resize(is_free.size()), cone.row(r, 0);
    };
    add(p_.Q), add(p_.A);
    for (std::size_t j : strong_) add({p_.G[j]});
    for (std::size_t k = 0; k < weak_.size(); ++k) {
      Fractions r = p_.G[weak_[k]];
      r.resize(is_free.size()), r[n() + k] = 1;
      cone.row(r, 0);
    }
    for (std::size_t i = 0; i < n(); ++i)
      for (int sign : {-1, 1}) {
        FractionSystem one = cone;
        Fractions r(is_free.size());
        r[i] = sign;
        one.row(r, 1);
        if (one.solution()) return false;
      }
    return true;
  }

  // [Q R^T; R 0] [dx; d multipliers] = right, R the equalities and the rows `held`.
  // None: the matrix is singular.
  std::optional<Fractions> derivatives(const std::vector<std::size_t>& held, const Fractions& right) const {
    FractionRows M = p_.Q, rows = p_.A;
    for (std::size_t j : held) rows.push_back(p_.G[j]);
    const std::size_t all = n() + rows.size();
    for (std::size_t i = 0; i < n(); ++i)
      for (const Fractions& r : rows) M[i].push_back(r[i]);
    for (const Fractions& r : rows) M.push_back(r), M.back().resize(all);
    Fractions s = right;
    for (std::size_t j = 0; j < all; ++j) {
      std::size_t p = j;
      while (p < all && M[p][j].sign() == 0) ++p;
      if (p == all) return std::nullopt;
      std::swap(M[p], M[j]), std::swap(s[p], s[j]);
      for (std::size_t i = 0; i < all; ++i) {
        if (i == j || M[i][j].sign() == 0) continue;
        const Fraction by = M[i][j] / M[j][j];
        for (std::size_t k = j; k < all; ++k) M[i][k] = M[i][k] - by * M[j][k];
        s[i] = s[i] - by * s[j];
      }
    }
    for (std::size_t j = 0; j < all; ++j) s[j] = s[j] / M[j][j];
    return s;
  }

  struct Change {
    Program by;
    Fractions gradient, of_A, of_G;  // the right side of the conditions
  };
  Change random_change() {
    Change c;
    c.by = {p_.Q, {}, {}, row(n(), 2), row(of_A(), 2), row(of_G(), 2)};
    for (std::size_t i = 0; i < n(); ++i)
      for (std::size_t j = 0; j <= i; ++j) c.by.Q[i][j] = c.by.Q[j][i] = number(-2, 2);
    for (std::size_t k = 0; k < of_A(); ++k) c.by.A.push_back(row(n(), 2));
    for (std::size_t k = 0; k < of_G(); ++k) c.by.G.push_back(row(n(), 2));
    for (std::size_t i = 0; i < n(); ++i) {
      Fraction sum = dot(c.by.Q[i], x_) + c.by.q[i];
      for (std::size_t k = 0; k < of_A(); ++k) sum = sum + c.by.A[k][i] * nu_[k];
      for (std::size_t k = 0; k < of_G(); ++k) sum = sum + c.by.G[k][i] * lambda_[k];
      c.gradient.push_back(-sum);
    }
    for (std::size_t k = 0; k < of_A(); ++k) c.of_A.push_back(c.by.b[k] - dot(c.by.A[k], x_));
    for (std::size_t k = 0; k < of_G(); ++k) c.of_G.push_back(c.by.h[k] - dot(c.by.G[k], x_));
    return c;
  }
  std::optional<Fractions> along(const Change& c, const std::vector<std::size_t>& held) const {
    Fractions right = c.gradient;
    right.insert(right.end(), c.of_A.begin(), c.of_A.end());
    for (std::size_t j : held) right.push_back(c.of_G[j]);
    return derivatives(held, right);
  }

  // Of all sets of weak rows the one whose multipliers grow and whose others stay within their bounds: dx is unique.
  Fractions one_sided(const Change& c) const {
    for (std::size_t set = 0; set < std::size_t(1) << weak_.size(); ++set) {
      std::vector<std::size_t> held = strong_;
      for (std::size_t k = 0; k < weak_.size(); ++k)
        if (set >> k & 1) held.push_back(weak_[k]);
      const auto found = along(c, held);
      if (!found) continue;
      const Fractions& s = *found;
      const Fractions dx(s.begin(), s.begin() + std::ptrdiff_t(n()));
      bool fits = true;
      for (std::size_t k = 0, at = n() + of_A() + strong_.size(); k < weak_.size(); ++k) {
        if (set >> k & 1)
          fits = fits && s[at++].sign() >= 0;
        else
          fits = fits && (c.of_G[weak_[k]] - dot(p_.G[weak_[k]], dx)).sign() >= 0;
      }
      if (fits) return dx;
    }
    throw std::logic_error("no one-sided derivative");
  }

  static Eigen::VectorXd in_doubles(const Fractions& v) {
    Eigen::VectorXd d(Eigen::Index(v.size()));
    for (std::size_t i = 0; i < v.size(); ++i) d[Eigen::Index(i)] = v[i].value();
    return d;
  }
  Eigen::MatrixXd in_doubles(const FractionRows& rows) const {
    Eigen::MatrixXd M(Eigen::Index(rows.size()), Eigen::Index(n()));
    for (std::size_t i = 0; i < rows.size(); ++i) M.row(Eigen::Index(i)) = in_doubles(rows[i]).transpose();
    return M;
  }
  QuadraticProgram in_doubles(const Program& p) const {
    return {in_doubles(p.Q), in_doubles(p.q), in_doubles(p.A),
            in_doubles(p.b), in_doubles(p.G), in_doubles(p.h)};
  }

  static double off(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    return a.size() ? (a - b).norm() / (1 + b.norm()) : 0;
  }
  static double least(const Eigen::VectorXd& v) { return v.size() ? v.minCoeff() : 0; }

  std::string of_proof(const QuadraticLayer& layer) const {
    const QuadraticProgram p = in_doubles(p_);
    const QuadraticSolution& c = layer.certificate();
    constexpr double kNear = 1e-9;
    if (layer.status() != SensitivityStatus::kNotASolution) return "derivatives without a solution";
    const QuadraticProgram gradient = layer.backward(Eigen::VectorXd::Ones(p.q.size()));
    const bool is_none = gradient.Q.array().isNaN().all() && gradient.q.array().isNaN().all() &&
                         gradient.G.array().isNaN().all() && std::isnan(layer.forward({}).x[0]);
    if (!is_none) return "derivatives without a solution";
    if (outcome_ == QpStatus::kInfeasible) {
      const double size = 1 + c.nu.norm() + c.lambda.norm();
      const bool holds = c.lambda.size() == p.h.size() && least(c.lambda) >= 0 &&
                         (p.A.transpose() * c.nu + p.G.transpose() * c.lambda).norm() < kNear * size &&
                         std::abs(p.b.dot(c.nu) + p.h.dot(c.lambda) + 1) < kNear;
      return holds ? "" : "the proof of infeasibility does not hold";
    }
    const Eigen::VectorXd& x = layer.solution().x;
    const double size = 1 + c.x.norm();
    const bool holds = (p.Q * c.x).norm() < kNear * size && (p.A * c.x).norm() < kNear * size &&
                       least(-p.G * c.x) > -kNear * size && std::abs(p.q.dot(c.x) + 1) < kNear &&
                       (p.A * x - p.b).norm() < kNear * (1 + x.norm()) &&
                       least(p.h - p.G * x) > -kNear * (1 + x.norm());
    return holds ? "" : "the proof of descent does not hold";
  }

  std::string of_solution(const QuadraticLayer& layer) const {
    const QuadraticProgram p = in_doubles(p_);
    const QuadraticSolution& s = layer.solution();
    constexpr double kNear = 1e-9;
    const Eigen::VectorXd slack = p.h - p.G * s.x;
    const double size = 1 + s.x.norm() + s.lambda.norm() + s.nu.norm();
    if (!((p.Q * s.x + p.q + p.A.transpose() * s.nu + p.G.transpose() * s.lambda).norm() < kNear * size) ||
        !((p.A * s.x - p.b).norm() < kNear * size) || !(least(slack) > -kNear * size) ||
        least(s.lambda) < 0 || std::abs(slack.dot(s.lambda)) > kNear * size * size)
      return "the first-order conditions do not hold";
    const bool is_strict = status_ < SensitivityStatus::kNoStrictMinimum;
    if (is_strict && off(s.x, in_doubles(x_)) > kNear) return "x is not the solution";
    if (status_ < SensitivityStatus::kDependentRows &&
        (off(s.lambda, in_doubles(lambda_)) > kNear || off(s.nu, in_doubles(nu_)) > kNear))
      return "the multipliers are not right";
    if (status_ < SensitivityStatus::kDependentRows && layer.weak() != weak_)
      return "weak rows are not those";
    return "";
  }

  static double dot(const QuadraticProgram& a, const QuadraticProgram& b) {
    return a.Q.cwiseProduct(b.Q).sum() + a.q.dot(b.q) + a.A.cwiseProduct(b.A).sum() + a.b.dot(b.b) +
           a.G.cwiseProduct(b.G).sum() + a.h.dot(b.h);
  }
  static Fraction dot(const Fractions& a, const Fractions& b) { return testing::dot(a, b); }

  std::string of_derivatives(const QuadraticLayer& layer) {
    constexpr double kNear = 1e-8;
    const Change c = random_change();
    const QuadraticProgram change = in_doubles(c.by);
    const Eigen::VectorXd slope = in_doubles(row(n(), 2)), dx = layer.forward(change).x;
    const QuadraticProgram open = layer.backward(slope), held = layer.backward(slope, WeakRows::kHeld);
    if (status_ == SensitivityStatus::kNoStrictMinimum)
      return std::isnan(dx[0]) && std::isnan(open.q[0]) ? "" : "derivatives of a minimum that is not strict";
    if (status_ == SensitivityStatus::kDependentRows)
      return dx.allFinite() && open.Q.allFinite() && open.G.allFinite() ? ""
                                                                        : "derivatives that are not finite";
    // With curvature only where weak rows leave room, the step to a side need not be unique.
    const bool may_be_none = !along(c, strong_) && std::isnan(dx[0]);
    if (!may_be_none && !(off(dx, in_doubles(one_sided(c))) <= kNear))
      return "forward() is not the derivative";
    std::vector<std::size_t> all = strong_;
    all.insert(all.end(), weak_.begin(), weak_.end());
    const auto complaint = [&](const QuadraticProgram& gradient, const std::vector<std::size_t>& rows) {
      const auto exact_dx = along(c, rows).value_or(*along(c, all));
      const double exact = slope.dot(in_doubles(exact_dx).head(Eigen::Index(n())));
      return std::abs(dot(gradient, change) - exact) > kNear * (1 + std::abs(exact));
    };
    return complaint(open, strong_) || complaint(held, all) ? "backward() is not the derivative" : "";
  }

  std::mt19937_64 engine_;
  Program p_;
  Fractions x_, nu_, lambda_;
  std::vector<std::size_t> strong_, weak_;
  QpStatus outcome_ = QpStatus::kUnknown;
  SensitivityStatus status_ = SensitivityStatus::kNotASolution;
};

}  // namespace dyntape::testing
