// SPDX-License-Identifier: BSD-3-Clause
//
// Compliant contact of spheres and capsules on bodies with the ground (Hunt and Crossley), with smooth friction.
//
//   ContactBody<double> foot;
//   place_at_frame(model, "foot", foot);
//   foot.radius = 0.02, foot.stiffness = 1e5, foot.dissipation = 0.5, foot.friction = 0.8;
//   effects.contacts.push_back(foot);                        // ground: the plane z = 0 (ground.h)
//
// A contact is a sphere about the frame's origin c (radius 0: a point), or two, at both ends of a capsule.  With n
// the ground's normal below c, its distance phi, and the velocity u of the body's point at c - radius n:
//   x = radius - phi, x' = - n . u, u_t = u + n x'         penetration (m), its rate, sliding
//   f_n = k x^p max(0, 1 + d x')  for x > 0, exactly 0 elsewhere; p = 1, 1.5 (Hertz: spheres) or 2
//   f_t = - mu f_n tanh(|u_t| / eps) u_t / |u_t|,          |u_t| / eps computed as sqrt(u_t . u_t / eps^2 + 1e-16)
// act at c - radius n.  The normal force never pulls.  A body at rest on a slope theta creeps with eps
// atanh(tan(theta) / mu).
//
// Energy: the spring stores k x^(p+1) / (p+1) on a plane; d and mu dissipate.
//
// Smoothness in x: C^0 for p = 1, C^1 for p = 1.5 and 2.  At onset the second derivative of x^1.5, 0.75 / sqrt(x),
// is unbounded, but finite for each x > 0 and zero for x <= 0; that of x^2 jumps from 0 to 2.  In x' there is a kink
// at - 1 / d, where the body leaves faster than the ground follows.  Friction is infinitely often differentiable in
// u_t.  Derivatives are analytic (detail/contacts.hxx).
//
// Restitution e at speed v, for any k, p and mass:
//   d v - ln(1 + d v) = - d e v - ln(1 - d e v)
// Source: K. Hunt, F. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Applied
// Mechanics 42, 1975.
#pragma once

#include <dyntape/dynamics/effects/ground.h>
#include <dyntape/dynamics/effects/point_forces.h>

namespace dyntape::dynamics {

enum class ContactExponent { kOne, kThreeHalves, kTwo };

template <class T>
struct ContactBody {
  int body = -1;  // set by place_at_frame
  Placement<T> X_BF;
  T radius = T(0);                            // m
  std::optional<Vector3<T>> second_end = {};  // for a capsule, in the frame (m); its first end is the origin
  T stiffness = T(0);                         // k, N/m^p
  ContactExponent exponent = ContactExponent::kThreeHalves;  // p
  T dissipation = T(0);                                      // d, s/m
  T friction = T(0);                                         // mu

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(ParameterInfo{.name = "radius",
                        .unit = "m",
                        .what = "radius of the sphere; 0: a point",
                        .least = 0,
                        .fallback = 0},
          self.radius);
    visit(ParameterInfo{.name = "second_end",
                        .unit = "m",
                        .what = "centre of the other end of a capsule, in the link's axes"},
          self.second_end);
    visit(ParameterInfo{.name = "stiffness",
                        .unit = "N/m^exponent",
                        .what = "coefficient of the normal force: force = stiffness * penetration^exponent",
                        .least = 0},
          self.stiffness);
    visit(ParameterInfo{.name = "exponent",
                        .unit = "1",
                        .what = "exponent of the penetration in the normal force",
                        .choices = "1 1.5 2"},
          self.exponent);
    visit(ParameterInfo{.name = "dissipation",
                        .unit = "s/m",
                        .what = "damping: the force grows by this fraction per speed of approach",
                        .least = 0,
                        .fallback = 0},
          self.dissipation);
    visit(
        ParameterInfo{
            .name = "friction", .unit = "1", .what = "friction coefficient", .least = 0, .fallback = 0},
        self.friction);
  }
};

template <class T>
struct Contacts;

// For a sphere about the point.
template <class T>
struct ContactLaw {
  const ContactBody<T>& item;
  const Contacts<T>& all;

  Force<T> force(const PointMotion<T>& at) const;
  PointDerivatives<T> derivatives(const PointMotion<T>& at) const;
  T stored_energy(const PointMotion<T>& at) const;
};

template <class T>
struct Contacts : EffectList<ContactBody<T>> {
  static constexpr const char *kName = "contacts", *kKey = "contacts", *kItem = "contact";
  static constexpr bool kReadsVelocity = true;
  using EffectList<ContactBody<T>>::EffectList;

  Ground<T> ground;
  T slip = T(1e-3);  // eps, m/s

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    Ground<T>::visit_parameters(self.ground, visit);
    visit(ParameterInfo{.name = "slip",
                        .unit = "m/s",
                        .what = "sliding speed at which friction nearly reaches its full force",
                        .least = 0,
                        .above = true,
                        .fallback = 1e-3},
          self.slip);
  }
  template <class Visit>
  void for_each_point(Visit visit) const {
    for (const ContactBody<T>& item : *this) {
      visit(item.body, item.X_BF.p, ContactLaw<T>{item, *this});
      if (!item.second_end) continue;
      visit(item.body, Vector3<T>(item.X_BF.R * *item.second_end + item.X_BF.p), ContactLaw<T>{item, *this});
    }
  }
};

}  // namespace dyntape::dynamics
