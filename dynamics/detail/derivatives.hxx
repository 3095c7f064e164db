// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/detail/forward_dynamics.hxx>
#include <dyntape/dynamics/detail/inverse_dynamics.hxx>

namespace dyntape::dynamics {
namespace detail {

// From the roots: motions of the bodies, and of each column S the three vectors of algorithms.h.
template <class T>
void spread_column_motions(const Model<T>& model, Data<T>& data, const VectorRef<T>& v, const VectorRef<T>& a,
                           const Acting<T>& acting) {
  const Tree& tree = data.tree;
  for (int i = 0; i < model.njoints(); ++i) {
    const int p = model.parent[i];
    Motion<T> v_p, a_p;  // of the parent, seen from body i
    if (p >= 0) {
      v_p = act_inverse(data.X_PB[i], data.v[p]);
      a_p = act_inverse(data.X_PB[i], data.a_gf[p]);
    } else {
      a_p = root_acceleration(model, data, acting, i);
    }
    data.v[i] = v_p + joint_motion(data, v, i);
    data.a_gf[i] = a_p + bias_motion(data, v, i) + joint_motion(data, a, i);
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
      const Dof& S = tree.dofs[k];
      data.S_dot[k] = cross(v_p, S);
      data.S_ddot[k] = cross(a_p, S) + cross(v_p, data.S_dot[k]);
      data.S_v[k] = data.S_dot[k] + cross(data.v[i], S);
    }
  }
}

template <class T>
void start_bodies(const Model<T>& model, Data<T>& data, const Acting<T>& acting) {
  body_forces(model, data, true, acting);
  for (int i = 0; i < model.njoints(); ++i) {
    data.composites[i] = composite(model.inertias[i]);
    data.velocity_products[i] = velocity_product(data.composites[i], data.v[i]);
  }
}

// The four vectors of one column on their way to the root.
template <class T>
struct Travellers {
  Force<T> for_a, for_q, for_v;  // S^T of these: entries of the column of M, dtau_dq, dtau_dv
  Vector3<T> couple;             // angular part of (2 B)^T S: with for_a, entries of the row
};

template <class T>
void go_up(const Placement<T>& X_PB, Travellers<T>& t) {
  t.for_a = act(X_PB, t.for_a);
  t.for_q = act(X_PB, t.for_q);
  t.for_v = act(X_PB, t.for_v);
  t.couple = X_PB.R * t.couple;
}

// Column k of the bodies beyond its joint; fills the block of the joint with itself.
template <class T>
Travellers<T> start_column(Data<T>& data, int i, int k) {
  const Tree& tree = data.tree;
  const Composite<T>& I = data.composites[i];
  const VelocityProduct<T>& B = data.velocity_products[i];
  const Dof& S = tree.dofs[k];
  Travellers<T> t{I * S, I * data.S_ddot[k] + twice_b(B, data.S_dot[k].angular), I * data.S_v[k],
                  twice_b_transposed(B, S)};
  if (S.angular) t.for_v = t.for_v + twice_b(B, vector<T>(S.axis));
  for (int r = tree.first[i]; r < tree.first[i] + tree.count[i]; ++r) {
    data.M(r, k) = dot(tree.dofs[r], t.for_a);
    data.dtau_dq(r, k) = dot(tree.dofs[r], t.for_q);
    data.dtau_dv(r, k) = dot(tree.dofs[r], t.for_v);
  }
  t.for_q = t.for_q + cross(S, data.f[i]);
  return t;
}

// Entries (r, k) and (k, r), r a column of an ancestor in whose frame t is.
template <class T>
void meet(Data<T>& data, const Travellers<T>& t, int r, int k) {
  const Dof& S = data.tree.dofs[r];
  data.M(r, k) = data.M(k, r) = dot(S, t.for_a);
  data.dtau_dq(r, k) = dot(S, t.for_q);
  data.dtau_dv(r, k) = dot(S, t.for_v);
  data.dtau_dq(k, r) = dot(data.S_ddot[r], t.for_a) + data.S_dot[r].angular.dot(t.couple);
  T dv = dot(data.S_v[r], t.for_a);
  if (S.angular) dv += dot(S.axis, t.couple);
  data.dtau_dv(k, r) = dv;
}

template <class T>
void id_derivatives_placed(const Model<T>& model, Data<T>& data, const VectorRef<T>& v, const VectorRef<T>& a,
                           const Acting<T>& acting) {
  const Tree& tree = data.tree;
  spread_column_motions(model, data, v, a, acting);
  start_bodies(model, data, acting);
  for (int i = model.njoints() - 1; i >= 0; --i) {
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
      data.tau[k] = dot(tree.dofs[k], data.f[i]);
      Travellers<T> t = start_column(data, i, k);
      if (has_armature(model, acting, i)) {
        data.M(k, k) += armature_at(model, acting, i);
        data.tau[k] += armature_at(model, acting, i) * a[k];
      }
      for (int j = i; model.parent[j] >= 0;) {
        go_up(data.X_PB[j], t);
        j = model.parent[j];
        for (int r = tree.first[j]; r < tree.first[j] + tree.count[j]; ++r) meet(data, t, r, k);
      }
    }
    const int p = model.parent[i];
    if (p < 0) continue;
    accumulate(data.X_PB[i], data.composites[i], data.composites[p]);
    accumulate(data.X_PB[i], data.velocity_products[i], data.velocity_products[p]);
    data.f[p] = data.f[p] + act(data.X_PB[i], data.f[i]);
  }
}

// -Minv D, with only the rows of column j of D that lie on a path with j.
template <class T>
void solve_columns(const Model<T>& model, const Data<T>& data, const MatrixX<T>& D, MatrixX<T>& result) {
  const Tree& tree = data.tree;
  for (int j = 0; j < model.nv; ++j) {
    auto column = result.col(j);
    column.setZero();
    const int i = tree.dofs[j].joint;
    for (int k : tree.subtree[i]) column -= data.Minv.col(k) * D(k, j);
    for (int p = i; p >= 0; p = model.parent[p]) {
      for (int k = tree.first[p]; k < tree.first[p] + tree.count[p]; ++k)
        column -= data.Minv.col(k) * D(k, j);
    }
  }
}

}  // namespace detail

template <class T>
void id_derivatives(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                    const VectorRef<T>& a, const Acting<T>& acting) {
  detail::check_arguments("id_derivatives", model, data, q, &v, &a);
  detail::check_acting("id_derivatives", model, acting);
  detail::place_joints(model, data, q);
  detail::id_derivatives_placed(model, data, v, a, acting);
}

template <class T>
void fd_derivatives(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                    const VectorRef<T>& tau, const Acting<T>& acting) {
  detail::check_arguments("fd_derivatives", model, data, q, &v, &tau, "tau");
  detail::check_acting("fd_derivatives", model, acting);
  detail::place_joints(model, data, q);
  detail::articulate(model, data, acting);
  detail::aba_placed(model, data, v, tau, acting);
  detail::minverse_articulated(model, data);
  detail::id_derivatives_placed<T>(model, data, v, data.ddq, acting);
  detail::solve_columns(model, data, data.dtau_dq, data.ddq_dq);
  detail::solve_columns(model, data, data.dtau_dv, data.ddq_dv);
}

}  // namespace dyntape::dynamics
