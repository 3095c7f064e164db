// SPDX-License-Identifier: BSD-3-Clause
//
// A robot's function at many states, several at once in the lanes of packs: nothing is recorded or compiled.
//
//   PackedRobot id(arm, RobotFunction("id-derivatives"));    // 8 lanes with AVX-512, else 4
//   id.evaluate(states, count, results);                     // states (n_in x count), results (n_out x count)
//
// States and results one after the other, shapes of one as in robot_functions.h.  A state's result does not
// depend on the others, nor on the number of lanes, to the last bit; it differs from the plain double code
// by the rounding of the elementary functions (autodiff/scalars/pack.h).  A NaN spoils its own state only.  The last
// lanes of a count that is no multiple of the lanes repeat the last state.
#pragma once

#include <cstddef>
#include <memory>

#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape {

namespace detail {
struct PackedPath;
}

// One thread at a time; evaluate allocates nothing after its first call.
class PackedRobot {
 public:
  // lanes: 4 or 8; 0 for what the registers hold of the processor that the program runs on.  ArgumentError
  // for another number, NumericalError for forward dynamics of a robot without inertia about a joint.
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
