// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/algorithms/energy.h>
#include <dyntape/dynamics/algorithms/detail/added_terms.hxx>
#include <dyntape/dynamics/algorithms/detail/subtree_sums.hxx>

namespace dyntape::dynamics {
namespace detail {

// Column k of dg/dq, and the row that mirrors it; f: weight on body i and all beyond it.
template <class T>
void gravity_column(const Model<T>& model, const Data<T>& data, EnergyGradients<T>& e, const Force<T>& f,
                    int i, int k) {
  const Tree& tree = data.tree;
  const Dof& S = tree.dofs[k];
  // The weight as the joint's own columns see it turn, and what its turning adds to the joints before.
  const Motion<T> S_ddot = cross(Motion<T>{e.against_fall[i], Vector3<T>::Zero()}, S);
  const Force<T> own = e.moments[i] * S_ddot;
  for (int r = tree.first[i]; r < tree.first[i] + tree.count[i]; ++r) e.dg_dq(r, k) = dot(tree.dofs[r], own);
  Vector3<T> couple = own.angular + cross(S, f).angular;
  for (int j = i; model.parent[j] >= 0;) {
    couple = data.X_PB[j].R * couple;
    j = model.parent[j];
    for (int r = tree.first[j]; r < tree.first[j] + tree.count[j]; ++r) {
      if (tree.dofs[r].angular) e.dg_dq(r, k) = e.dg_dq(k, r) = dot(tree.dofs[r].axis, couple);
    }
  }
}

}  // namespace detail

template <class T>
void kinetic_energy_gradients(const Model<T>& model, Data<T>& data, EnergyGradients<T>& e,
                              const VectorRef<T>& q, const VectorRef<T>& v, const DynamicsTerms<T>& acting) {
  detail::check_arguments("kinetic_energy_gradients", model, data, q, &v);
  detail::check("kinetic_energy_gradients", "gradients", model, e.zero.size(), model.nv);
  detail::check_count("kinetic_energy_gradients", "gradients", model, std::ssize(e.momentum));
  detail::check_acting("kinetic_energy_gradients", model, acting);
  detail::place_joints(model, data, q);
  const Tree& tree = data.tree;
  T twice = T(0);
  for (int i = 0; i < model.njoints(); ++i) {
    detail::move_body(model, data, v, i);
    e.momentum[i] = model.inertias[i] * data.v[i];
  }
  detail::for_each_added(
      acting, [&](int i, const Articulated<T>& D) { e.momentum[i] = e.momentum[i] + D * data.v[i]; });
  for (int i = 0; i < model.njoints(); ++i) twice += dot(data.v[i], e.momentum[i]);
  detail::gather(model, data, e.momentum);
  for (int i = 0; i < model.njoints(); ++i) {
    const int p = model.parent[i];
    const Motion<T> v_p = p < 0 ? Motion<T>{} : act_inverse(data.X_PB[i], data.v[p]);
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
      e.dT_dq[k] = dot(cross(v_p, tree.dofs[k]), e.momentum[i]);
      e.dT_dv[k] = dot(tree.dofs[k], e.momentum[i]);
      if (!detail::has_armature(model, acting, i)) continue;
      const T rotor = detail::armature_at(model, acting, i) * v[k];
      e.dT_dv[k] += rotor;
      twice += rotor * v[k];
    }
  }
  data.kinetic_energy = twice * T(0.5);
}

template <class T>
const MatrixX<T>& gravity_derivatives(const Model<T>& model, Data<T>& data, EnergyGradients<T>& e,
                                      const VectorRef<T>& q) {
  detail::check_arguments("gravity_derivatives", model, data, q);
  detail::check("gravity_derivatives", "gradients", model, e.zero.size(), model.nv);
  detail::check_count("gravity_derivatives", "gradients", model, std::ssize(e.momentum));
  detail::place_joints(model, data, q);
  detail::gather_moments(model, data, e.moments);
  const Tree& tree = data.tree;
  for (int i = 0; i < model.njoints(); ++i) {
    const int p = model.parent[i];
    const Vector3<T> before = p < 0 ? Vector3<T>(-model.gravity) : e.against_fall[p];
    e.against_fall[i] = data.X_PB[i].R.transpose() * before;
    const Force<T> f = e.moments[i] * Motion<T>{e.against_fall[i], Vector3<T>::Zero()};
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
      data.g[k] = dot(tree.dofs[k], f);
      detail::gravity_column(model, data, e, f, i, k);
    }
  }
  return e.dg_dq;
}

template <class T>
void nonlinear_effects_derivatives(const Model<T>& model, Data<T>& data, EnergyGradients<T>& e,
                                   const VectorRef<T>& q, const VectorRef<T>& v,
                                   const DynamicsTerms<T>& acting) {
  detail::check("nonlinear_effects_derivatives", "gradients", model, e.zero.size(), model.nv);
  detail::check_count("nonlinear_effects_derivatives", "gradients", model, std::ssize(e.momentum));
  id_derivatives<T>(model, data, q, v, e.zero, acting);
  data.nle = data.tau;
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_ENERGY(T, ...)                  \
  DYNTAPE_COMPILE(kinetic_energy_gradients, T, __VA_ARGS__) \
  DYNTAPE_COMPILE(gravity_derivatives, T, __VA_ARGS__)      \
  DYNTAPE_COMPILE(nonlinear_effects_derivatives, T, __VA_ARGS__)

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_ENERGY)
