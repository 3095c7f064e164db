// SPDX-License-Identifier: BSD-3-Clause
//
// Gradients of kinetic and potential energy, and derivatives of gravity and bias torques.
//
//   EnergyGradients<double> e(model);                       // results and working memory, beside Data
//   kinetic_energy_gradients(model, data, e, q, v);         // e.dT_dq, e.dT_dv, data.kinetic_energy
//   gravity_derivatives(model, data, e, q);                 // e.dg_dq, data.g
//
// algorithms.h computes the values; the gradient of the potential energy U is generalized_gravity.  Derivatives with
// respect to q are tangent.  With T the kinetic energy:
//   dT/dv = M v                 dT/dq_k = S_dot_k . h_j      h_j: momentum of body j and all beyond it
//   power:  tau . v = d(T + U)/dt = dT/dq . v + dT/dv . a + g . v                  (J/s, no losses)
//   dg/dq:  a rotation of the bodies beyond j about column S of j moves their first moment h = m c by S x h.  This
//           adds the
//   couple (S x h) x a to every joint before j, a = -gravity, and no force.
// dg/dq is the Hessian of U and symmetric, except within a joint of several columns: its increments do not commute,
// and the translations of a floating base have rows but no columns.  No result depends on the position of a root.
// Source: docs/math.md (C.13 to C.18).
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>

#include <vector>

namespace dyntape::dynamics {

template <class T>
struct EnergyGradients {
  explicit EnergyGradients(const Model<T>& model) {
    for (auto* x : {&dT_dq, &dT_dv, &zero}) *x = VectorX<T>::Zero(model.nv);
    dg_dq = MatrixX<T>::Zero(model.nv, model.nv);
    momentum.resize(model.njoints());
    moments.resize(model.njoints());
    against_fall.resize(model.njoints());
  }

  VectorX<T> dT_dq, dT_dv;  // (nv)
  MatrixX<T> dg_dq;         // (nv x nv)

  // Working memory.
  std::vector<Force<T>> momentum;        // of body i and all bodies beyond it, in frame i
  std::vector<Composite<T>> moments;     // likewise, without the rotational part
  std::vector<Vector3<T>> against_fall;  // -gravity in the axes of body i
  VectorX<T> zero;                       // (nv)
};

// Computes e.dT_dq, e.dT_dv, data.kinetic_energy; with armature if it acts.
template <class T>
void kinetic_energy_gradients(const Model<T>& model, Data<T>& data, EnergyGradients<T>& e,
                              const VectorRef<T>& q, const VectorRef<T>& v,
                              const DynamicsTerms<T>& acting = {});

// Computes e.dg_dq and data.g.  Cost: one rotated vector for every pair of joints on one path.
template <class T>
const MatrixX<T>& gravity_derivatives(const Model<T>& model, Data<T>& data, EnergyGradients<T>& e,
                                      const VectorRef<T>& q);

// Derivatives of nonlinear_effects: data.dtau_dq and data.dtau_dv at a = 0; data.nle; also data.tau (= nle) and
// data.M.
template <class T>
void nonlinear_effects_derivatives(const Model<T>& model, Data<T>& data, EnergyGradients<T>& e,
                                   const VectorRef<T>& q, const VectorRef<T>& v,
                                   const DynamicsTerms<T>& acting = {});

}  // namespace dyntape::dynamics
