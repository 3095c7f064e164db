// SPDX-License-Identifier: BSD-3-Clause
//
// Sums over body i and all beyond it, in frame i: masses, momenta, forces.  After place_joints.
#pragma once

#include <dyntape/dynamics/algorithms/detail/checks.hxx>

namespace dyntape::dynamics::detail {

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

// What is of body i becomes the sum over body i and all beyond it.
template <class T, class Sum>
void gather(const Model<T>& model, const Data<T>& data, std::vector<Sum>& sums) {
  for (int i = model.njoints() - 1; i >= 0; --i) {
    const int p = model.parent[i];
    if (p >= 0) accumulate(data.X_PB[i], sums[i], sums[p]);
  }
}

template <class T>
void gather_composites(const Model<T>& model, const Data<T>& data, std::vector<Composite<T>>& composites) {
  for (int i = 0; i < model.njoints(); ++i) composites[i] = composite(model.inertias[i]);
  gather(model, data, composites);
}

template <class T>
void gather_velocity_products(const Model<T>& model, const Data<T>& data,
                              std::vector<VelocityProduct<T>>& products) {
  for (int i = 0; i < model.njoints(); ++i) {
    products[i] = velocity_product(composite(model.inertias[i]), data.v[i]);
  }
  gather(model, data, products);
}

}  // namespace dyntape::dynamics::detail
