// SPDX-License-Identifier: BSD-3-Clause
//
// The rigid-body algorithms: kinematics, inverse and forward dynamics, derivatives, energy.
//
//   Model<double> model = load_urdf("arm.urdf", {.base = Base::kFixed});
//   Data<double>  data(model);
//   VectorX<double> q = neutral(model), v = VectorX<double>::Zero(model.nv), a = v;
//   VectorX<double> tau = rnea(model, data, q, v, a);            // copied from data
//   id_derivatives(model, data, q, v, a);                        // data.dtau_dq, data.dtau_dv, data.M
//
// Shapes.  q (nq); v, a, tau (nv); units of model.h.  Each function writes fields of `data`.  A function with one
// main result returns a reference to it, valid until the next call with the same data.  Arguments must not be fields
// that the call writes.  ArgumentError for a wrong size.  No allocation.
//
// Equation of motion, v the velocity in the tangent convention of joints.h:
//   M(q) a + h(q, v) = tau + sum_i J_i^T f_ext,i,     h = C v + g
//
// Frames.  All recursions run in body frames.  The placement of a root in the world enters by its rotation only
// (gravity), so results have the same bits for any position of the base.  Derivatives are with respect to increments
// q (+) d in the moving frame of each joint (free-flyer: linear, then angular).
//
// Recursions (p the parent of i, X_i = data.X_PB[i]; sources: R. Featherstone, Rigid Body Dynamics
// Algorithms, 2008; J. Carpentier, N. Mansard, Analytical Derivatives of Rigid Body Dynamics Algorithms, RSS
// 2018; S. Singh, R. Russell, P. Wensing, Efficient Analytical Derivatives of Rigid-Body Dynamics, RA-L
// 2022):
//   v_i = X_i^-1 v_p + S v        a_i = X_i^-1 a_p + S a + v_i x S v        a_world = -gravity
//   f_i = I_i a_i + v_i x* I_i v_i - f_ext,i + sum over children X f        tau_i = S^T f_i
#pragma once

#include <dyntape/dynamics/algorithms/added_inertia.h>
#include <dyntape/dynamics/algorithms/data.h>

#include <vector>

namespace dyntape::dynamics {

// Terms besides the joint torques.  Default: the model's.
template <class T>
struct DynamicsTerms {
  bool gravity = true;
  bool armature = true;                             // on single joints; a free-flyer has none
  const VectorX<T>* armature_values = nullptr;      // (nv) instead of the model's
  const std::vector<Force<T>>* external = nullptr;  // (njoints) on body i, in its frame, about its origin
  bool coriolis = true;                             // C v; false: velocities are zero in the recursions
  const Vector3<T>* gravity_value = nullptr;        // m/s^2, world frame, instead of the model's
  // (nv) armature = the above + gear_ratio^2 rotor_inertia, if both are given.
  const VectorX<T>*rotor_inertia = nullptr, *gear_ratio = nullptr;
  AddedInertias<T> added = {};  // of bodies, without weight
};

// The axes of a velocity or Jacobian of a frame F, and the point of its linear part.
enum class ReferenceFrame {
  kLocal,             // F itself
  kWorld,             // world axes; linear part: the point at the world's origin
  kLocalWorldAligned  // world axes; linear part: the origin of F
};

// A frame, by its index in model.frames, or on_body(i), the frame of body i.
struct Place {
  Place(int frame) : index(frame) {}  // NOLINT: implicit conversion from a frame's index
  int index;
  bool is_body = false;
};
inline Place on_body(int body) {
  Place place(body);
  place.is_body = true;
  return place;
}

// --- Kinematics ------------------------------------------------------------------------------------------
// data.X_WB; with v also data.v; with a also data.a (spatial acceleration, without gravity).
template <class T>
void forward_kinematics(const Model<T>& model, Data<T>& data, const VectorRef<T>& q);
template <class T>
void forward_kinematics(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v);
template <class T>
void forward_kinematics(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                        const VectorRef<T>& a);

// After forward_kinematics: X_WF, V_F and A_F of frame `frame` (index into model.frames).
template <class T>
Placement<T> frame_placement(const Model<T>& model, const Data<T>& data, int frame);
template <class T>
Motion<T> frame_velocity(const Model<T>& model, const Data<T>& data, int frame, ReferenceFrame in);
template <class T>
Motion<T> frame_acceleration(const Model<T>& model, const Data<T>& data, int frame, ReferenceFrame in);
// Acceleration of the point of frame_velocity (linear: spatial + w x velocity): the frame's origin, in frame or
// world axes; kWorld: the point of the body at the world's origin.
template <class T>
Motion<T> frame_classical_acceleration(const Model<T>& model, const Data<T>& data, int frame,
                                       ReferenceFrame in);

// J (6 x nv) with V_F = J v.  Their derivatives: kinematic_derivatives.h.
template <class T>
const Matrix6X<T>& frame_jacobian(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, Place frame,
                                  ReferenceFrame in);

// --- Inverse dynamics ------------------------------------------------------------------------------------
// tau = M a + h - sum J^T f_ext                                                         data.tau (nv)
template <class T>
const VectorX<T>& rnea(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                       const VectorRef<T>& a, const DynamicsTerms<T>& acting = {});
// h(q, v) - sum J^T f_ext: torques at a = 0                                             data.nle (nv)
template <class T>
const VectorX<T>& nonlinear_effects(const Model<T>& model, Data<T>& data, const VectorRef<T>& q,
                                    const VectorRef<T>& v, const DynamicsTerms<T>& acting = {});
// g(q): torques at v = a = 0, without external forces; the gradient of the potential energy   data.g (nv)
template <class T>
const VectorX<T>& generalized_gravity(const Model<T>& model, Data<T>& data, const VectorRef<T>& q);

// M(q): composite bodies, M_ji = S_j^T X ... X I^C_i S_i                                data.M (nv x nv)
template <class T>
const MatrixX<T>& crba(const Model<T>& model, Data<T>& data, const VectorRef<T>& q,
                       const DynamicsTerms<T>& acting = {});

// --- Forward dynamics ------------------------------------------------------------------------------------
// a = M^-1 (tau + sum J^T f_ext - h), articulated bodies                                data.ddq (nv)
template <class T>
const VectorX<T>& aba(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                      const VectorRef<T>& tau, const DynamicsTerms<T>& acting = {});
// M^-1 without M                                                                        data.Minv (nv x nv)
template <class T>
const MatrixX<T>& minverse(const Model<T>& model, Data<T>& data, const VectorRef<T>& q,
                           const DynamicsTerms<T>& acting = {});

// --- Derivatives -----------------------------------------------------------------------------------------
// Derivatives of inverse dynamics: data.tau, data.dtau_dq, data.dtau_dv, data.M (= dtau_da), each (nv x nv); f_ext
// constant in its body frame.  Entry (i, j) is computed if i and j are on one path from root to leaf; the others are
// zero.  For a column S of joint j, with v_p, a_p the motion of j's parent in frame j:
//   S_dot = v_p x S     S_ddot = a_p x S + v_p x S_dot     S_v = S_dot + v_j x S
//   j above or at i:  dtau_i/dq_j = S_i^T (I^C_i S_ddot_j + 2 B^C_i S_dot_j)
//                     dtau_i/dv_j = S_i^T (I^C_i S_v_j    + 2 B^C_i S_j)
//   i above j:        dtau_i/dq_j = S_i^T (I^C_j S_ddot_j + 2 B^C_j S_dot_j + S_j x* f_j)
//                     dtau_i/dv_j = S_i^T (I^C_j S_v_j    + 2 B^C_j S_j)
// For each j the force vectors in brackets, I^C_j S_j and the couple (2 B^C_j)^T S_j are propagated towards the
// root; 2 B has twelve entries (composite.h).
template <class T>
void id_derivatives(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                    const VectorRef<T>& a, const DynamicsTerms<T>& acting = {});

// Derivatives of forward dynamics: data.ddq, data.ddq_dq, data.ddq_dv, data.Minv (= ddq_dtau), each (nv x nv).
//   ddq_dx = -M^-1 dtau_dx at a = ddq(q, v, tau)
// Also writes data.dtau_dq, data.dtau_dv and data.M at that acceleration; data.tau is then the given torque.
template <class T>
void fd_derivatives(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                    const VectorRef<T>& tau, const DynamicsTerms<T>& acting = {});
// The same without ddq_dq and ddq_dv, which the caller solves for.
template <class T>
void id_derivatives_under(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                          const VectorRef<T>& tau, const DynamicsTerms<T>& acting = {});

// --- Energy ----------------------------------------------------------------------------------------------
// 1/2 v^T M v, including armature if it acts (J)
template <class T>
const T& kinetic_energy(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                        const DynamicsTerms<T>& acting = {});
// -sum m gravity . c, zero at the world's origin (J); the centre of mass: centroidal.h
template <class T>
const T& potential_energy(const Model<T>& model, Data<T>& data, const VectorRef<T>& q);
}  // namespace dyntape::dynamics
