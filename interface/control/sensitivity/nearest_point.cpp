// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/sensitivity/nearest_point.h>

#include <Eigen/Jacobi>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace dyntape {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLeftOfRow =
    1e-10;  // of a row of length one: what the held rows leave of a row that depends on them
constexpr double kImplied =
    1e-9;  // of the numbers that a row adds up: held rows imply the row, as far as rounding lets them
constexpr double kViolated = 1e-13;  // of the numbers that a row adds up

// Held rows as columns of Q [R; 0]: Q is orthogonal, R is triangular.
class HeldRows {
 public:
  explicit HeldRows(Index n) : Q_(MatrixXd::Identity(n, n)), R_(MatrixXd::Zero(n, n)) {}
  Index count() const { return count_; }
  VectorXd turned(const VectorXd& row) const { return Q_.transpose() * row; }
  // What the rows leave of a row, given as turned().
  VectorXd left(const VectorXd& turned) const {
    return Q_.rightCols(Q_.cols() - count_) * turned.tail(Q_.cols() - count_);
  }
  VectorXd weights(const VectorXd& turned) const {
    return R_.topLeftCorner(count_, count_).triangularView<Eigen::Upper>().solve(turned.head(count_));
  }
  void add(VectorXd turned) {
    for (Index i = Q_.cols() - 1; i > count_; --i) {
      Eigen::JacobiRotation<double> rotation;
      rotation.makeGivens(turned[i - 1], turned[i], &turned[i - 1]);
      turned[i] = 0;
      Q_.applyOnTheRight(i - 1, i, rotation);
    }
    R_.col(count_++) = turned;
  }
  void remove(Index k) {
    for (Index j = k; j + 1 < count_; ++j) R_.col(j) = R_.col(j + 1);
    R_.col(--count_).setZero();
    for (Index j = k; j < count_; ++j) {
      Eigen::JacobiRotation<double> rotation;
      rotation.makeGivens(R_(j, j), R_(j + 1, j));
      R_.applyOnTheLeft(j, j + 1, rotation.adjoint());
      R_(j + 1, j) = 0;
      Q_.applyOnTheRight(j, j + 1, rotation);
    }
  }

 private:
  MatrixXd Q_, R_;
  Index count_ = 0;
};

class NearestPointSearch {
 public:
  NearestPointSearch(const VectorXd& z0, const MatrixXd& B, const VectorXd& d, const VectorXd& off)
      : B_(B),
        d_(d),
        off_(off),
        lengths_(B.rowwise().norm()),
        start_(z0.norm()),
        is_implied_(std::size_t(B.rows()), false),
        held_(z0.size()) {
    for (Index j = 0; j < B_.rows(); ++j) {
      if (!(lengths_[j] > 0)) lengths_[j] = 1;
      B_.row(j) /= lengths_[j], d_[j] /= lengths_[j], off_[j] /= lengths_[j];
    }
    p_.z = z0, p_.multipliers.setZero(B.rows());
  }

  NearestPoint run() {
    const Index most = 100 + 20 * (B_.rows() + p_.z.size());
    for (Index step = 0; step < most && !p_.is_found && !p_.is_empty; ++step) {
      const Index row = most_violated();
      if (row < 0)
        p_.is_found = true;
      else if (!take_in(row, most))
        break;
    }
    p_.multipliers = p_.multipliers.cwiseQuotient(lengths_);
    return std::move(p_);
  }

 private:
  double beyond(Index j) const { return B_.row(j).dot(p_.z) - d_[j]; }

  Index most_violated() const {
    Index row = -1;
    double most = 1;
    const double size = p_.z.norm() + start_;
    for (Index j = 0; j < B_.rows(); ++j) {
      if (is_held(j) || is_implied_[std::size_t(j)]) continue;
      const double share = beyond(j) / (kViolated * (size + std::abs(d_[j])) + off_[j] + 1e-300);
      if (share > most) row = j, most = share;
    }
    return row;
  }
  bool is_held(Index j) const { return std::find(p_.held.begin(), p_.held.end(), j) != p_.held.end(); }

  // Moves to where the row holds, and lets go of held rows whose multiplier becomes zero on the way.
  bool take_in(Index row, Index most) {
    for (Index step = 0; step < most; ++step) {
      const VectorXd turned = held_.turned(B_.row(row).transpose());
      const VectorXd weights = held_.weights(turned);
      const double rate = turned.tail(turned.size() - held_.count()).squaredNorm();
      const bool depends = rate <= kLeftOfRow * kLeftOfRow;
      double length = HUGE_VAL;
      Index leaves = -1;
      for (Index k = 0; k < weights.size(); ++k) {
        const double left = p_.multipliers[p_.held[std::size_t(k)]];
        if (weights[k] > kLeftOfRow && left / weights[k] < length) length = left / weights[k], leaves = k;
      }
      if (depends && leaves < 0) {
        if (beyond(row) > kImplied * (p_.z.norm() + std::abs(d_[row])))
          prove_empty(row, weights);
        else
          is_implied_[std::size_t(row)] = true;
        return true;
      }
      const double to_hold = depends ? HUGE_VAL : std::max(0.0, beyond(row)) / rate;
      const bool holds = to_hold <= length;
      length = std::min(length, to_hold);
      for (Index k = 0; k < weights.size(); ++k) {
        double& multiplier = p_.multipliers[p_.held[std::size_t(k)]];
        multiplier = std::max(0.0, multiplier - length * weights[k]);
      }
      p_.multipliers[row] += length;
      if (!depends) p_.z -= length * held_.left(turned);
      if (holds) {
        held_.add(turned), p_.held.push_back(row);
        return true;
      }
      p_.multipliers[p_.held[std::size_t(leaves)]] = 0;
      held_.remove(leaves), p_.held.erase(p_.held.begin() + leaves);
    }
    return false;
  }

  void prove_empty(Index row, const VectorXd& weights) {
    p_.is_empty = true;
    p_.ray.setZero(B_.rows());
    p_.ray[row] = 1 / lengths_[row];
    for (Index k = 0; k < weights.size(); ++k) {
      const Index j = p_.held[std::size_t(k)];
      p_.ray[j] = std::max(0.0, -weights[k]) / lengths_[j];
    }
  }

  MatrixXd B_;
  VectorXd d_, off_, lengths_;
  double start_;
  std::vector<bool> is_implied_;
  HeldRows held_;
  NearestPoint p_;
};

}  // namespace

NearestPoint nearest_point(const VectorXd& z0, const MatrixXd& B, const VectorXd& d, const VectorXd& off) {
  return NearestPointSearch(z0, B, d, off).run();
}

}  // namespace dyntape
