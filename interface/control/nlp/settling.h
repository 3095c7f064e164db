// SPDX-License-Identifier: BSD-3-Clause
//
// Detects that the cost of a solve hardly changes any more, to end solves on meshes that will be refined.
//
//   Settling settling;
//   if (settling.note(record)) return SolveStatus::kSettled;
//
// Criterion: over 15 iterations the violation is at most 1e-3 nominal values and the objective changes by at most
// 1e-3 of its size.  A solve with quadratic convergence ends before that.
#pragma once

#include <algorithm>
#include <cmath>

#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

class Settling {
 public:
  // Of the scaled program.
  bool note(const IterationRecord& record) {
    const bool holds = !record.restoration && record.primal_infeasibility <= kViolation;
    const double least = std::min(least_, record.objective), most = std::max(most_, record.objective);
    if (!holds || !(most - least <= kMoved * std::max(std::abs(least), std::abs(most)))) {
      count_ = holds ? 1 : 0;
      least_ = holds ? record.objective : HUGE_VAL, most_ = holds ? record.objective : -HUGE_VAL;
      return false;
    }
    least_ = least, most_ = most;
    return ++count_ >= kIterations;
  }

 private:
  static constexpr double kViolation = 1e-3, kMoved = 1e-3;
  static constexpr int kIterations = 15;
  int count_ = 0;
  double least_ = HUGE_VAL, most_ = -HUGE_VAL;
};

}  // namespace dyntape
