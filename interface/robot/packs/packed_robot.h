// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluates a robot function at many states in SIMD lanes, without recording or compiling.  Use it for large
// batches.
//
//   PackedRobot id(arm, RobotFunction("id-derivatives"));    // 8 lanes with AVX-512, else 4
//   id.evaluate(states, count, results);                     // states (n_in x count), results (n_out x count)
//
// States and results are contiguous, one column per state, with the shapes of robot_functions.h.  The bits of a
// result do not depend on the other states or the number of lanes.  A result differs from the plain double code by
// the rounding of the elementary functions (autodiff/scalars/pack.h).  A NaN affects its own state only.  If count
// is not a multiple of the lanes, the last lanes repeat the last state.
#pragma once

#include <cstddef>
#include <memory>

#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape {

namespace detail {
struct PackedPath;
}

// Not thread-safe.  evaluate allocates in its first call only.
class PackedRobot {
 public:
  // lanes: 4 or 8; 0: the width of the processor's registers.  ArgumentError for another number.  NumericalError for
  // forward dynamics if a joint moves no inertia.
  PackedRobot(const dynamics::Model<double>& model, const RobotFunction& function, int lanes = 0);
  ~PackedRobot();
  PackedRobot(PackedRobot&&) noexcept;
  PackedRobot& operator=(PackedRobot&&) noexcept;

  std::size_t n_in() const;
  std::size_t n_out() const;
  int lanes() const;

  void evaluate(const double* states, std::size_t count, double* results);

 private:
  std::unique_ptr<detail::PackedPath> path_;
};

}  // namespace dyntape
