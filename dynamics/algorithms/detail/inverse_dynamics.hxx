// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/algorithms/detail/added_terms.hxx>
#include <dyntape/dynamics/algorithms/detail/checks.hxx>
#include <dyntape/dynamics/algorithms/detail/columns.hxx>

namespace dyntape::dynamics {
namespace detail {

// Forces through the joints, for accelerations in data.a_gf; leaves S^T f in `tau`.
template <class T>
void gather_forces(const Model<T>& model, Data<T>& data, VectorX<T>& tau) {
  const Tree& tree = data.tree;
  for (int i = model.njoints() - 1; i >= 0; --i) {
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) tau[k] = dot(tree.dofs[k], data.f[i]);
    const int p = model.parent[i];
    if (p >= 0) data.f[p] = data.f[p] + act(data.X_PB[i], data.f[i]);
  }
}

// f_i = I a + v x* I v - f_ext; v absent: at rest.  docs/math.md (D.4).
template <class T>
void body_forces(const Model<T>& model, Data<T>& data, bool moving, const DynamicsTerms<T>& acting) {
  for (int i = 0; i < model.njoints(); ++i) {
    const Inertia<T>& I = model.inertias[i];
    data.f[i] = I * data.a_gf[i];
    if (moving) data.f[i] = data.f[i] + cross(data.v[i], I * data.v[i]);
    if (acting.external) data.f[i] = data.f[i] - (*acting.external)[i];
  }
  for_each_added(acting, [&](int i, const Articulated<T>& D) {
    data.f[i] = data.f[i] + added_force(model, data, acting, i, D);
  });
}

template <class T>
void accelerate_bodies(const Model<T>& model, Data<T>& data, const VectorRef<T>* v, const VectorRef<T>* a,
                       const DynamicsTerms<T>& acting) {
  for (int i = 0; i < model.njoints(); ++i) {
    const int p = model.parent[i];
    data.a_gf[i] =
        p < 0 ? root_acceleration(model, data, acting, i) : act_inverse(data.X_PB[i], data.a_gf[p]);
    if (v) data.a_gf[i] = data.a_gf[i] + bias_motion(data, *v, i);
    if (a) data.a_gf[i] = data.a_gf[i] + joint_motion(data, *a, i);
  }
}

// Rows of M of a joint with one column, F_s = I^C_s S_s of those beyond it on their way; its own sets out.
template <class T>
DYNTAPE_INLINE void cross_single_joint(const Model<T>& model, Data<T>& data, int i) {
  const Tree& tree = data.tree;
  const int k = tree.first[i], place = tree.begin[i], end = tree.end[i];
  const bool hung = model.parent[i] >= 0;
  const std::ptrdiff_t stride = data.stride;
  T *F = data.travellers.data(), *row = data.rows.data();
  const Dof& S = tree.dofs[k];
  const Force<T> own = data.composites[i] * S;
  over_before<T>(place, end, [&](int s, auto lanes) {
    lanes.store(row + s, dot_group<T>(S, F + s, stride, lanes));
    if (!hung) return;
    SixLanes<T> f(F + s, stride, lanes);
    for (int e = 0; e < 6; ++e) {
      f.x[e] = with_lane<T>(f.x[e], place - s, e < 3 ? own.linear.at(e) : own.angular.at(e - 3));
    }
    f.act(data.X_PB[i]);
    f.store(F + s, stride, lanes);
  });
  data.M.data()[k + std::ptrdiff_t{k} * model.nv] = dot(S, own);
  mirror(tree, k, place + 1, end, row, data.M);
}

template <class T>
void cross_joint(const Model<T>& model, Data<T>& data, int i) {
  const Tree& tree = data.tree;
  const int first = tree.first[i], last = first + tree.count[i], beyond = tree.begin[i] + tree.count[i];
  const std::ptrdiff_t stride = data.stride, nv = model.nv;
  T *M = data.M.data(), *F = data.travellers.data(), *row = data.rows.data();
  for (int k = first; k < last; ++k) {
    const Force<T> own = data.composites[i] * tree.dofs[k];
    for (int r = first; r <= k; ++r) M[r + k * nv] = M[k + r * nv] = dot(tree.dofs[r], own);
    dot_columns(tree.dofs[k], F, stride, beyond, tree.end[i], row);
    mirror(tree, k, beyond, tree.end[i], row, data.M);
  }
  if (model.parent[i] < 0) return;
  for (int k = first; k < last; ++k) {
    put_spatial(F, stride, tree.place_of[k], data.composites[i] * tree.dofs[k]);
  }
  act_columns<T>(data.X_PB[i], F, stride, tree.begin[i], tree.end[i]);
}

}  // namespace detail

template <class T>
const VectorX<T>& rnea(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                       const VectorRef<T>& a, const DynamicsTerms<T>& acting) {
  detail::check_arguments("rnea", model, data, acting, q, &v, &a);
  detail::place_joints(model, data, q);
  detail::move_bodies(model, data, v, acting);
  detail::accelerate_bodies(model, data, &v, &a, acting);
  detail::body_forces(model, data, true, acting);
  detail::gather_forces(model, data, data.tau);
  for (int i = 0; i < model.njoints(); ++i) {
    const int k = data.tree.first[i];
    if (detail::has_armature(model, acting, i)) data.tau[k] += detail::armature_at(model, acting, i) * a[k];
  }
  return data.tau;
}

template <class T>
const VectorX<T>& nonlinear_effects(const Model<T>& model, Data<T>& data, const VectorRef<T>& q,
                                    const VectorRef<T>& v, const DynamicsTerms<T>& acting) {
  detail::check_arguments("nonlinear_effects", model, data, acting, q, &v);
  detail::place_joints(model, data, q);
  detail::move_bodies(model, data, v, acting);
  detail::accelerate_bodies<T>(model, data, &v, nullptr, acting);
  detail::body_forces(model, data, true, acting);
  detail::gather_forces(model, data, data.nle);
  return data.nle;
}

template <class T>
const VectorX<T>& generalized_gravity(const Model<T>& model, Data<T>& data, const VectorRef<T>& q) {
  detail::check_arguments("generalized_gravity", model, data, q);
  detail::place_joints(model, data, q);
  detail::accelerate_bodies<T>(model, data, nullptr, nullptr, {});
  detail::body_forces<T>(model, data, false, {});
  detail::gather_forces(model, data, data.g);
  return data.g;
}

template <class T>
const MatrixX<T>& crba(const Model<T>& model, Data<T>& data, const VectorRef<T>& q,
                       const DynamicsTerms<T>& acting) {
  detail::check_arguments("crba", model, data, acting, q);
  detail::place_joints(model, data, q);
  for (int i = 0; i < model.njoints(); ++i) data.composites[i] = composite(model.inertias[i]);
  for (int at = model.njoints() - 1; at >= 0; --at) {
    const int i = data.tree.preorder[at], p = model.parent[i];
    if (data.tree.count[i] == 1) {
      detail::cross_single_joint(model, data, i);
    } else {
      detail::cross_joint(model, data, i);
    }
    for (int k = data.tree.first[i]; k < data.tree.first[i] + data.tree.count[i]; ++k) {
      if (detail::has_armature(model, acting, i)) data.M(k, k) += detail::armature_at(model, acting, i);
    }
    if (p >= 0) accumulate(data.X_PB[i], data.composites[i], data.composites[p]);
  }
  detail::add_inertias(model, data, acting);
  return data.M;
}

template <class T>
const T& kinetic_energy(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                        const DynamicsTerms<T>& acting) {
  detail::check_arguments("kinetic_energy", model, data, acting, q, &v);
  detail::place_joints(model, data, q);
  detail::move_bodies(model, data, v);
  T twice = T(0);
  for (int i = 0; i < model.njoints(); ++i) {
    twice += dot(data.v[i], model.inertias[i] * data.v[i]);
    const T& s = v[data.tree.first[i]];
    if (detail::has_armature(model, acting, i)) twice += detail::armature_at(model, acting, i) * (s * s);
  }
  detail::for_each_added(acting,
                         [&](int i, const Articulated<T>& D) { twice += dot(data.v[i], D * data.v[i]); });
  return data.kinetic_energy = twice * T(0.5);
}

template <class T>
const T& potential_energy(const Model<T>& model, Data<T>& data, const VectorRef<T>& q) {
  forward_kinematics(model, data, q);
  data.potential_energy = T(0);
  for (int i = 0; i < model.njoints(); ++i) {
    const Vector3<T> c = data.X_WB[i].R * model.inertias[i].com + data.X_WB[i].p;
    data.potential_energy -= model.inertias[i].mass * model.gravity.dot(c);
  }
  return data.potential_energy;
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_INVERSE_DYNAMICS(T, ...)   \
  DYNTAPE_COMPILE(rnea, T, __VA_ARGS__)                \
  DYNTAPE_COMPILE(nonlinear_effects, T, __VA_ARGS__)   \
  DYNTAPE_COMPILE(generalized_gravity, T, __VA_ARGS__) \
  DYNTAPE_COMPILE(crba, T, __VA_ARGS__)                \
  DYNTAPE_COMPILE(kinetic_energy, T, __VA_ARGS__)      \
  DYNTAPE_COMPILE(potential_energy, T, __VA_ARGS__)

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_INVERSE_DYNAMICS)
