// SPDX-License-Identifier: BSD-3-Clause
//
// One way to a function of a robot, ready to be timed beside the others, and what making it cost.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <dyntape/interface/robot/robot_functions.h>

#include "measure.h"

namespace dyntape::bench {

// States and where their values are to go: those that a route cycles through.
using States = std::vector<Eigen::VectorXd>;

struct Route {
  std::string name;
  tools::Contender run;
  // The value at a state, in the order of robot_functions.h; empty: the route says nothing.
  std::function<std::vector<double>(int state)> value;

  // Zero: not known, or none.
  std::size_t operations = 0;  // of one state
  double compile = 0;          // s of the compiler
  double made = 0;             // s from the robot to a loaded kernel, without any cache
  double first = 0;            // s from the robot to a first result while the compiler works
  double load = 0;             // s from the recorded function to a first result, out of the cache
  std::size_t text = 0;        // bytes of machine code
  std::string note;
};

// Plain double and packs.
std::vector<Route> plain_routes(const dynamics::Model<double>& model, const RobotFunction& function,
                                const States& states);
// Interpreted, and as generated C: one state at a time and several in lanes.
std::vector<Route> recorded_routes(const dynamics::Model<double>& model, const RobotFunction& function,
                                   const States& states);
// What casadi_peer.py or cppadcodegen_peer.py has made: a description of a library, as JSON.
Route generated_route(const std::string& path, const dynamics::Model<double>& model,
                      const RobotFunction& function, const States& states);
// Separate multiplications and additions in the widest registers, as many at a time as the processor takes.
Route peak_route();

}  // namespace dyntape::bench
