// SPDX-License-Identifier: BSD-3-Clause
//
// Derivatives of the motion of a frame or of a body: Jacobian rates, derivatives of velocity and acceleration,
// kinematic Hessians.
//
//   KinematicDerivatives<double> K(model);
//   forward_kinematics(model, data, q, v, a);                            // once for all frames
//   frame_acceleration_derivatives(model, data, K, frame, ReferenceFrame::kLocalWorldAligned);
//   a_next = K.C.vector() + K.dC_dq * dq + K.dC_dv * dv + K.J * da;      // first order
//
// Every function takes a frame (index into model.frames) or on_body(index of its joint), after forward_kinematics
// with the arguments named, in kLocal, kWorld and kLocalWorldAligned (algorithms.h).  Columns of dofs that do not
// move the frame are zero.  Units: m, rad, s.  ArgumentError: an invalid frame or body, a workspace of another
// model.  No allocation.
//
// Derivatives are of the components in the requested frame, which moves with q, with respect to increments q (+) d.
// V is the velocity, A the spatial acceleration, C the classical one:
//   C = A + (w x v, 0),   V = (v, w)       acceleration of the point whose velocity V gives
//   V = J v                                dV/dv = J
//   d/dt V = J a + J_dot v                 J_dot = sum_j H_j v_j,  H_j = dJ/dq_j
//   kLocal, kWorld:      d/dt V = A        the derivative of the motion relative to F, or to the world's origin
//   kLocalWorldAligned:  d/dt V = C        the derivative of the velocity of a point: C, not A
//   dA/da = dC/da = J;   d(d/dt V)/dv = J_dot + dV/dq
// The placement itself, by an increment in its own frame (J in kLocal): X_WF(q (+) d) = X_WF exp(J d + ...).
//
// Formulas, docs/math.md (K.6) and (K.8) to (K.12).  J_j: column j; i its body, p the parent of i; V, A of the
// frame; all in the requested frame; (m)l and (m)w are linear and angular part:
//            kLocal                      kWorld              kLocalWorldAligned
//   J_dot_j  J_j x (V - V_i)             V_i x J_j           (w_i x l_j + w_j x (V - V_i)l, w_i x w_j)
//   dV/dq_j  V_p x J_j                   J_j x (V - V_p)     (w_p x l_j + w_j x (V - V_p)l, w_j x (V - V_p)w)
//   dA/dq_j  A_p x J_j + c_j             J_j x (A - A_p) + c_j
//                                    (wd_p x l_j + w_j x (A - A_p)l, w_j x (A - A_p)w) + c_j
//   dA/dv_j  J_j x (V - V_i) + V_p x J_j in all three        c_j = (V_p x J_j) x (V - V_p)
// Cost: O(depth of the frame) products; the Hessian O(depth^2).
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>

#include <vector>

namespace dyntape::dynamics {

template <class T>
struct KinematicDerivatives {
  explicit KinematicDerivatives(const Model<T>& model);

  // Results, in the requested frame.
  Motion<T> V, A, C;         // velocity, spatial and classical acceleration
  Matrix6X<T> J, J_dot;      // (6 x nv) J = dV/dv = dA/da = dC/da
  Matrix6X<T> dV_dq;         // (6 x nv)
  Matrix6X<T> dA_dq, dA_dv;  // (6 x nv)
  Matrix6X<T> dC_dq, dC_dv;  // (6 x nv)
  MatrixX<T> fH;             // (nv x nv) a 6-vector times the Hessian

  // Working memory.
  std::vector<int> support;     // dofs that move the frame, from the frame to the root
  std::vector<int> fH_support;  // of the last fH
  std::vector<Motion<T>> S;     // (nv) their columns J_j
  std::vector<Motion<T>> v, a;  // (njoints) motions of the bodies
};

// After forward_kinematics(q, v): K.V, K.J, K.J_dot.
template <class T>
const Matrix6X<T>& frame_jacobian_rate(const Model<T>& model, const Data<T>& data, KinematicDerivatives<T>& K,
                                       Place frame, ReferenceFrame in);

// After forward_kinematics(q, v): K.V, K.J, K.dV_dq.
template <class T>
void frame_velocity_derivatives(const Model<T>& model, const Data<T>& data, KinematicDerivatives<T>& K,
                                Place frame, ReferenceFrame in);

// After forward_kinematics(q, v, a): all first-order results, K.V ... K.dC_dv.
template <class T>
void frame_acceleration_derivatives(const Model<T>& model, const Data<T>& data, KinematicDerivatives<T>& K,
                                    Place frame, ReferenceFrame in);

// H_kj = dJ_k/dq_j, six entries each.  If j and k are of different joints, n is the one nearer to the root and m the
// other; else they are of one joint:
//                        kLocal           kWorld           kLocalWorldAligned
//   n = k, m = j         J_k x J_j        0                (w_k x l_j, 0)
//   n = j, m = k         0                J_j x J_k        (w_j x l_k, w_j x w_k)
//   one joint            0                J_j x J_k        (w_j x l_k, w_j x w_k)
// Increments of one joint do not commute, and the axes of kLocal and kWorld move:
//   H_kj - H_jk = J_k x J_j (kLocal), J_j x J_k (kWorld), (0, w_j x w_k) (kLocalWorldAligned), two joints
// (one joint: 0 in kLocal).  Linear part in kLocalWorldAligned, two joints: the Hessian of the position of
// the frame, symmetric.
template <class T>
struct KinematicHessian {
  explicit KinematicHessian(const Model<T>& model);

  // dJ/dq_j (6 x nv)
  auto slice(int j) const { return H.middleCols(j * nv, nv); }

  int nv;
  Matrix6X<T> H;  // (6 x nv nv) column nv j + k: dJ_k/dq_j

  // Working memory.
  std::vector<int> support;
  std::vector<Motion<T>> S;  // (nv)
};

// After forward_kinematics(q).  Cost: at most one product of motions per pair of supporting dofs.
template <class T>
const Matrix6X<T>& frame_hessian(const Model<T>& model, const Data<T>& data, KinematicHessian<T>& K,
                                 Place frame, ReferenceFrame in);

// fH_kj = f . H_kj without H: the derivative of the torques J^T f, with f constant in the requested frame.
// Quadratic forms depend on its symmetric part only: v^T fH v = f . (J_dot v), so (fH + fH^T) / 2 is the second
// derivative of a pose along q (+) v t, weighted by f.  Cost: six products per pair.  After forward_kinematics(q).
template <class T>
const MatrixX<T>& frame_weighted_hessian(const Model<T>& model, const Data<T>& data,
                                         KinematicDerivatives<T>& K, Place frame, ReferenceFrame in,
                                         const Force<T>& f);

}  // namespace dyntape::dynamics
