// SPDX-License-Identifier: BSD-3-Clause
//
// The robots of config/robots.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "source_folder.h"

namespace dyntape::dynamics {

inline std::string robot_file(const std::string& name) {
  return (std::filesystem::path(test::source_folder()) / "config" / "robots" / (name + ".urdf")).string();
}

inline const std::vector<std::string>& robot_names() {
  static const std::vector<std::string> kNames = {"arm_2r", "block", "cart_pole", "double_pendulum", "g1",
                                                  "iiwa14", "panda", "pendulum",  "simple_humanoid", "solo12",
                                                  "talos",  "ur5"};
  return kNames;
}

}  // namespace dyntape::dynamics
