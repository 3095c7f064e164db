// SPDX-License-Identifier: BSD-3-Clause
//
// The course of one solve by differential dynamic programming (ddp.h), which says what it needs next and waits for it:
//
//   DdpCourse course(options, work, lane);
//   while (course.wish() != DdpWish::kNothing) {
//     ...                                          // the work of its wish, together with that of other lanes
//     course.go_on();
//   }
//   DdpSolution s = course.solution();
//
// Which problems go side by side, and who waits for whom, is the caller's, and changes nothing of the course.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <dyntape/interface/control/solve/ddp_solution.h>
#include <dyntape/interface/control/solve/ddp_work.h>

namespace dyntape {

enum class DdpWish { kNothing, kRollOut, kLinearise, kBackward };

class DdpCourse {
 public:
  // cost: of the motion that the work begins with, where that is known.
  DdpCourse(const DdpOptions& options, DdpWork& work, int lane, std::optional<double> cost = {});
  ~DdpCourse();
  DdpCourse(DdpCourse&&) noexcept;
  DdpCourse& operator=(DdpCourse&&) noexcept;

  DdpWish wish() const;
  // kRollOut: trials of these lengths, the first needed, those behind it of use in this order.  What was run is handed back, at least one.
  const std::vector<double>& lengths() const;
  void set_costs(std::vector<double> costs);
  void go_on();
  int accepted() const;  // after it went on from trials: which of them is its motion now; -1: none

  DdpSolution solution();  // at the end, once; without times

 private:
  struct Solve;
  std::unique_ptr<Solve> solve_;
};

}  // namespace dyntape
