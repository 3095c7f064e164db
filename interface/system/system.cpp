// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/system.h>

namespace dyntape {

const char* to_string(Integrator integrator) {
  switch (integrator) {
    case Integrator::kSemiImplicitEuler:
      return "semi-implicit-euler";
    case Integrator::kRungeKutta4:
      return "runge-kutta-4";
    case Integrator::kImplicitMidpoint:
      return "implicit-midpoint";
    case Integrator::kImplicitVelocity:
      return "implicit-velocity";
    case Integrator::kVariational:
      return "variational";
    case Integrator::kAdaptive:
      return "adaptive";
    case Integrator::kAdaptiveStiff:
      break;
  }
  return "adaptive-stiff";
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
