// SPDX-License-Identifier: BSD-3-Clause
//
// Operational space: the inertia of a frame, and the joint torques for a desired acceleration of the frame.
//
//   OperationalSpace<double> space(model, {0, 1, 2});                    // the position of the frame
//   const auto in = ReferenceFrame::kLocalWorldAligned;
//   operational_space(model, data, space, q, v, frame, in, {.damping = 1e-3});
//   const VectorX<double>& tau = operational_torque(model, data, space, q, v, x_dd, &posture);
//
// Task.  x_d = J v with m selected rows of the frame's six (0..2 linear, 3..5 angular);
//   x_dd = J a + J_dot v
// is the rate of x_d in the requested frame (kinematic_derivatives.h): in kLocalWorldAligned its linear part is the
// acceleration of the frame's origin.  With the equation of motion of algorithms.h:
//   Lambda^-1 = J M^-1 J^T                         mobility: acceleration by a unit force (1/kg, 1/(kg m^2))
//   J_bar     = M^-1 J^T Lambda                    dynamically consistent inverse, J J_bar = 1
//   tau       = J^T F + tau_0 + h,   F = Lambda (x_dd - J_dot v - J M^-1 tau_0)
//             = J^T Lambda (x_dd - J_dot v) + (1 - J^T J_bar^T) tau_0 + h
// and the other forces mu = Lambda (J M^-1 h - J_dot v) in  Lambda x_dd + mu = F  for tau = J^T F.  x_dd is exact
// for any tau_0.  Torques act on all dofs; those of a free-flyer are a wrench that the environment must supply.
//
// Singularities.  Let D be the mean mobility of the frame, one number for linear rows and one for angular rows, and
// C = D^-1/2 Lambda^-1 D^-1/2 (no units).  With a damping delta > 0 the mobility is increased if C is nearly
// singular, in the singular directions only (e = delta / 8):
//   C_delta = C + phi delta e (C + e)^-1,   phi = max(0, 1 - s / delta)^2,   s = 1 / tr (C + e)^-1
// If no eigenvalue of C is below m delta, no bit changes.  No eigenvalue of C_delta is below delta / 3, so F is
// bounded.  C_delta is once differentiable where phi becomes positive.  There is no branch.
//
// Shapes: q (nq), v, tau_0 (nv), x_dd (m).  ArgumentError: a wrong size, invalid rows, a negative damping.  No
// allocation.
//
// Sources: O. Khatib, A Unified Approach for Motion and Force Control of Robot Manipulators, IEEE J. Robotics and
// Automation, 1987; docs/math.md (K.19) to (K.22).
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
  T phi = T(0);               // in [0, 1): fraction of the damping in use
  VectorX<T> F, mu;           // (m)
  VectorX<T> tau;             // (nv)

  // Working memory.
  KinematicDerivatives<T> kinematics;
  Matrix6X<T> J_Minv;    // (6 x nv) of all rows of the frame
  Matrix6<T> mobility;   // J M^-1 J^T of all rows
  VectorX<T> D;          // (m)
  MatrixX<T> A, L;       // (m x m) the factorised matrix; its factor
  VectorX<T> D_inverse;  // (m)
  MatrixX<T> A_inverse;  // (m x m)
};

struct OperationalOptions {
  double damping = 0;  // delta; 0: none, and Lambda is infinite at a singularity
};

// Computes J, J_dot_v, Lambda_inverse, Lambda, J_bar, phi; data.Minv and the results of forward_kinematics(q, v).
template <class T>
void operational_space(const Model<T>& model, Data<T>& data, OperationalSpace<T>& space,
                       const VectorRef<T>& q, const VectorRef<T>& v, int frame, ReferenceFrame in,
                       const OperationalOptions& options = {}, const DynamicsTerms<T>& acting = {});

// After operational_space at this q and v: computes space.F, space.tau, and data.nle (= h).
template <class T>
const VectorX<T>& operational_torque(const Model<T>& model, Data<T>& data, OperationalSpace<T>& space,
                                     const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& x_dd,
                                     const VectorX<T>* tau_0 = nullptr, const DynamicsTerms<T>& acting = {});

// After operational_space at this q and v: computes space.mu, and data.nle (= h).
template <class T>
const VectorX<T>& operational_bias(const Model<T>& model, Data<T>& data, OperationalSpace<T>& space,
                                   const VectorRef<T>& q, const VectorRef<T>& v,
                                   const DynamicsTerms<T>& acting = {});

}  // namespace dyntape::dynamics
