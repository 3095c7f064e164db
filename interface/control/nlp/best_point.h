// SPDX-License-Identifier: BSD-3-Clause
//
// The result of a solve that is stopped: the visited point with the least constraint violation; among points below
// 1e-6 of the nominal values, the one with the least cost.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

struct BestPoint {
  std::vector<double> x, g;
  double violation = HUGE_VAL, objective = HUGE_VAL;

  // x (n) and its g (m).
  void consider(const NlpShape& shape, const double* at, const double* rows, double cost) {
    constexpr double kFeasible = 1e-6;
    double most = 0;
    for (std::size_t j = 0; j < shape.m(); ++j)
      most = std::max({most, shape.g_lower[j] - rows[j], rows[j] - shape.g_upper[j]});
    const bool is_better = violation <= kFeasible && most <= kFeasible ? cost < objective : most < violation;
    if (!is_better) return;
    x.assign(at, at + shape.n()), g.assign(rows, rows + shape.m());
    violation = most, objective = cost;
  }

  void move_into(NlpSolution& solution) {
    solution.x = std::move(x), solution.g = std::move(g);
    solution.objective = objective;
  }
};

}  // namespace dyntape
