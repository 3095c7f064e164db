// SPDX-License-Identifier: BSD-3-Clause
//
// Sums over body i and all beyond it, in frame i: masses, momenta, forces.  After place_joints.
#pragma once

#include <dyntape/dynamics/algorithms/detail/checks.hxx>

namespace dyntape::dynamics::detail {

// 1 / mass, or zero for what weighs nothing.
template <class T>
T per_mass(const T& mass) {
  return select(mass > T(0), T(1) / select(mass > T(0), mass, T(1)), T(0));
}

// Velocity of the parent, seen from body i; data.v.
template <class T>
Motion<T> move_body(const Model<T>& model, Data<T>& data, const VectorRef<T>& v, int i) {
  const int p = model.parent[i];
  const Motion<T> v_p = p < 0 ? Motion<T>{} : act_inverse(data.X_PB[i], data.v[p]);
  data.v[i] = v_p + joint_motion(data, v, i);
  return v_p;
}

// Acceleration of the parent, seen from body i; data.a, without gravity.
template <class T>
Motion<T> accelerate_body(const Model<T>& model, Data<T>& data, const VectorRef<T>& v, const VectorRef<T>& a,
                          int i) {
  const int p = model.parent[i];
  const Motion<T> a_p = p < 0 ? Motion<T>{} : act_inverse(data.X_PB[i], data.a[p]);
  data.a[i] = a_p + bias_motion(data, v, i) + joint_motion(data, a, i);
  return a_p;
}

// Mass and first moment of body i and all beyond it: the part of a composite that places its centre of mass.
template <class T>
void gather_moments(const Model<T>& model, const Data<T>& data, std::vector<Composite<T>>& composites) {
  for (int i = 0; i < model.njoints(); ++i) {
    composites[i].mass = model.inertias[i].mass;
    composites[i].h = model.inertias[i].com * model.inertias[i].mass;
  }
  for (int i = model.njoints() - 1; i >= 0; --i) {
    const int p = model.parent[i];
    if (p < 0) continue;
    const Placement<T>& X = data.X_PB[i];
    composites[p].mass += composites[i].mass;
    composites[p].h += X.R * composites[i].h + X.p * composites[i].mass;
  }
}

template <class T>
void gather_composites(const Model<T>& model, const Data<T>& data, std::vector<Composite<T>>& composites) {
  for (int i = 0; i < model.njoints(); ++i) composites[i] = composite(model.inertias[i]);
  for (int i = model.njoints() - 1; i >= 0; --i) {
    const int p = model.parent[i];
    if (p >= 0) accumulate(data.X_PB[i], composites[i], composites[p]);
  }
}

template <class T>
void gather(const Model<T>& model, const Data<T>& data, std::vector<Force<T>>& sums) {
  for (int i = model.njoints() - 1; i >= 0; --i) {
    const int p = model.parent[i];
    if (p >= 0) sums[p] = sums[p] + act(data.X_PB[i], sums[i]);
  }
}

template <class T>
void gather_velocity_products(const Model<T>& model, const Data<T>& data,
                              std::vector<VelocityProduct<T>>& products) {
  for (int i = 0; i < model.njoints(); ++i) {
    products[i] = velocity_product(composite(model.inertias[i]), data.v[i]);
  }
  for (int i = model.njoints() - 1; i >= 0; --i) {
    const int p = model.parent[i];
    if (p >= 0) accumulate(data.X_PB[i], products[i], products[p]);
  }
}

}  // namespace dyntape::dynamics::detail
