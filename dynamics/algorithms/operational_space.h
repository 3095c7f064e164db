// SPDX-License-Identifier: BSD-3-Clause
//
// Operational space: how a frame answers to forces, and the joint torques that give it an acceleration.
//
//   OperationalSpace<double> space(model, {0, 1, 2});                    // the position of the frame
//   const auto in = ReferenceFrame::kLocalWorldAligned;
//   operational_space(model, data, space, q, v, frame, in, {.damping = 1e-3});
//   const VectorX<double>& tau = operational_torque(model, data, space, q, v, x_dd, &posture);
//
// Task.  x_d = J v with chosen rows of the frame's six (0..2 linear, 3..5 angular), m of them;
//   x_dd = J a + J_dot v
// is the rate of x_d in the frame asked for (kinematic_derivatives.h): in kLocalWorldAligned its linear part
// is the acceleration of the frame's origin.  With the equation of motion of algorithms.h (O. Khatib, A
// Unified Approach for Motion and Force Control of Robot Manipulators, IEEE J. Robotics and Automation,
// 1987):
//   Lambda^-1 = J M^-1 J^T                         mobility: acceleration by a unit force (1/kg, 1/(kg m^2))
//   J_bar     = M^-1 J^T Lambda                    dynamically consistent inverse, J J_bar = 1
//   tau       = J^T F + tau_0 + h,   F = Lambda (x_dd - J_dot v - J M^-1 tau_0)
//             = J^T Lambda (x_dd - J_dot v) + (1 - J^T J_bar^T) tau_0 + h
// and, what F must overcome besides, mu = Lambda (J M^-1 h - J_dot v):  Lambda x_dd + mu = F under tau = J^T F.
// x_dd is exact for any tau_0.  Torques act on all dofs: those of a free-flyer are a wrench that somebody
// must supply.
//
// Singularities.  Let D be the mean mobility of the frame, one number for linear rows and one for angular
// ones, and C = D^-1/2 Lambda^-1 D^-1/2 (no units).  With a damping delta > 0 the mobility is lifted where
// C is nearly singular, and only in the directions in which it is (e = delta / 8):
//   C_delta = C + phi delta e (C + e)^-1,   phi = max(0, 1 - s / delta)^2,   s = 1 / tr (C + e)^-1
// Where no eigenvalue of C is below m delta nothing changes, not a bit; C_delta has none below delta / 3
// anywhere, so F is bounded; it is differentiable, once, where phi starts.  There is no branch.
// docs/math.md (K.19) to (K.22).
//
// Shapes: q (nq), v, tau_0 (nv), x_dd (m).  ArgumentError when a size does not fit, for rows that are no
// rows, for a negative damping.  Nothing is allocated.
#pragma once

#include <dyntape/dynamics/algorithms/kinematic_derivatives.h>

#include <vector>

namespace dyntape::dynamics {

template <class T>
struct OperationalSpace {
  explicit OperationalSpace(const Model<T>& model, const std::vector<int>& rows = {0, 1, 2, 3, 4, 5});

  int size() const { return static_cast<int>(rows.size()); }

  std::vector<int> rows;  // (m)

  // Results.
  MatrixX<T> J;               // (m x nv)
  VectorX<T> J_dot_v;         // (m)
  MatrixX<T> Lambda_inverse;  // (m x m) undamped
  MatrixX<T> Lambda;          // (m x m)
  MatrixX<T> J_bar;           // (nv x m)
  T phi = T(0);               // in [0, 1): how much of the damping acts
  VectorX<T> F, mu;           // (m)
  VectorX<T> tau;             // (nv)

  // Working memory.
  KinematicDerivatives<T> kinematics;
  Matrix6X<T> J_Minv;    // (6 x nv) of all rows of the frame
  Matrix6<T> mobility;   // J M^-1 J^T of all rows
  VectorX<T> D;          // (m)
  MatrixX<T> A, L;       // (m x m) what is factored; its factor
  VectorX<T> D_inverse;  // (m)
  MatrixX<T> A_inverse;  // (m x m)
};

struct OperationalOptions {
  double damping = 0;  // delta; 0: none, and Lambda is infinite at a singularity
};

// J, J_dot_v, Lambda_inverse, Lambda, J_bar, phi; data.Minv and what forward_kinematics(q, v) leaves.
template <class T>
void operational_space(const Model<T>& model, Data<T>& data, OperationalSpace<T>& space,
                       const VectorRef<T>& q, const VectorRef<T>& v, int frame, ReferenceFrame in,
                       const OperationalOptions& options = {}, const DynamicsTerms<T>& acting = {});

// After operational_space at this q and v: space.F, space.tau, and data.nle (= h).
template <class T>
const VectorX<T>& operational_torque(const Model<T>& model, Data<T>& data, OperationalSpace<T>& space,
                                     const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& x_dd,
                                     const VectorX<T>* tau_0 = nullptr, const DynamicsTerms<T>& acting = {});

// After operational_space at this q and v: space.mu, and data.nle (= h).
template <class T>
const VectorX<T>& operational_bias(const Model<T>& model, Data<T>& data, OperationalSpace<T>& space,
                                   const VectorRef<T>& q, const VectorRef<T>& v,
                                   const DynamicsTerms<T>& acting = {});

}  // namespace dyntape::dynamics
