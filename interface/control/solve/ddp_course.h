// SPDX-License-Identifier: BSD-3-Clause
//
// The algorithm of one solve by differential dynamic programming (ddp.h) as a coroutine that requests work and waits
// for it:
//
//   DdpCourse course(options, work, lane);
//   while (course.wish() != DdpWish::kNothing) {
//     ...                                          // do the requested work, together with that of other lanes
//     course.go_on();
//   }
//   DdpSolution s = course.solution();
//
// The caller groups problems and their work in any way; this does not change the algorithm.
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
  // cost: of the initial motion, if known.
  DdpCourse(const DdpOptions& options, DdpWork& work, int lane, std::optional<double> cost = {});
  ~DdpCourse();
  DdpCourse(DdpCourse&&) noexcept;
  DdpCourse& operator=(DdpCourse&&) noexcept;

  DdpWish wish() const;
  // kRollOut: trial lengths; the first is required, the others are optional in this order.  Returns those that were
  // run, at least one.
  const std::vector<double>& lengths() const;
  void set_costs(std::vector<double> costs);
  void go_on();
  int accepted() const;  // after trials: index of the accepted one; -1: none

  DdpSolution solution();  // at the end, once; without times

 private:
  struct Solve;
  std::unique_ptr<Solve> solve_;
};

}  // namespace dyntape
