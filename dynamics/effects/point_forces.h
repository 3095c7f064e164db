// SPDX-License-Identifier: BSD-3-Clause
//
// Forces that depend on position and velocity of a point of a body: the common part of contacts, drag and buoyancy.
//
// Such an effect defines its points and a law:
//   for_each_point(visit)             calls visit(body, r, law): the point at r in the frame of body `body`; -1: the
//                                     world
//   law.force(at)                     force, and moment about the point, in the world's axes
//   law.derivatives(at)                    its derivatives (PointDerivatives)
//   law.stored_energy(at)             the potential energy, if any (J)
// The functions here compute torques and derivatives from these.  With J = (J_p, J_w) the Jacobian of the point in
// the
// world's axes, V = (v, w) = J v, and the wrench W(p, V) = (f, m):
//   tau = J^T W
//   dtau/dq = d(J^T W)/dq at constant W + J^T (dW/dp J_p + dW/dV dV/dq)        dtau/dv = J^T dW/dV J
// The first term is that of a wrench fixed in the world (wrenches.h); dV/dq as in kinematic_derivatives.h.
#pragma once

#include <dyntape/dynamics/effects/wrenches.h>

namespace dyntape::dynamics {

template <class T>
struct KinematicDerivatives;

// World axes: position (m), velocity (m/s), angular velocity of the body (rad/s).
template <class T>
struct PointMotion {
  Vector3<T> p = Vector3<T>::Zero(), v = Vector3<T>::Zero(), w = Vector3<T>::Zero();
};

// Derivatives of the force f and the moment m by p, v and w; the moment may have none.
template <class T>
struct PointDerivatives {
  Matrix3<T> f_p = Matrix3<T>::Zero(), f_v = Matrix3<T>::Zero(), f_w = Matrix3<T>::Zero();
  Matrix3<T> m_p = Matrix3<T>::Zero(), m_v = Matrix3<T>::Zero(), m_w = Matrix3<T>::Zero();
};

// After forward_kinematics(q, v), body >= 0.
template <class T>
PointMotion<T> point_motion(const Data<T>& data, int body, const Vector3<T>& r);

// Adds to w.sums.
template <class T>
void add_point_force(const Data<T>& data, WrenchTorques<T>& w, int body, const Vector3<T>& r,
                     const Force<T>& force);

// Subtracts J^T (dW/dp J_p + dW/dV dV/dq) from data.dtau_dq and J^T dW/dV J from data.dtau_dv.
template <class T>
void subtract_point_slopes(const Model<T>& model, Data<T>& data, KinematicDerivatives<T>& K, int body,
                           const Vector3<T>& r, const PointDerivatives<T>& derivatives);

}  // namespace dyntape::dynamics
