// SPDX-License-Identifier: BSD-3-Clause
//
// The course of one solve by differential dynamic programming (solve/ddp.h), which says what it needs next and waits for it:
//
//   DdpCourse course(options, work, lane, cost);
//   while (course.wish() != DdpWish::kNothing) {
//     ...                                          // the work of its wish, together with that of other lanes
//     course.go_on();
//   }
//   course.status(), course.iterations()
//
// Which problems go side by side, and who waits for whom, is the caller's, and changes nothing of the course.
#pragma once

#include <memory>
#include <vector>

#include <dyntape/interface/control/batch/lane_work.h>
#include <dyntape/interface/control/solve/ddp.h>

namespace dyntape {

enum class DdpWish { kNothing, kRollOut, kLinearise, kBackward };

class DdpCourse {
 public:
  DdpCourse(const DdpOptions& options, LaneWork& work, int lane);
  ~DdpCourse();
  DdpCourse(DdpCourse&&) noexcept;
  DdpCourse& operator=(DdpCourse&&) noexcept;

  DdpWish wish() const;
  // kRollOut: trials of these lengths, the first needed, those behind it of use in this order.  What was run is handed back, at least one.
  const std::vector<double>& lengths() const;
  void set_costs(std::vector<double> costs);
  void go_on();
  int accepted() const;  // after it went on from trials: which of them is its motion now; -1: none

  // At the end.
  SolveStatus status() const;
  double cost() const;
  bool is_minimum() const;
  bool is_saddle() const;
  std::vector<DdpIteration> take_iterations();

 private:
  struct Solve;
  std::unique_ptr<Solve> solve_;
};

}  // namespace dyntape
