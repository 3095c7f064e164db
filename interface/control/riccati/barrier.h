// SPDX-License-Identifier: BSD-3-Clause
//
// What an interior-point method sees of a program: every inequality with a slack, every bound in a logarithm.
//
//   minimise  f(x) - mu sum ln(w - lower) - mu sum ln(upper - w)    subject to  c(w) = 0,      w = (x, s)
//
//   c_j = g_j - bound    of an equality,        c_j = g_j - s_j    of an inequality, whose bounds are those of s_j
//
// w has n + m entries; slacks of rows that are no inequality stay zero and have no bounds, nor have variables with equal ones.
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
  Barrier(Nlp& nlp, const StagewiseKkt& kkt);  // `kkt` says what the rows are
  // Those of the program, widened (bound_widening.h).
  void set_bounds(double relaxation);

  Eigen::Index n() const { return n_; }
  Eigen::Index m() const { return m_; }
  // Whether an entry of w is a variable that is not fixed, or the slack of an inequality.
  bool moves(Eigen::Index i) const {
    return i < n_ ? !kkt_.is_fixed(std::size_t(i)) : kkt_.kind(std::size_t(i - n_)) == RowKind::kInequality;
  }
  const std::vector<Eigen::Index>& still() const { return still_; }  // entries that do not
  const Eigen::VectorXd& lower() const { return lower_; }
  const Eigen::VectorXd& upper() const { return upper_; }
  const std::vector<Eigen::Index>& bounded() const { return bounded_; }  // entries of w that have a bound

  // From the program's variables, moved into the bounds' inside by at least `push` of their size or their distance.
  // False where the program has no value there.
  bool begin(const std::vector<double>& x, double push, BarrierPoint& point);
  bool evaluate(BarrierPoint& point);  // at point.w

  double value(const BarrierPoint& point, double mu) const;
  // (n + m) of the logarithms alone.
  void slope(const Eigen::VectorXd& w, double mu, Eigen::VectorXd& slope) const;
  // The longest step within (0, 1] that leaves of each distance to a bound the part 1 - tau.
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
  Eigen::VectorXd lower, upper;            // (n + m) >= 0, zero where there is no bound
  Eigen::VectorXd lower_step, upper_step;  // (n + m)

  // Those of the barrier, but `most` at most.
  void begin(const Barrier& barrier, const Eigen::VectorXd& w, double mu, double most);
  void set_ones(const Barrier& barrier);                  // of the bounds that there are
  void reset_above(double most, const Barrier& barrier);  // to ones, where any is above `most`
  // Those of an earlier solution, no product of bound multiplier and distance below `least` but where the distance is long.  The mean of the
  // products: the barrier that it speaks of.
  double take_over(const Barrier& barrier, const Eigen::VectorXd& w, const NlpSolution& earlier,
                   double least);
  // What they add to the curvature of w: bound multiplier over distance.
  void curve(const Barrier& barrier, const Eigen::VectorXd& w, KktDiagonal& diagonal) const;
  // By a step of w.
  void step(const Barrier& barrier, const Eigen::VectorXd& w, const Eigen::VectorXd& w_step, double mu);
  double mean_product(const Barrier& barrier,
                      const Eigen::VectorXd& w) const;  // of bound multiplier and distance
  double longest(double tau) const;                     // within (0, 1], that leaves of each the part 1 - tau
  // To a point that w has moved to; never far from what its barrier would make them.
  void move(const Barrier& barrier, const Eigen::VectorXd& w, double length, double mu);
};

}  // namespace dyntape
