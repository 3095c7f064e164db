// SPDX-License-Identifier: BSD-3-Clause
//
// Drag of bodies in a medium with constant velocity: wind, or a current of water.
//
//   DragBody<double> fin;
//   place_at_frame(model, "fin", fin), fin.area = 0.02;           // drag coefficient times area
//   effects.drag.push_back(fin), effects.drag.medium = {5, 0, 0};
//
//   F = - (rho A |u| / 2 + b) u       u = velocity of the frame's origin minus that of the medium, world axes
//   |u| = sqrt(u . u + eps^2)         has derivatives of all orders at rest
// Energy: dissipates motion relative to the medium; wind may supply energy.  Infinitely often differentiable;
// derivative by the velocity - (rho A |u| / 2 + b) 1 - rho A u u^T / (2 |u|).  Source: L. Landau, E. Lifshitz, Fluid
// Mechanics, 45.
#pragma once

#include <dyntape/dynamics/effects/point_forces.h>

namespace dyntape::dynamics {

template <class T>
struct DragBody {
  int body = -1;  // set by place_at_frame
  Placement<T> X_BF;
  T area = T(0);    // drag coefficient times area, m^2
  T linear = T(0);  // b, N s/m

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(
        ParameterInfo{.name = "area",
                      .unit = "m^2",
                      .what = "drag coefficient times area, for drag that grows with the square of the speed",
                      .least = 0,
                      .fallback = 0},
        self.area);
    visit(ParameterInfo{.name = "linear",
                        .unit = "N s/m",
                        .what = "force per velocity, for drag that grows with the speed",
                        .least = 0,
                        .fallback = 0},
          self.linear);
  }
};

template <class T>
struct Drag : EffectList<DragBody<T>> {
  static constexpr const char *kName = "drag", *kKey = "drag", *kItem = "body";
  static constexpr bool kReadsVelocity = true;
  using EffectList<DragBody<T>>::EffectList;

  Vector3<T> medium = Vector3<T>::Zero();  // velocity in the world, m/s
  T density = T(1.2);                      // rho, kg/m^3
  T smoothing = T(1e-3);                   // eps, m/s

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(ParameterInfo{.name = "medium",
                        .unit = "m/s",
                        .what = "velocity of the medium in the world: wind or current",
                        .fallback = 0},
          self.medium);
    visit(ParameterInfo{.name = "density",
                        .unit = "kg/m^3",
                        .what = "density of the medium",
                        .least = 0,
                        .fallback = 1.2},
          self.density);
    visit(ParameterInfo{.name = "smoothing",
                        .unit = "m/s",
                        .what = "makes drag smooth at rest: |v| is sqrt(v^2 + smoothing^2)",
                        .least = 0,
                        .above = true,
                        .fallback = 1e-3},
          self.smoothing);
  }

  struct Law {
    const DragBody<T>& item;
    const Drag& all;

    T half_rho_area() const { return all.density * item.area * T(0.5); }
    T speed(const Vector3<T>& u) const { return sqrt(T(u.dot(u) + all.smoothing * all.smoothing)); }
    Force<T> force(const PointMotion<T>& at) const {
      const Vector3<T> u = at.v - all.medium;
      return {-(u * T(half_rho_area() * speed(u) + item.linear)), Vector3<T>::Zero()};
    }
    PointDerivatives<T> derivatives(const PointMotion<T>& at) const {
      const Vector3<T> u = at.v - all.medium;
      const T s = speed(u);
      PointDerivatives<T> D;
      D.f_v = -(Matrix3<T>::Identity() * T(half_rho_area() * s + item.linear) +
                outer(u, Vector3<T>(u * T(half_rho_area() / s))));
      return D;
    }
  };
  template <class Visit>
  void for_each_point(Visit visit) const {
    for (const DragBody<T>& item : *this) visit(item.body, item.X_BF.p, Law{item, *this});
  }
};

}  // namespace dyntape::dynamics
