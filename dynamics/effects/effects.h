// SPDX-License-Identifier: BSD-3-Clause
//
// Which effects act on a robot.  What is not chosen is not computed: it leaves no operation on a tape.
//
//   Effects<double> effects;                                   // gravity alone
//   effects.damping = model_damping(model);                    // the file's values
//   effects.friction = CoulombFriction<double>{model_friction(model), 0.01};
//   EffectTorques<double> torques(model);                      // results and working memory, beside Data
//   VectorX<double> a = forward_dynamics(model, data, torques, effects, q, v, tau);
//
// Equation of motion with effects:
//   M(q) a + armature a + C v + g = tau + tau_passive + sum of J^T F
//   tau_passive = - d v                      viscous damping d (N m s/rad or N s/m)
//                 - c tanh(v / w)            Coulomb friction c (N m or N), smoothed over w (rad/s or m/s)
//                 - k (q - q_rest)           springs k (N m/rad or N/m); angles of continuous joints
//                                            in [-pi, pi]
//   F                                      wrenches from outside, in the body or the world (wrenches.h)
// All vectors (nv), q_rest (nq).  Springs act on single joints; other entries are not read.
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/effects/wrenches.h>

#include <optional>

namespace dyntape::dynamics {

template <class T>
struct CoulombFriction {
  VectorX<T> torque;   // (nv) magnitude of the sliding friction
  T smoothing = T(0);  // speed over which it builds up: 76 % of it acts at this speed; > 0
};

template <class T>
struct Springs {
  VectorX<T> stiffness;  // (nv)
  VectorX<T> rest;       // (nq) configuration without spring torque
};

template <class T>
struct Effects {
  bool gravity = true;
  std::optional<VectorX<T>> armature;
  std::optional<VectorX<T>> damping;
  std::optional<CoulombFriction<T>> friction;
  std::optional<Springs<T>> springs;
  std::vector<Wrench<T>> wrenches;

  // The part that the recursions take care of; keeps a pointer to `armature`.
  Acting<T> acting() const {
    return {gravity, armature.has_value(), armature ? &*armature : nullptr, nullptr};
  }
};

// The values of the model, (nv), zero for joints of several columns.
template <class T>
VectorX<T> model_armature(const Model<T>& model);
template <class T>
VectorX<T> model_damping(const Model<T>& model);
template <class T>
VectorX<T> model_friction(const Model<T>& model);

// What effects add to the driving torques: results and working memory, beside Data.
template <class T>
struct EffectTorques {
  explicit EffectTorques(const Model<T>& model);

  VectorX<T> tau;               // (nv) tau_passive
  VectorX<T> dtau_dq, dtau_dv;  // (nv) its derivatives, which are diagonal
  WrenchTorques<T> of_wrenches;

  // Working memory.
  VectorX<T> total, deflection;  // (nv)
};

// torques.tau, to be added to the driving torques.
template <class T>
const VectorX<T>& joint_torques(const Model<T>& model, EffectTorques<T>& torques, const Effects<T>& effects,
                                const VectorRef<T>& q, const VectorRef<T>& v);
// torques.dtau_dq and dtau_dv.
template <class T>
void joint_torque_slopes(const Model<T>& model, EffectTorques<T>& torques, const Effects<T>& effects,
                         const VectorRef<T>& q, const VectorRef<T>& v);

// The algorithms of algorithms.h with effects: data.ddq, data.tau.  Nothing is allocated.
template <class T>
const VectorX<T>& forward_dynamics(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                   const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                   const VectorRef<T>& tau);
template <class T>
const VectorX<T>& inverse_dynamics(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                   const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                   const VectorRef<T>& a);

// data.ddq, ddq_dq, ddq_dv, Minv; and data.tau, dtau_dq, dtau_dv, M: as fd_derivatives and id_derivatives.
template <class T>
void forward_dynamics_derivatives(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                  const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                  const VectorRef<T>& tau);
template <class T>
void inverse_dynamics_derivatives(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                  const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                  const VectorRef<T>& a);

}  // namespace dyntape::dynamics
