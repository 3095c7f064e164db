// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/algorithms/detail/forward_dynamics.hxx>
#include <dyntape/dynamics/algorithms/detail/inverse_dynamics.hxx>

namespace dyntape::dynamics {
namespace detail {

// From the roots: motions of the bodies, and of each column S the vectors of docs/math.md (D.12) to (D.14).
template <class T>
void spread_column_motions(const Model<T>& model, Data<T>& data, const VectorRef<T>& v, const VectorRef<T>& a,
                           const DynamicsTerms<T>& acting) {
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
    data.v[i] = acting.coriolis ? v_p + joint_motion(data, v, i) : Motion<T>{};
    data.a_gf[i] = a_p + bias_motion(data, v, i) + joint_motion(data, a, i);
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
      const Dof& S = tree.dofs[k];
      data.S_dot[k] = cross(v_p, S);
      data.S_ddot[k] = cross(a_p, S) + cross(v_p, data.S_dot[k]);
      data.S_v[k] = data.S_dot[k] + cross(data.v[i], S);
    }
  }
}

// int u dm and int r x u dm, which is the axial vector of U: the momentum of what moves with u.
template <class T>
DYNTAPE_INLINE Force<T> momentum(const VelocityProduct<T>& w) {
  return {w.p, {w.U.at(2, 1) - w.U.at(1, 2), w.U.at(0, 2) - w.U.at(2, 0), w.U.at(1, 0) - w.U.at(0, 1)}};
}

// f_i = I a + v x* I v - f_ext as in body_forces(), with the momentum that the velocity products hold.
template <class T>
void start_bodies(const Model<T>& model, Data<T>& data, const DynamicsTerms<T>& acting) {
  for (int i = 0; i < model.njoints(); ++i) {
    data.composites[i] = composite(model.inertias[i]);
    data.velocity_products[i] = velocity_product(data.composites[i], data.v[i]);
    data.f[i] = data.composites[i] * data.a_gf[i] + cross(data.v[i], momentum(data.velocity_products[i]));
    if (acting.external) data.f[i] = data.f[i] - (*acting.external)[i];
  }
}

// What travels for each column, in Data::travellers: S^T of the first three are entries of the column of M,
// dtau_dq and dtau_dv; with the first, the couple (angular part of (2 B)^T S) gives entries of the row.
enum Traveller { kForA = 0, kForQ = 6, kForV = 12, kCouple = 18, kTravellers = 21 };

// The columns of joint i set out: the block of the joint with itself, and the vectors that leave it.
template <class T>
DYNTAPE_INLINE void start_columns(Data<T>& data, int i, bool leave) {
  const Tree& tree = data.tree;
  const Composite<T>& I = data.composites[i];
  const VelocityProduct<T>& B = data.velocity_products[i];
  const int first = tree.first[i], last = first + tree.count[i];
  T *M = data.M.data(), *by_q = data.dtau_dq.data(), *by_v = data.dtau_dv.data();
  const std::ptrdiff_t nv = data.M.rows();
  for (int k = first; k < last; ++k) {
    const Dof& S = tree.dofs[k];
    const Force<T> for_a = I * S;
    Force<T> for_q = I * data.S_ddot[k] + twice_b(B, data.S_dot[k].angular);
    Force<T> for_v = I * data.S_v[k];
    if (S.angular) for_v = for_v + twice_b(B, vector<T>(S.axis));
    for (int r = first; r < last; ++r) {
      M[r + k * nv] = dot(tree.dofs[r], for_a);
      by_q[r + k * nv] = dot(tree.dofs[r], for_q);
      by_v[r + k * nv] = dot(tree.dofs[r], for_v);
    }
    if (!leave) continue;
    T* t = data.travellers.data();
    const int place = tree.place_of[k];
    put_spatial(t + kForA * data.stride, data.stride, place, for_a);
    put_spatial(t + kForQ * data.stride, data.stride, place, for_q + cross(S, data.f[i]));
    put_spatial(t + kForV * data.stride, data.stride, place, for_v);
    put(t + kCouple * data.stride, data.stride, place, twice_b_transposed(B, S));
  }
}

// Column r of joint i meets the columns that come from beyond it: entries (r, s) and (s, r),
// docs/math.md (D.17), (D.18).
template <class T>
DYNTAPE_INLINE void meet_columns(Data<T>& data, int i, int r) {
  const Tree& tree = data.tree;
  const int begin = tree.begin[i] + tree.count[i], end = tree.end[i];
  const std::ptrdiff_t stride = data.stride, nv = data.M.rows();
  const Dof& S = tree.dofs[r];
  const T* t = data.travellers.data();
  T *a = data.rows.data(), *q = a + stride, *v = q + stride, *q_below = v + stride,
    *v_below = q_below + stride;
  const Motion<T>&S_v = data.S_v[r], &S_ddot = data.S_ddot[r];
  const Vector3<T>& turn = data.S_dot[r].angular;
  over<T>(begin, end, [&](int s, auto lanes) {
    const T* c = t + kCouple * stride + s;
    const SixLanes<T> for_a(t + kForA * stride + s, stride, lanes);
    lanes.store(a + s, dot_group<T>(S, t + kForA * stride + s, stride, lanes));
    lanes.store(q + s, dot_group<T>(S, t + kForQ * stride + s, stride, lanes));
    lanes.store(v + s, dot_group<T>(S, t + kForV * stride + s, stride, lanes));
    lanes.store(q_below + s,
                for_a.dot(S_ddot) + (lanes.load(c) * turn.at(0) + lanes.load(c + stride) * turn.at(1) +
                                     lanes.load(c + 2 * stride) * turn.at(2)));
    typename Lanes<T>::Vector by_v = for_a.dot(S_v);
    if (S.angular) by_v = by_v + dot_group<T>(S.axis, c, stride, lanes);
    lanes.store(v_below + s, by_v);
  });
  T *by_q = data.dtau_dq.data(), *by_v = data.dtau_dv.data();
  mirror(tree, r, begin, end, a, data.M);
  for (int s = begin; s < end; ++s) {
    const std::ptrdiff_t k = tree.dof_at[s], above = r + k * nv, below = k + r * nv;
    by_q[above] = q[s];
    by_q[below] = q_below[s];
    by_v[above] = v[s];
    by_v[below] = v_below[s];
  }
}

template <class T>
DYNTAPE_INLINE void leave_joint(Data<T>& data, int i) {
  const std::ptrdiff_t stride = data.stride;
  const int begin = data.tree.begin[i], end = data.tree.end[i];
  T* t = data.travellers.data();
  for (const int force : {kForA, kForQ, kForV})
    act_columns<T>(data.X_PB[i], t + force * stride, stride, begin, end);
  rotate_columns<T>(data.X_PB[i].R, t + kCouple * stride, stride, begin, end);
}

template <class T>
void id_derivatives_placed(const Model<T>& model, Data<T>& data, const VectorRef<T>& v, const VectorRef<T>& a,
                           const DynamicsTerms<T>& acting) {
  const Tree& tree = data.tree;
  if (data.across) {
    data.dtau_dq.setZero();
    data.dtau_dv.setZero();
    data.across = false;
  }
  spread_column_motions(model, data, v, a, acting);
  start_bodies(model, data, acting);
  for (int at = model.njoints() - 1; at >= 0; --at) {
    const int i = tree.preorder[at], p = model.parent[i];
    start_columns(data, i, p >= 0);
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
      meet_columns(data, i, k);
      data.tau[k] = dot(tree.dofs[k], data.f[i]);
      if (!has_armature(model, acting, i)) continue;
      data.M(k, k) += armature_at(model, acting, i);
      data.tau[k] += armature_at(model, acting, i) * a[k];
    }
    if (p < 0) continue;
    leave_joint(data, i);
    accumulate(data.X_PB[i], data.composites[i], data.composites[p]);
    accumulate(data.X_PB[i], data.velocity_products[i], data.velocity_products[p]);
    data.f[p] = data.f[p] + act(data.X_PB[i], data.f[i]);
  }
  add_inertia_derivatives(model, data, acting);
}

// kGroups groups of rows of  -sum_k Minv_k d_k  over the `count` dofs of a path, summed side by side.
template <int kGroups, class T>
DYNTAPE_INLINE void combine_columns(const Data<T>& data, const int* path, int count, const T* d, int row,
                                    T* sum) {
  const Lanes<T> lanes;
  const T* Minv = data.columns_of_minverse.data() + row;
  typename Lanes<T>::Vector x[kGroups];
  for (int g = 0; g < kGroups; ++g) {
    x[g] = -(lanes.load(Minv + path[0] * data.stride + g * kLanes<T>) * d[path[0]]);
  }
  for (int c = 1; c < count; ++c) {
    const T* column = Minv + path[c] * std::ptrdiff_t{data.stride};
    for (int g = 0; g < kGroups; ++g) x[g] = x[g] - lanes.load(column + g * kLanes<T>) * d[path[c]];
  }
  for (int g = 0; g < kGroups; ++g) lanes.store(sum + row + g * kLanes<T>, x[g]);
}

// -Minv D; of column j of D only rows on a path with j, docs/math.md (D.19), but where effects reach across.
template <class T>
void solve_columns(const Model<T>& model, Data<T>& data, const MatrixX<T>& D, MatrixX<T>& result) {
  constexpr int kWide = 4;
  const Tree& tree = data.tree;
  T* sum = data.rows.data();
  for (int j = 0; j < model.nv; ++j) {
    const T* column = D.data() + std::ptrdiff_t{j} * model.nv;
    const int* path = data.across ? tree.dof_at.data() : tree.path.data() + tree.path_begin(j);
    const int count = data.across ? model.nv : tree.path_end[j] - tree.path_begin(j);
    int row = 0;
    for (; row + kWide * kLanes<T> <= data.stride; row += kWide * kLanes<T>) {
      combine_columns<kWide>(data, path, count, column, row, sum);
    }
    for (; row < data.stride; row += kLanes<T>) combine_columns<1>(data, path, count, column, row, sum);
    std::copy(sum, sum + model.nv, result.data() + std::ptrdiff_t{j} * model.nv);
  }
}

// What solve_columns combines: the acceleration under tau, Minv, and the derivatives of inverse dynamics there.
template <class T>
void derivatives_at_acceleration(const Model<T>& model, Data<T>& data, const VectorRef<T>& q,
                                 const VectorRef<T>& v, const VectorRef<T>& tau,
                                 const DynamicsTerms<T>& acting) {
  if (data.following) {
    minverse(model, data, q, acting);
    accelerate_following(model, data, q, v, tau, acting);
  } else {
    place_joints(model, data, q);
    articulate(model, data, acting);
    aba_placed(model, data, v, tau, acting);
    minverse_articulated(model, data);
  }
  for (int k = 0; k < model.nv; ++k) {
    std::copy(data.Minv.col(k).data(), data.Minv.col(k).data() + model.nv,
              data.columns_of_minverse.data() + k * data.stride);
  }
  id_derivatives_placed<T>(model, data, v, data.ddq, acting);
}

}  // namespace detail

template <class T>
void id_derivatives(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                    const VectorRef<T>& a, const DynamicsTerms<T>& acting) {
  detail::check_arguments("id_derivatives", model, data, acting, q, &v, &a);
  detail::place_joints(model, data, q);
  detail::id_derivatives_placed(model, data, v, a, acting);
}

template <class T>
void id_derivatives_under(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                          const VectorRef<T>& tau, const DynamicsTerms<T>& acting) {
  detail::check_arguments("fd_derivatives", model, data, acting, q, &v, &tau, "tau");
  detail::derivatives_at_acceleration(model, data, q, v, tau, acting);
}

template <class T>
void fd_derivatives(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                    const VectorRef<T>& tau, const DynamicsTerms<T>& acting) {
  id_derivatives_under(model, data, q, v, tau, acting);
  detail::solve_columns(model, data, data.dtau_dq, data.ddq_dq);
  detail::solve_columns(model, data, data.dtau_dv, data.ddq_dv);
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_DERIVATIVES(T, ...)         \
  DYNTAPE_COMPILE(id_derivatives, T, __VA_ARGS__)       \
  DYNTAPE_COMPILE(id_derivatives_under, T, __VA_ARGS__) \
  DYNTAPE_COMPILE(fd_derivatives, T, __VA_ARGS__)

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_DERIVATIVES)
