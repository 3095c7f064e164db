// SPDX-License-Identifier: BSD-3-Clause
//
// A robot's function at many states by one route, for any number of Python threads at a time.
//
//   const auto rnea = make_route(robot, RobotFunction::kRnea, "lanes", {}, true);
//   evaluate(*rnea, rows, results);      // releases the lock; states are shared out among the threads of the process
//
// Zeros of results are positive: the sign of a zero depends on the route.
//
// A device evaluates the recording of the plain code, of a batch in large parts, with the bits of "lanes" where those are
// the recording's (robots/lanes_route.h).
//
// "lanes" is the plain double code in packs, or machine code with the same bits (robots/lanes_route.h); the other words are those
// of RobotRoute.
#pragma once

#include <compare>
#include <memory>
#include <stop_token>
#include <string>

#include <dyntape/interface/robot/robot_functions.h>

#include "arrays.h"

namespace dyntape::python {

class RobotPath {
 public:
  virtual ~RobotPath() = default;
  // States one after the other; from any thread.
  virtual void evaluate(const double* states, std::size_t count, double* results) = 0;

  std::size_t n_in = 0, n_out = 0;
  std::vector<Block> blocks;  // of a result
  bool is_brief = false;      // plain arithmetic, which ends soon
  bool is_device = false;     // which takes thousands of states at a time
};

inline constexpr const char* kLanes = "lanes";

// Where a device is named, as "opencl:0", it takes the place of a route.
struct RobotDevice {
  std::string name{};
  bool single = false;  // in float
  auto operator<=>(const RobotDevice&) const = default;
};

std::shared_ptr<RobotPath> make_route(const dynamics::Model<double>& model, const RobotFunction& function,
                                      const std::string& word, const RobotDevice& device, bool many,
                                      const std::stop_token& stop = {});

// The blocks of a function's result.
std::vector<Block> blocks_of(const dynamics::Model<double>& model, const RobotFunction& function);
// "nv x nv" of "3 nv x nv": extents as the table prints them; none for a number.
std::vector<std::string> extents_of(const std::string& shape);

void evaluate(RobotPath& route, const Rows& rows, double* results);

}  // namespace dyntape::python
