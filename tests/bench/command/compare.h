// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape bench without routes: functions in plain double, their errors against 113 bits, and beside them a
// peer that runs in the same process.  Beside a peer, derivatives of a frame are those in the frame itself.
#pragma once

#include <dyntape/interface/robot/robot_functions.h>

#include <string>
#include <vector>

namespace dyntape::tools {

struct CompareOptions {
  std::vector<RobotFunction> functions;
  int states = 256;
  std::uint64_t seed = 1;
  bool peer = false;
  std::string peer_prefix;
  bool json = false;
};

void compare(const dynamics::Model<double>& model, const CompareOptions& options);

}  // namespace dyntape::tools
