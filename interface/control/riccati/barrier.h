// SPDX-License-Identifier: BSD-3-Clause
//
// The barrier problem of a program: every inequality with a slack, every bound as a logarithm.
//
//   minimise  f(x) - mu sum ln(w - lower) - mu sum ln(upper - w)    subject to  c(w) = 0,      w = (x, s)
//
//   c_j = g_j - bound    of an equality,        c_j = g_j - s_j    of an inequality, whose bounds are those of s_j
//
// w has n + m entries.  Slacks of rows that are not inequalities are zero without bounds; variables with equal
// bounds have none.
#pragma once

#include <Eigen/Core>
#include <vector>

#include <dyntape/interface/control/nlp/solution.h>
#include <dyntape/interface/control/riccati/stage_kkt.h>

namespace dyntape {

struct BarrierPoint {
  Eigen::VectorXd w, c;         // (n + m), (m)
  double f = 0;                 // of the program
  double sum = 0, largest = 0;  // of |c|
};

class Barrier {
 public:
  Barrier(Nlp& nlp, const StagewiseKkt& kkt);  // `kkt` defines the kinds of rows
  // The program's bounds, widened (bound_widening.h).
  void set_bounds(double relaxation);

  Eigen::Index n() const { return n_; }
  Eigen::Index m() const { return m_; }
  // Returns true if an entry of w is a free variable, or the slack of an inequality.
  bool moves(Eigen::Index i) const {
    return i < n_ ? !kkt_.is_fixed(std::size_t(i)) : kkt_.kind(std::size_t(i - n_)) == RowKind::kInequality;
  }
  const std::vector<Eigen::Index>& still() const { return still_; }  // entries that do not move
  const Eigen::VectorXd& lower() const { return lower_; }
  const Eigen::VectorXd& upper() const { return upper_; }
  const std::vector<Eigen::Index>& bounded() const { return bounded_; }  // entries of w that have a bound

  // Sets w from the program's variables, moved inside the bounds by at least `push` of their size or distance.
  // Returns false if the program has no value there.
  bool begin(const std::vector<double>& x, double push, BarrierPoint& point);
  bool evaluate(BarrierPoint& point);  // at point.w

  double value(const BarrierPoint& point, double mu) const;
  // (n + m) gradient of the logarithms.
  void slope(const Eigen::VectorXd& w, double mu, Eigen::VectorXd& slope) const;
  // The longest step in (0, 1] that leaves the fraction 1 - tau of each distance to a bound.
  double longest(const Eigen::VectorXd& w, const Eigen::VectorXd& step, double tau) const;

 private:
  Nlp& nlp_;
  const StagewiseKkt& kkt_;
  Eigen::Index n_, m_;
  Eigen::VectorXd lower_, upper_;
  std::vector<Eigen::Index> bounded_, still_;
};

// Multipliers of the bounds of w, and their Newton steps.
struct BoundMultipliers {
  Eigen::VectorXd lower, upper;            // (n + m) >= 0, zero without bound
  Eigen::VectorXd lower_step, upper_step;  // (n + m)

  // Those of the barrier, but at most `most`.
  void begin(const Barrier& barrier, const Eigen::VectorXd& w, double mu, double most);
  void set_ones(const Barrier& barrier);                  // of existing bounds
  void reset_above(double most, const Barrier& barrier);  // to ones, if any is above `most`
  // Those of an earlier solution, with products of multiplier and distance at least `least` unless the distance is
  // long.  Returns the mean product, which corresponds to a barrier parameter.
  double take_over(const Barrier& barrier, const Eigen::VectorXd& w, const NlpSolution& earlier,
                   double least);
  // Their contribution to the curvature of w: multiplier over distance.
  void curve(const Barrier& barrier, const Eigen::VectorXd& w, KktDiagonal& diagonal) const;
  // Computes their steps for a step of w.
  void step(const Barrier& barrier, const Eigen::VectorXd& w, const Eigen::VectorXd& w_step, double mu);
  double mean_product(const Barrier& barrier,
                      const Eigen::VectorXd& w) const;  // of bound multiplier and distance
  double longest(double tau) const;                     // in (0, 1], leaves the fraction 1 - tau of each
  // Updates them for the new w; limits their distance from the values of the barrier.
  void move(const Barrier& barrier, const Eigen::VectorXd& w, double length, double mu);
};

}  // namespace dyntape
