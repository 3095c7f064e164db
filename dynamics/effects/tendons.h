// SPDX-License-Identifier: BSD-3-Clause
//
// Tendons with constant moment arms over single joints, with a spring and a damper.
//
//   Tendon<double> tendon;
//   tendon.arms = Eigen::VectorXd{{0.02, -0.02}};     // m/rad, one per joint
//   tendon.stiffness = 2000, effects.tendons.push_back(tendon);
//
//   l = length + sum c_j q_j      (m)          angles of continuous joints in [-pi, pi]
//   F = k (l - rest_length) + d l'             kBothWays
//   F = one_sided(l - rest_length, l')         kTension: only pulls (one_sided.h); its margin is `slack`
//   tau_j = - c_j F
// Energy: the spring stores, the damper dissipates.  kBothWays is linear, kTension twice continuously
// differentiable.  Derivatives:
// - c_i c_j dF/dl by q_j, - c_i c_j dF/dl' by v_j.  (MuJoCo's fixed tendons.)
#pragma once

#include <dyntape/dynamics/effects/effect_torques.h>
#include <dyntape/dynamics/effects/one_sided.h>
#include <dyntape/dynamics/model/joints.h>

namespace dyntape::dynamics {

enum class TendonKind { kBothWays, kTension };

template <class T>
struct Tendon {
  Eigen::VectorXd arms = {};  // (nv) c, m/rad or 1; for single joints, other entries are ignored
  T length = T(0);            // at zero coordinates, m
  T rest_length = T(0);       // m
  T stiffness = T(0);         // k, N/m
  T damping = T(0);           // d, N s/m
  TendonKind kind = TendonKind::kBothWays;
  T slack = T(1e-3);  // m; for kTension

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(ParameterInfo{.name = "arms",
                        .unit = "m/rad or 1",
                        .what = "lever arm: change of the tendon's length per joint coordinate",
                        .fallback = 0},
          self.arms);
    visit(ParameterInfo{.name = "length",
                        .unit = "m",
                        .what = "length of the tendon when all coordinates are zero",
                        .fallback = 0},
          self.length);
    visit(ParameterInfo{.name = "rest_length",
                        .unit = "m",
                        .what = "length at which the tendon has no force",
                        .fallback = 0},
          self.rest_length);
    visit(
        ParameterInfo{
            .name = "stiffness", .unit = "N/m", .what = "force per elongation", .least = 0, .above = true},
        self.stiffness);
    visit(ParameterInfo{.name = "damping",
                        .unit = "N s/m",
                        .what = "force per rate of elongation",
                        .least = 0,
                        .fallback = 0},
          self.damping);
    visit(ParameterInfo{.name = "kind",
                        .unit = "",
                        .what = "both_ways: pulls and pushes; tension: pulls only",
                        .choices = "both_ways tension"},
          self.kind);
    visit(ParameterInfo{.name = "slack",
                        .unit = "m",
                        .what = "of tension: elongation over which the force sets in smoothly",
                        .least = 0,
                        .above = true,
                        .fallback = 1e-3},
          self.slack);
  }
  // Calls visit(joint, arm) for nonzero arms.
  template <class Visit>
  void for_each_arm(const Model<T>& model, Visit visit) const {
    for (const Joint<T>& joint : model.joints) {
      if (is_single(joint.type) && arms[joint.idx_v] != 0) visit(joint, T(arms[joint.idx_v]));
    }
  }
  T elongation(const Model<T>& model, const VectorRef<T>& q) const {
    T x = length - rest_length;
    for_each_arm(model, [&](const Joint<T>& joint, const T& arm) {
      const int i = joint.idx_q;
      if (traits(joint.type).on_a_line)
        x += arm * q[i];
      else
        x += arm * atan2(q[i + 1], q[i]);
    });
    return x;
  }
  OneSided<T> force(const Model<T>& model, const VectorRef<T>& q, const VectorRef<T>& v) const {
    const T x = elongation(model, q);
    T rate = T(0);
    for_each_arm(model, [&](const Joint<T>& joint, const T& arm) { rate += arm * v[joint.idx_v]; });
    if (kind == TendonKind::kTension) return one_sided<T>(x, rate, stiffness, damping, slack);
    return {stiffness * x + damping * rate, stiffness, damping};
  }
  T stored_energy(const Model<T>& model, const VectorRef<T>& q) const {
    const T x = elongation(model, q);
    return kind == TendonKind::kTension ? one_sided_energy<T>(x, stiffness, slack)
                                        : T(stiffness * x * x * T(0.5));
  }
};

template <class T>
struct Tendons : EffectList<Tendon<T>> {
  static constexpr const char *kName = "tendons", *kKey = "tendons", *kItem = "tendon";
  using EffectList<Tendon<T>>::EffectList;

  template <class Self, class Visit>
  static void visit_parameters(Self&, Visit&&) {}
  void add_torques(const Model<T>& model, EffectTorques<T>& torques, const VectorRef<T>& q,
                   const VectorRef<T>& v) const {
    for (const Tendon<T>& tendon : *this) {
      const OneSided<T> pull = tendon.force(model, q, v);
      tendon.for_each_arm(model, [&](const Joint<T>& joint, const T& arm) {
        torques.total[joint.idx_v] -= arm * pull.force;
      });
    }
  }
  void subtract_slopes(const Model<T>& model, Data<T>& data, const VectorRef<T>& q,
                       const VectorRef<T>& v) const {
    data.across = true;
    for (const Tendon<T>& tendon : *this) {
      const OneSided<T> pull = tendon.force(model, q, v);
      tendon.for_each_arm(model, [&](const Joint<T>& row, const T& c_i) {
        tendon.for_each_arm(model, [&](const Joint<T>& column, const T& c_j) {
          data.dtau_dq(row.idx_v, column.idx_v) += c_i * c_j * pull.by_length;
          data.dtau_dv(row.idx_v, column.idx_v) += c_i * c_j * pull.by_rate;
        });
      });
    }
  }
  T stored_energy(const Model<T>& model, const Data<T>&, const VectorRef<T>& q) const {
    T energy = T(0);
    for (const Tendon<T>& tendon : *this) energy += tendon.stored_energy(model, q);
    return energy;
  }
};

}  // namespace dyntape::dynamics
