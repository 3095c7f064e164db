// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/system.h>

namespace dyntape {

const char* to_string(Integrator integrator) {
  constexpr const char* kInTheirOrder[] = {"semi-implicit-euler", "runge-kutta-4", "implicit-midpoint",
                                           "implicit-velocity",   "variational",   "adaptive",
                                           "adaptive-stiff"};
  return kInTheirOrder[static_cast<int>(integrator)];
}

bool is_adaptive(Integrator integrator) {
  return integrator == Integrator::kAdaptive || integrator == Integrator::kAdaptiveStiff;
}

std::vector<int> lagged_motors(const System& system) {
  std::vector<int> motors;
  for (int k = 0; k < system.lag.size(); ++k)
    if (system.lag[k] > 0) motors.push_back(k);
  return motors;
}

}  // namespace dyntape
