// SPDX-License-Identifier: BSD-3-Clause
//
// Soft stops at the joints' limits: springs and dampers that start a margin before a limit and never pull.
//
//   effects.limits = SoftLimits<double>{stiffness, damping, margin};
//
//   tau = one_sided(lower + margin - q, -v) - one_sided(q - (upper - margin), v)      (one_sided.h)
// For joints on a line with a finite limit (Joint::limits); other entries are ignored and add no operation.  Energy:
// the springs store, the dampers dissipate.  Twice continuously differentiable; derivatives of one_sided.
#pragma once

#include <dyntape/dynamics/effects/effect_torques.h>
#include <dyntape/dynamics/effects/one_sided.h>

#include <cmath>

namespace dyntape::dynamics {

template <class T>
struct SoftLimits {
  static constexpr const char *kName = "joint limits", *kKey = "joint_limits";

  VectorX<T> stiffness = {};  // (nv) N m/rad or N/m
  VectorX<T> damping = {};    // (nv) N m s/rad or N s/m
  VectorX<T> margin = {};     // (nv) rad or m

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(ParameterInfo{.name = "stiffness",
                        .unit = "N m/rad or N/m",
                        .what = "stiffness of the stops",
                        .least = 0,
                        .above = true},
          self.stiffness);
    visit(ParameterInfo{.name = "damping",
                        .unit = "N m s/rad or N s/m",
                        .what = "damping of the stops at the limit",
                        .least = 0,
                        .fallback = 0},
          self.damping);
    visit(ParameterInfo{.name = "margin",
                        .unit = "rad or m",
                        .what = "distance before the limit at which the stop begins to push",
                        .least = 0,
                        .above = true},
          self.margin);
  }
  // Calls visit(k, sign, push): a joint's column, the sign of its torque, its penetration; q' has the other sign.
  template <class Visit>
  void for_each_stop(const Model<T>& model, const VectorRef<T>& q, const VectorRef<T>& v, Visit visit) const {
    for_each_overshoot(model, q, [&](int k, double sign, const T& x) {
      const T rate = sign > 0 ? T(-v[k]) : v[k];
      visit(k, sign, one_sided<T>(x, rate, stiffness[k], damping[k], margin[k]));
    });
  }
  template <class Visit>
  void for_each_overshoot(const Model<T>& model, const VectorRef<T>& q, Visit visit) const {
    for (const Joint<T>& joint : model.joints) {
      if (!traits(joint.type).on_a_line) continue;
      const int k = joint.idx_v;
      const T& at = q[joint.idx_q];
      if (std::isfinite(joint.limits.lower)) visit(k, 1.0, T(T(joint.limits.lower) + margin[k] - at));
      if (std::isfinite(joint.limits.upper)) visit(k, -1.0, T(at - (T(joint.limits.upper) - margin[k])));
    }
  }
  void add_joint_torques(const Model<T>& model, EffectTorques<T>& torques, const VectorRef<T>& q,
                         const VectorRef<T>& v) const {
    for_each_stop(model, q, v, [&](int k, double sign, const OneSided<T>& push) {
      torques.tau[k] += sign > 0 ? push.force : T(-push.force);
    });
  }
  void add_joint_slopes(const Model<T>& model, EffectTorques<T>& torques, const VectorRef<T>& q,
                        const VectorRef<T>& v) const {
    for_each_stop(model, q, v, [&](int k, double, const OneSided<T>& push) {
      torques.dtau_dq[k] -= push.by_length;
      torques.dtau_dv[k] -= push.by_rate;
    });
  }
  T stored_energy(const Model<T>& model, const Data<T>&, const VectorRef<T>& q) const {
    T energy = T(0);
    for_each_overshoot(model, q, [&](int k, double, const T& x) {
      energy += one_sided_energy<T>(x, stiffness[k], margin[k]);
    });
    return energy;
  }
};

}  // namespace dyntape::dynamics
