// SPDX-License-Identifier: BSD-3-Clause
//
// The ground for contacts: a plane, or a wavy slope.
//
//   Ground<double> ground;                                 // the plane z = 0
//   ground.normal = {0.1, 0, 1}, ground.offset = 0.2;      // any nonzero length; offset (m) along the unit normal
//
//   kPlane  distance = n . p - offset,                     n = normal / |normal|
//   kWaves  distance = (z - h(x, y)) n_z,                  n = (-h_x, -h_y, 1) n_z,  n_z = 1 / sqrt(1 + h_x^2 + h_y^2)
//           h = offset + slope . (x, y) + amplitude sin(wave . (x, y));  slope and wave (1/m) use x and y only
// The distance is exact for a plane and for a slope.  For waves it is exact to first order near the ground: the
// distance to the tangent plane below the point.  Infinitely often differentiable.
#pragma once

#include <dyntape/dynamics/algebra/vec3.h>
#include <dyntape/dynamics/effects/parameters.h>

namespace dyntape::dynamics {

enum class GroundKind { kPlane, kWaves };

// Distance and normal at a point p; world axes.
template <class T>
struct GroundBelow {
  T distance = T(0);                       // m
  Vector3<T> normal = Vector3<T>::Zero();  // outwards
};

template <class T>
struct GroundSlopes {
  Vector3<T> distance = Vector3<T>::Zero();  // gradient by p
  Matrix3<T> normal = Matrix3<T>::Zero();    // dn/dp
};

template <class T>
struct Ground {
  GroundKind kind = GroundKind::kPlane;
  Vector3<T> normal{T(0), T(0), T(1)};
  T offset = T(0);
  Vector3<T> slope = Vector3<T>::Zero();  // uses x and y
  T amplitude = T(0);                     // m
  Vector3<T> wave = Vector3<T>::Zero();   // rad/m, along x and y

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(
        ParameterInfo{.name = "ground", .unit = "", .what = "shape of the ground", .choices = "plane waves"},
        self.kind);
    visit(ParameterInfo{.name = "normal",
                        .unit = "1",
                        .what = "upward normal of the plane, of any length",
                        .fallback = 0},
          self.normal);
    visit(
        ParameterInfo{
            .name = "offset", .unit = "m", .what = "height of the ground along the normal", .fallback = 0},
        self.offset);
    visit(
        ParameterInfo{
            .name = "slope", .unit = "1", .what = "of waves: mean slope along x and y", .fallback = 0},
        self.slope);
    visit(ParameterInfo{.name = "amplitude", .unit = "m", .what = "of waves: amplitude", .fallback = 0},
          self.amplitude);
    visit(
        ParameterInfo{
            .name = "wave", .unit = "rad/m", .what = "of waves: wave number along x and y", .fallback = 0},
        self.wave);
  }

  GroundBelow<T> below(const Vector3<T>& p) const {
    if (kind == GroundKind::kPlane) {
      const Vector3<T> n = unit_normal();
      return {n.dot(p) - offset, n};
    }
    T s, c;
    sincos(phase(p), s, c);
    const Vector3<T> up = upwards(c);
    const T n_z = T(1) / sqrt(up.dot(up));
    const T height = offset + slope[0] * p[0] + slope[1] * p[1] + amplitude * s;
    return {(p[2] - height) * n_z, up * n_z};
  }
  // n_z' = - n_z^2 n . u',  n' = n_z (1 - n n^T) u',  u = (-h_x, -h_y, 1).
  GroundSlopes<T> derivatives(const Vector3<T>& p, const GroundBelow<T>& at) const {
    if (kind == GroundKind::kPlane) return {at.normal, Matrix3<T>::Zero()};
    T s, c;
    sincos(phase(p), s, c);
    const Vector3<T> k{wave[0], wave[1], T(0)};
    const Vector3<T>& n = at.normal;
    const Matrix3<T> du = outer(Vector3<T>(k * T(amplitude * s)), k);
    const Matrix3<T> along = outer(n, transposed_times(du, n));
    return {n - transposed_times(du, n) * at.distance * n[2], (du - along) * n[2]};
  }
  Vector3<T> unit_normal() const { return normal * T(T(1) / sqrt(normal.dot(normal))); }
  T phase(const Vector3<T>& p) const { return wave[0] * p[0] + wave[1] * p[1]; }
  Vector3<T> upwards(const T& cosine) const {
    const T steep = amplitude * cosine;
    return {-(slope[0] + wave[0] * steep), -(slope[1] + wave[1] * steep), T(1)};
  }
};

}  // namespace dyntape::dynamics
