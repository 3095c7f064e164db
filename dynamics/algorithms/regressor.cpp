// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/algorithms/regressor.h>

namespace dyntape::dynamics {

std::vector<std::string> inertial_parameter_names(int njoints) {
  std::vector<std::string> names;
  for (int i = 1; i <= njoints; ++i) {
    for (const char* name : {"m", "mcx", "mcy", "mcz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz"}) {
      names.push_back(name + std::to_string(i));
    }
  }
  return names;
}

}  // namespace dyntape::dynamics
