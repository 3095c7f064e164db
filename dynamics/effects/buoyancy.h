// SPDX-License-Identifier: BSD-3-Clause
//
// Buoyancy of bodies that are completely under water.
//
//   Buoy<double> hull;
//   place_at_frame(model, "hull_centre", hull), hull.volume = 0.05;
//   effects.buoyancy.push_back(hull);
//
//   F = (0, 0, rho g V) at the frame's origin, world axes       (Archimedes)
// Energy: stores E = - rho g V z.  Smooth; derivatives are those of a wrench fixed in the world.
#pragma once

#include <dyntape/dynamics/effects/point_forces.h>

namespace dyntape::dynamics {

template <class T>
struct Buoy {
  int body = -1;  // set by place_at_frame
  Placement<T> X_BF;
  T volume = T(0);  // V, m^3

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(ParameterInfo{.name = "volume", .unit = "m^3", .what = "displaced volume", .least = 0},
          self.volume);
  }
};

template <class T>
struct Buoyancy : EffectList<Buoy<T>> {
  static constexpr const char *kName = "buoyancy", *kKey = "buoyancy", *kItem = "body";
  using EffectList<Buoy<T>>::EffectList;

  T density = T(1000);  // rho, kg/m^3
  T gravity = T(9.81);  // g, m/s^2

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(ParameterInfo{.name = "density",
                        .unit = "kg/m^3",
                        .what = "density of the water",
                        .least = 0,
                        .fallback = 1000},
          self.density);
    visit(ParameterInfo{.name = "gravity",
                        .unit = "m/s^2",
                        .what = "acceleration of free fall that causes the pressure, along -z",
                        .least = 0,
                        .fallback = 9.81},
          self.gravity);
  }
  void add_wrenches(const Data<T>& data, WrenchTorques<T>& w) const {
    for (const Buoy<T>& buoy : *this) {
      if (buoy.body >= 0) add_point_force(data, w, buoy.body, buoy.X_BF.p, {lift(buoy), Vector3<T>::Zero()});
    }
  }
  T stored_energy(const Model<T>&, const Data<T>& data, const VectorRef<T>&) const {
    T energy = T(0);
    for (const Buoy<T>& buoy : *this) {
      if (buoy.body < 0) continue;
      const Placement<T>& X = data.X_WB[buoy.body];
      energy -= lift(buoy)[2] * (X.R * buoy.X_BF.p + X.p)[2];
    }
    return energy;
  }
  Vector3<T> lift(const Buoy<T>& buoy) const { return {T(0), T(0), density * gravity * buoy.volume}; }
};

}  // namespace dyntape::dynamics
