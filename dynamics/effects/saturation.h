// SPDX-License-Identifier: BSD-3-Clause
//
// Torque limits of motors, applied to the driving torques.
//
//   effects.saturation = Saturation<double>{model_effort(model), SaturationKind::kSmooth};
//   forward_dynamics(model, data, torques, effects, q, v, command);      // torques.driven: the torques at the joints
//
//   kHard    tau = min(max(command, -L), L)        continuous; derivative 1 inside, 0 outside, with jumps at +-L
//   kSmooth  tau = L tanh(command / L)             infinitely often differentiable; 76 % of L at command = L
// d tau / d command is EffectTorques::driven_slope.  Energy: reduces the supply of the motors.
#pragma once

#include <dyntape/dynamics/effects/effect_torques.h>

#include <cmath>

namespace dyntape::dynamics {

enum class SaturationKind { kHard, kSmooth };

template <class T>
struct Saturation {
  static constexpr const char *kName = "torque saturation", *kKey = "torque_saturation";

  Eigen::VectorXd limit = {};  // (nv) L, N m or N; +inf: none; for single joints, other entries are ignored
  SaturationKind kind = SaturationKind::kHard;

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(ParameterInfo{.name = "limit",
                        .unit = "N m or N",
                        .what = "largest torque of the motor",
                        .least = 0,
                        .most = std::numeric_limits<double>::infinity(),
                        .above = true,
                        .fallback = std::numeric_limits<double>::infinity(),
                        .of_robot = model_effort<double>},
          self.limit);
    visit(ParameterInfo{.name = "kind",
                        .unit = "",
                        .what = "how the torque is limited: hard: exactly; smooth: with a smooth transition",
                        .choices = "hard smooth"},
          self.kind);
  }
  void drive(const Model<T>& model, EffectTorques<T>& torques) const {
    for (const Joint<T>& joint : model.joints) {
      const int k = joint.idx_v;
      if (!is_single(joint.type) || !std::isfinite(limit[k])) continue;
      const T L(limit[k]), command = torques.driven[k];
      if (kind == SaturationKind::kSmooth) {
        const T t = tanh(command / L);
        torques.driven[k] = L * t;
        torques.driven_slope[k] *= T(1) - t * t;
      } else {
        const T below = select(command < L, command, L);
        torques.driven[k] = select(below > -L, below, T(-L));
        const T within = select(command > -L, T(1), T(0));
        torques.driven_slope[k] *= select(command < L, within, T(0));
      }
    }
  }
};

}  // namespace dyntape::dynamics
