// SPDX-License-Identifier: BSD-3-Clause
//
// Feasibility restoration: finds a point that the filter of the interior-point method accepts, when no step does.
//
//   minimise  1/2 |c(w)|^2 - mu sum ln(w - lower) - mu sum ln(upper - w)
//
// by damped Newton steps, or Gauss-Newton steps if the curvature has no minimum.  The barrier parameter decreases
// with the constraint violation.  If it ends with violated constraints, no direction reduces the violation: the
// program is locally infeasible.
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <dyntape/interface/control/riccati/barrier.h>

namespace dyntape {

// Pairs of violation and barrier function that later points must improve.
struct Filter {
  double least_theta = 0, most_theta = 0;  // below: steps reduce the cost; above: refused

  void begin(double theta) {
    least_theta = 1e-4 * std::max(1.0, theta), most_theta = 1e4 * std::max(1.0, theta);
    clear();
  }
  void clear() { pairs.clear(); }
  bool takes(double theta, double phi) const {
    if (theta > most_theta) return false;
    for (const auto& [t, p] : pairs) {
      if (theta >= t && phi >= p) return false;
    }
    return true;
  }
  // With the margins of the source.
  void add(double theta, double phi) { pairs.emplace_back((1 - 1e-5) * theta, phi - 1e-8 * theta); }

  std::vector<std::pair<double, double>> pairs = {};
};

enum class RestorationEnd { kRestored, kInfeasible, kStopped, kFailed };

class Restoration {
 public:
  Restoration(Nlp& nlp, StagewiseKkt& kkt, const Barrier& barrier);

  // Callbacks of the method: whether a point is acceptable, whether to stop, and a point's values; false: they are
  // not finite.
  struct Method {
    std::function<bool(const BarrierPoint&)> takes;
    std::function<bool()> stops;
    std::function<bool(BarrierPoint&)> evaluate;
  };
  // Moves `point` until its violation is at most nine tenths and `takes` accepts it.  Changes the matrices of `kkt`.
  RestorationEnd run(BarrierPoint& point, double mu, double small, const Method& method);

 private:
  bool linearise(const BarrierPoint& point);
  bool is_flat(const BarrierPoint& point) const;
  std::optional<RestorationEnd> improve(BarrierPoint& point, const Method& method);
  bool find_step(const BarrierPoint& point);
  std::optional<double> search(const BarrierPoint& point, const Method& method);
  double merit(const BarrierPoint& at) const;
  void lower_barrier(const BarrierPoint& point);

  Nlp& nlp_;
  StagewiseKkt& kkt_;
  const Barrier& barrier_;
  Eigen::Index n_, m_;
  double mu_ = 0, share_;  // of the sum of logarithms; fraction of the violation
  double damping_ = 1e-6;  // relative to the square of the largest gradient, or to 1 if that is smaller
  double steepest_ = 0;    // largest entry of the Jacobian so far
  BoundMultipliers bound_multipliers_;
  BarrierPoint trial_;
  Eigen::VectorXd jacobian_, hessian_;
  Eigen::VectorXd slope_, of_c_, step_;  // (n + m) gradient of the barrier, of the violation
  KktDiagonal diagonal_;
  KktVector right_, change_;
};

}  // namespace dyntape
