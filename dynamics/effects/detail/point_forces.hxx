// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/effects/point_forces.h>
#include <dyntape/dynamics/algorithms/detail/kinematic_derivatives.hxx>

namespace dyntape::dynamics {
namespace detail {

// dW/dV m.
template <class T>
Force<T> force_slope(const PointDerivatives<T>& D, const Motion<T>& m) {
  return {D.f_v * m.linear + D.f_w * m.angular, D.m_v * m.linear + D.m_w * m.angular};
}

}  // namespace detail

template <class T>
PointMotion<T> point_motion(const Data<T>& data, int body, const Vector3<T>& r) {
  const Placement<T>& X = data.X_WB[body];
  const Motion<T>& V = data.v[body];
  return {X.R * r + X.p, X.R * (V.linear + V.angular.cross(r)), X.R * V.angular};
}

template <class T>
void add_point_force(const Data<T>& data, WrenchTorques<T>& w, int body, const Vector3<T>& r,
                     const Force<T>& force) {
  Wrench<T> wrench;
  wrench.body = body;
  wrench.X_BF.p = r;
  wrench.fixed_in = FixedIn::kWorld;
  wrench.value = force;
  add_wrench(data, w, wrench);
}

template <class T>
void subtract_point_slopes(const Model<T>& model, Data<T>& data, KinematicDerivatives<T>& K, int body,
                           const Vector3<T>& r, const PointDerivatives<T>& D) {
  constexpr auto in = ReferenceFrame::kLocalWorldAligned;
  const detail::Site<T> site{body, {Matrix3<T>::Identity(), r}};
  detail::gather_motions(model, data, K, site, in, detail::Order::kVelocity);
  for (int j : K.support) {
    const Motion<T>& S = K.S[j];
    const Motion<T> turning =
        detail::slope(in, S, detail::parent_motion(model, K.v, data.tree.dofs[j].joint), K.V);
    const Force<T> by_v = detail::force_slope(D, S);
    const Force<T> by_q = detail::force_slope(D, turning) + Force<T>{D.f_p * S.linear, D.m_p * S.linear};
    for (int i : K.support) {
      data.dtau_dq(i, j) -= dot(K.S[i], by_q);
      data.dtau_dv(i, j) -= dot(K.S[i], by_v);
    }
  }
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_POINT_FORCES(T, ...)   \
  DYNTAPE_COMPILE(point_motion, T, __VA_ARGS__)    \
  DYNTAPE_COMPILE(add_point_force, T, __VA_ARGS__) \
  DYNTAPE_COMPILE(subtract_point_slopes, T, __VA_ARGS__)

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_POINT_FORCES)
