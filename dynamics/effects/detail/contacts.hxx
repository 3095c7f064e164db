// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/effects/contacts.h>

namespace dyntape::dynamics {
namespace detail {

// x^p and p x^(p-1), x > 0.
template <class T>
struct ContactPower {
  T value, slope;
};

template <class T>
ContactPower<T> contact_power(ContactExponent exponent, const T& x) {
  if (exponent == ContactExponent::kOne) return {x, T(1)};
  if (exponent == ContactExponent::kTwo) return {x * x, T(2) * x};
  const T root = sqrt(x);
  return {x * root, T(1.5) * root};
}

// Where a sphere touches the ground and what acts there.
template <class T>
struct Touch {
  GroundBelow<T> ground;
  Vector3<T> lever, u, slide;  // of the touching point about the centre; its velocity; along the ground
  T normal_speed;              // n . u
  T push, push_by_depth, push_by_rate;  // f_n and its derivatives by x and x'
  T s, t, drag;  // |u_t| / eps, its tanh, and mu tanh(s) / (s eps): f_t = - f_n drag u_t
};

template <class T>
void press(const ContactBody<T>& item, Touch<T>& c) {
  const T depth = item.radius - c.ground.distance, rate = T(1) - item.dissipation * c.normal_speed;
  const auto touches = depth > T(0);
  const auto pushes = rate > T(0);
  const ContactPower<T> power = contact_power<T>(item.exponent, select(touches, depth, T(1)));
  const T pushing = select(pushes, rate, T(0)), by_rate = select(pushes, item.dissipation, T(0));
  c.push = select(touches, T(item.stiffness * power.value * pushing), T(0));
  c.push_by_depth = select(touches, T(item.stiffness * power.slope * pushing), T(0));
  c.push_by_rate = select(touches, T(item.stiffness * power.value * by_rate), T(0));
}

template <class T>
Touch<T> touch(const ContactBody<T>& item, const Contacts<T>& all, const PointMotion<T>& at) {
  Touch<T> c;
  c.ground = all.ground.below(at.p);
  const Vector3<T>& n = c.ground.normal;
  c.lever = -(n * item.radius);
  c.u = at.v + at.w.cross(c.lever);
  c.normal_speed = n.dot(c.u);
  c.slide = c.u - n * c.normal_speed;
  press(item, c);
  c.s = sqrt(T(c.slide.dot(c.slide) / (all.slip * all.slip) + T(1e-16)));
  c.t = tanh(c.s);
  c.drag = item.friction * (c.t / c.s) / all.slip;
  return c;
}

}  // namespace detail

template <class T>
Force<T> ContactLaw<T>::force(const PointMotion<T>& at) const {
  const detail::Touch<T> c = detail::touch(item, all, at);
  const Vector3<T> f = (c.ground.normal - c.slide * c.drag) * c.push;
  return {f, c.lever.cross(f)};
}

// With e = n - g u_t, g = drag, g' = dg/d(u_t . u_t), x' = - n . u:
//   df = e (f_n,x dx - f_n,x' (n . du + u . dn)) + f_n (dn - g du_t - 2 g' u_t (u_t . du_t))
//   du_t = (1 - n n^T) du - (n u^T + (n . u) 1) dn,       u_t . du_t = u_t . du - (n . u) u_t . dn
//   du = dv + w x d(lever) - lever x dw,  d(lever) = - radius dn,  dx = - d phi
template <class T>
PointDerivatives<T> ContactLaw<T>::derivatives(const PointMotion<T>& at) const {
  const detail::Touch<T> c = detail::touch(item, all, at);
  const GroundSlopes<T> ground = all.ground.derivatives(at.p, c.ground);
  const Matrix3<T> one = Matrix3<T>::Identity();
  const Vector3<T>& n = c.ground.normal;
  const T sharpening = (T(1) - c.t * c.t - c.t / c.s) / (c.s * c.s);
  const T twice_g = item.friction * sharpening / (all.slip * all.slip * all.slip);
  const Vector3<T> e = n - c.slide * c.drag, by_rate = e * c.push_by_rate;
  const T held = c.push * c.drag;
  const Matrix3<T> turn = outer(c.slide, Vector3<T>(c.slide * T(c.push * twice_g)));
  const Matrix3<T> by_u = -outer(by_rate, n) - (one - outer(n, n)) * held - turn;
  PointDerivatives<T> D;
  D.f_v = by_u;
  D.f_w = -(by_u * skew(c.lever));
  D.f_p = -outer(Vector3<T>(e * c.push_by_depth), ground.distance);
  const Matrix3<T> arm = skew(c.lever);
  if (all.ground.kind != GroundKind::kPlane) {
    const Matrix3<T> by_n = -outer(by_rate, c.u) + one * c.push +
                            (outer(n, c.u) + one * c.normal_speed) * held + turn * c.normal_speed;
    D.f_p += (by_n - by_u * skew(at.w) * item.radius) * ground.normal;
    const Vector3<T> f = e * c.push;
    D.m_p = skew(f) * ground.normal * item.radius;
  }
  D.m_p += arm * D.f_p;
  D.m_v = arm * D.f_v;
  D.m_w = arm * D.f_w;
  return D;
}

template <class T>
T ContactLaw<T>::stored_energy(const PointMotion<T>& at) const {
  const T depth = item.radius - all.ground.below(at.p).distance;
  const auto touches = depth > T(0);
  const T x = select(touches, depth, T(1));
  const double p = 1 + 0.5 * static_cast<int>(item.exponent);
  const T energy = item.stiffness * detail::contact_power<T>(item.exponent, x).value * x / T(p + 1);
  return select(touches, energy, T(0));
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_CONTACTS(T, ...) __VA_ARGS__ template struct dyntape::dynamics::ContactLaw<T>;

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_CONTACTS)
