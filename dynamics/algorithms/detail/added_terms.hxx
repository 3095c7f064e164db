// SPDX-License-Identifier: BSD-3-Clause
//
// What added inertias put into the recursions.  docs/math.md (D.20) to (D.23).
#pragma once

#include <dyntape/dynamics/algorithms/detail/checks.hxx>

namespace dyntape::dynamics::detail {

// visit(body, D), D about the origin of the body.
template <class T, class Visit>
void for_each_added(const DynamicsTerms<T>& acting, Visit visit) {
  for (int i = 0; i < acting.added.count; ++i) {
    const AddedInertia<T>& added = acting.added.at(acting.added.list, i);
    if (added.body >= 0) visit(added.body, articulated(added));
  }
}

// Free fall, seen from body b: what the recursions' accelerations are short of.
template <class T>
Vector3<T> fall_of(const Model<T>& model, const Data<T>& data, const DynamicsTerms<T>& acting, int b) {
  if (!acting.gravity) return Vector3<T>::Zero();
  Matrix3<T> R = data.X_PB[b].R;
  for (int i = model.parent[b]; i >= 0; i = model.parent[i]) R = data.X_PB[i].R * R;
  return transposed_times(R, acting.gravity_value ? *acting.gravity_value : model.gravity);
}

// Of the body itself, without gravity.
template <class T>
Motion<T> acceleration_of(const Data<T>& data, int b, const Vector3<T>& fall) {
  return {data.a_gf[b].linear + fall, data.a_gf[b].angular};
}

// D a + v x* D v, after the accelerations data.a_gf.
template <class T>
Force<T> added_force(const Model<T>& model, const Data<T>& data, const DynamicsTerms<T>& acting, int b,
                     const Articulated<T>& D) {
  return D * acceleration_of(data, b, fall_of(model, data, acting, b)) + cross(data.v[b], D * data.v[b]);
}

// visit(joint i, X_iB) from body b to the root: the placement of body b in body i.
template <class T, class Visit>
void for_each_above(const Model<T>& model, const Data<T>& data, int b, Visit visit) {
  Placement<T> X_iB;
  for (int i = b; i >= 0; i = model.parent[i]) {
    visit(i, X_iB);
    X_iB = data.X_PB[i] * X_iB;
  }
}

// Six numbers of column k, of which the memory of what travels holds three kinds.
enum ColumnKind { kColumn, kSlopeByQ, kSlopeByV };
template <class T>
T* column_at(Data<T>& data, ColumnKind kind, int k) {
  return data.travellers.data() + 18 * std::ptrdiff_t{k} + 6 * kind;
}
template <class T, class Six>
void put_six(T* at, const Six& x) {
  for (int r = 0; r < 3; ++r) at[r] = x.linear.at(r), at[r + 3] = x.angular.at(r);
}
template <class Six, class T>
Six six_at(const T* at) {
  return {Vector3<T>(at[0], at[1], at[2]), Vector3<T>(at[3], at[4], at[5])};
}

// visit(r, k, above) for all columns r and k that move body b; above: the joint of r is nearer to the root.
template <class T, class Visit>
void for_each_pair(const Model<T>& model, const Tree& tree, int b, Visit visit) {
  for (int i = b; i >= 0; i = model.parent[i]) {
    for (int j = b, above = 0; j >= 0; above = above || j == i, j = model.parent[j]) {
      for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
        for (int r = tree.first[j]; r < tree.first[j] + tree.count[j]; ++r) visit(r, k, above != 0);
      }
    }
  }
}

// Entry (r, k) and its mirror image, once: from the column that is nearer to the root.
template <class T>
void add_to_inertia(Data<T>& data, int r, int k, bool above, const Force<T>& DJ_k) {
  const bool together = data.tree.dofs[r].joint == data.tree.dofs[k].joint;
  if (!above && !(together && r <= k)) return;
  const T x = dot(six_at<Motion<T>>(column_at(data, kColumn, r)), DJ_k);
  data.M(r, k) += x;
  if (r != k) data.M(k, r) += x;
}

// M += sum J^T D J
template <class T>
void add_inertias(const Model<T>& model, Data<T>& data, const DynamicsTerms<T>& acting) {
  for_each_added(acting, [&](int b, const Articulated<T>& D) {
    for_each_above(model, data, b, [&](int i, const Placement<T>& X_iB) {
      for (int k = data.tree.first[i]; k < data.tree.first[i] + data.tree.count[i]; ++k) {
        const Motion<T> J = act_inverse(X_iB, motion<T>(data.tree.dofs[k]));
        put_six(column_at(data, kColumn, k), J);
        put_six(column_at(data, kSlopeByV, k), D * J);
      }
    });
    for_each_pair(model, data.tree, b, [&](int r, int k, bool above) {
      add_to_inertia(data, r, k, above, six_at<Force<T>>(column_at(data, kSlopeByV, k)));
    });
  });
}

// Of tau = J^T F, F = D a + v x* D v in the frame of body b: derivatives of F by those of v and a, which stand in
// kinematic_derivatives.h for kLocal; J of a column turns with the joints between it and the body.
template <class T>
void add_inertia_derivatives(const Model<T>& model, Data<T>& data, const DynamicsTerms<T>& acting) {
  const Tree& tree = data.tree;
  for_each_added(acting, [&](int b, const Articulated<T>& D) {
    const Vector3<T> fall = fall_of(model, data, acting, b);
    const Motion<T> v = data.v[b];
    const Force<T> L = D * v, F = D * acceleration_of(data, b, fall) + cross(v, L);
    for_each_above(model, data, b, [&](int i, const Placement<T>& X_iB) {
      const int p = model.parent[i];
      Motion<T> v_p, a_p;  // of the parent, seen from body b
      if (p >= 0) {
        const Placement<T> X_pB = data.X_PB[i] * X_iB;
        v_p = act_inverse(X_pB, data.v[p]);
        a_p = act_inverse(X_pB, data.a_gf[p]);
        a_p.linear = a_p.linear + fall;
      }
      const Motion<T> beyond = v - act_inverse(X_iB, data.v[i]);
      for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
        const Motion<T> J = act_inverse(X_iB, motion<T>(tree.dofs[k]));
        const Motion<T> v_q = cross(v_p, J), a_q = cross(a_p, J) + cross(v_q, v - v_p);
        const Motion<T> a_v = cross(J, beyond) + v_q;
        put_six(column_at(data, kColumn, k), J);
        put_six(column_at(data, kSlopeByQ, k), D * a_q + cross(v_q, L) + cross(v, D * v_q));
        put_six(column_at(data, kSlopeByV, k), D * a_v + cross(J, L) + cross(v, D * J));
        data.tau[k] += dot(J, F);
      }
    });
    for_each_pair(model, tree, b, [&](int r, int k, bool above) {
      const Motion<T> J_r = six_at<Motion<T>>(column_at(data, kColumn, r)),
                      J_k = six_at<Motion<T>>(column_at(data, kColumn, k));
      T by_q = dot(J_r, six_at<Force<T>>(column_at(data, kSlopeByQ, k)));
      if (above) by_q += dot(cross(J_r, J_k), F);
      data.dtau_dq(r, k) += by_q;
      data.dtau_dv(r, k) += dot(J_r, six_at<Force<T>>(column_at(data, kSlopeByV, k)));
      add_to_inertia(data, r, k, above, D * J_k);
    });
  });
}

}  // namespace dyntape::dynamics::detail
