// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/algorithms/detail/added_terms.hxx>
#include <dyntape/dynamics/algorithms/detail/checks.hxx>
#include <dyntape/dynamics/algorithms/detail/columns.hxx>
#include <dyntape/dynamics/algorithms/detail/following.hxx>

namespace dyntape::dynamics {
namespace detail {

template <class T>
Matrix6<T> matrix(const Articulated<T>& I) {
  Matrix6<T> m;
  m << I.M, I.H, I.H.transpose(), I.J;
  return m;
}

template <class T>
Motion<T> motion_of(const Vector6<T>& x) {
  return {x.template head<3>(), x.template tail<3>()};
}

// What of I is felt by the parent through the joint; keeps U = I S and 1/D, D = S.U + armature.  The columns
// of a joint are eliminated one after the other, the last first, as if massless bodies were between them: a
// block elimination, exactly.  docs/math.md (D.7) to (D.9).
template <class T>
DYNTAPE_INLINE Articulated<T> hinge(const Model<T>& model, Data<T>& data, const DynamicsTerms<T>& acting,
                                    int i) {
  const int first = data.tree.first[i];
  const T armature = armature_at(model, acting, i);
  Articulated<T> felt = data.articulated[i];
  for (int k = first + data.tree.count[i] - 1; k >= first; --k) {
    const Dof& S = data.tree.dofs[k];
    data.U[k] = felt * S;
    data.D_inverse[k] = T(1) / (dot(S, data.U[k]) + armature);
    if (k == first && model.parent[i] < 0) return {};
    felt = without(felt, S, data.U[k], data.D_inverse[k], armature);
  }
  return felt;
}

// Articulated inertias from the leaves to the roots, for placed joints.  A free-flyer hides what is beyond
// it: its parent feels no inertia.
template <class T>
void articulate(const Model<T>& model, Data<T>& data, const DynamicsTerms<T>& acting) {
  for (int i = 0; i < model.njoints(); ++i) data.articulated[i] = articulated(model.inertias[i]);
  for_each_added(acting, [&](int i, const Articulated<T>& D) {
    data.articulated[i].M += D.M, data.articulated[i].H += D.H, data.articulated[i].J += D.J;
  });
  for (int i = model.njoints() - 1; i >= 0; --i) {
    const int p = model.parent[i];
    if (data.tree.is_free(i)) {
      data.ldlt[i] = Ldlt6<T>(matrix(data.articulated[i]));
      continue;
    }
    const Articulated<T> felt = hinge(model, data, acting, i);
    if (p < 0) continue;
    accumulate(data.X_PB[i], felt, data.articulated[p]);
    data.articulated[i] = felt;
  }
}

// Bias forces from the leaves to the roots: p_A = v x* I v - f_ext + sum over children X p_a,
//   u = tau - S.p_A,   p_a = p_A + I_a c + U u / D.
template <class T>
void gather_bias(const Model<T>& model, Data<T>& data, const VectorRef<T>& v, const VectorRef<T>& tau,
                 const DynamicsTerms<T>& acting) {
  const Tree& tree = data.tree;
  for (int i = 0; i < model.njoints(); ++i) {
    data.p_A[i] = cross(data.v[i], model.inertias[i] * data.v[i]);
    if (acting.external) data.p_A[i] = data.p_A[i] - (*acting.external)[i];
  }
  for_each_added(acting, [&](int i, const Articulated<T>& D) {
    const Motion<T> fall{fall_of(model, data, acting, i), Vector3<T>::Zero()};
    data.p_A[i] = data.p_A[i] + cross(data.v[i], D * data.v[i]) + D * fall;
  });
  for (int i = model.njoints() - 1; i >= 0; --i) {
    const int p = model.parent[i], k = tree.first[i];
    if (tree.is_free(i)) {
      data.u.template segment<6>(k) = tau.template segment<6>(k) - data.p_A[i].vector();
      const Force<T> through{tau.template segment<3>(k), tau.template segment<3>(k + 3)};
      if (p >= 0) data.p_A[p] = data.p_A[p] + act(data.X_PB[i], through);
      continue;
    }
    for (int c = k + tree.count[i] - 1; c > k; --c) {
      data.u[c] = tau[c] - dot(tree.dofs[c], data.p_A[i]);
      data.p_A[i] = data.p_A[i] + data.U[c] * T(data.u[c] * data.D_inverse[c]);
    }
    data.u[k] = tau[k] - dot(tree.dofs[k], data.p_A[i]);
    if (p < 0) continue;
    const T s = data.u[k] * data.D_inverse[k];
    const Force<T> Ic = data.articulated[i] * bias_motion(data, v, i);
    const Force<T> p_a{data.p_A[i].linear + Ic.linear + data.U[k].linear * s,
                       data.p_A[i].angular + Ic.angular + data.U[k].angular * s};
    data.p_A[p] = data.p_A[p] + act(data.X_PB[i], p_a);
  }
}

// Accelerations from the roots to the leaves: a' = X^-1 a_p + c,  a = (u - U.a') / D.
template <class T>
void spread_accelerations(const Model<T>& model, Data<T>& data, const VectorRef<T>& v,
                          const DynamicsTerms<T>& acting) {
  const Tree& tree = data.tree;
  for (int i = 0; i < model.njoints(); ++i) {
    const int p = model.parent[i], k = tree.first[i];
    Motion<T> a = p < 0 ? root_acceleration(model, data, acting, i) : act_inverse(data.X_PB[i], data.a_gf[p]);
    if (p >= 0) a = a + bias_motion(data, v, i);  // v_i x S v = 0 at a root
    if (tree.is_free(i)) {
      const Vector6<T> total = data.ldlt[i].solve(data.u.template segment<6>(k));
      data.ddq.template segment<6>(k) = total - a.vector();
      data.a_gf[i] = motion_of<T>(total);
    } else {
      for (int c = k; c < k + tree.count[i]; ++c) {
        data.ddq[c] = (data.u[c] - dot(a, data.U[c])) * data.D_inverse[c];
        add_along(tree.dofs[c], data.ddq[c], a);
      }
      data.a_gf[i] = a;
    }
  }
}

template <class T>
void aba_placed(const Model<T>& model, Data<T>& data, const VectorRef<T>& v, const VectorRef<T>& tau,
                const DynamicsTerms<T>& acting) {
  move_bodies(model, data, v, acting);
  gather_bias(model, data, v, tau, acting);
  spread_accelerations(model, data, v, acting);
}

// --- M^-1: the rows right of the diagonal, in the places of the tree (docs/math.md (D.10), (D.11)) ---

// x[s] -= factor y[s].
template <class T>
DYNTAPE_INLINE void subtract_columns(const T* y, const T& factor, int begin, int end, T* x) {
  over<T>(begin, end,
          [&](int s, auto lanes) { lanes.store(x + s, lanes.load(x + s) - lanes.load(y + s) * factor); });
}

// row = 0 from `place` to the end of the tree of joint i.
template <class T>
DYNTAPE_INLINE void clear_row(const Tree& tree, int i, int place, T* row) {
  over<T>(place, tree.end[tree.root[i]], [&](int s, auto lanes) { lanes.store(row + s, lanes.zero()); });
}

// From the leaves: F_s the bias force of unit torque s, as far as the joints on its way resist it.  At a column
// with U = I_A S:  row_s = -S.F_s / D,   F_s <- F_s + U row_s.  With the first column of a joint that hangs on
// another the forces go on to the parent.
template <class T>
DYNTAPE_INLINE void resist(const Model<T>& model, Data<T>& data, int i, int c) {
  using Vector = typename Lanes<T>::Vector;
  const Tree& tree = data.tree;
  const bool hung = model.parent[i] >= 0, first = c == tree.first[i];
  const int place = tree.begin[i] + c - tree.first[i];
  const std::ptrdiff_t stride = data.stride;
  T *F = data.travellers.data(), *row = data.upper.data() + place * stride;
  const T D_inverse = data.D_inverse[c];
  const Force<T>& U = data.U[c];
  clear_row(tree, i, place, row);
  over_before<T>(place, tree.end[i], [&](int s, auto lanes) {
    Vector answer = -(dot_group<T>(tree.dofs[c], F + s, stride, lanes) * D_inverse);
    answer = with_lane<T>(answer, place - s, D_inverse);
    lanes.store(row + s, answer);
    if (!hung && first) return;
    SixLanes<T> f(F + s, stride, lanes);
    for (int k = 0; k < 6; ++k) {
      const T& u = k < 3 ? U.linear.at(k) : U.angular.at(k - 3);
      f.x[k] = with_lane<T>(f.x[k], place - s, T(0)) + answer * u;
    }
    if (first) f.act(data.X_PB[i]);
    f.store(F + s, stride, lanes);
  });
}

// A free-flyer resists with all six columns at once: rows I_A^-1 for its own, -I_A^-1 F for those beyond it, and
// nothing of these is felt by its parent.
template <class T>
DYNTAPE_INLINE void resist_freely(const Model<T>& model, Data<T>& data, int i) {
  using Vector = typename Lanes<T>::Vector;
  const Tree& tree = data.tree;
  const int place = tree.begin[i];
  const std::ptrdiff_t stride = data.stride;
  T *F = data.travellers.data(), *row = data.upper.data() + place * stride;
  const Ldlt6<T>& A = data.ldlt[i];
  for (int r = 0; r < 6; ++r) clear_row(tree, i, place, row + r * stride);
  over_before<T>(place, tree.end[i], [&](int s, auto lanes) {
    SixLanes<T> x(F + s, stride, lanes), f = x;
    for (int r = 0; r < 6; ++r) {
      f.x[r] = with_first_lanes<T>(lanes.zero(), place + 6 - s, place + r - s);
      x.x[r] = with_first_lanes<T>(Vector(-x.x[r]), place + 6 - s, place + r - s);
    }
    for (int r = 1; r < 6; ++r) {
      for (int k = 0; k < r; ++k) x.x[r] = x.x[r] - x.x[k] * A.L(r, k);
    }
    for (int r = 0; r < 6; ++r) x.x[r] = x.x[r] * A.D_inverse[r];
    for (int r = 4; r >= 0; --r) {
      for (int k = r + 1; k < 6; ++k) x.x[r] = x.x[r] - x.x[k] * A.L(k, r);
    }
    x.store(row + s, stride, lanes);
    if (model.parent[i] < 0) return;
    f.act(data.X_PB[i]);
    f.store(F + s, stride, lanes);
  });
}

template <class T>
void gather_unit_torques(const Model<T>& model, Data<T>& data) {
  const Tree& tree = data.tree;
  for (int at = model.njoints() - 1; at >= 0; --at) {
    const int i = tree.preorder[at], k = tree.first[i];
    if (tree.count[i] < 6) {
      for (int c = k + tree.count[i] - 1; c >= k; --c) resist(model, data, i, c);
      continue;
    }
    resist_freely(model, data, i);
  }
}

// From the roots: m_s the motion with which body i answers unit torque s.  A column with U has its share
// row_s <- row_s - U.m_s / D in it and adds S row_s.
template <class T>
DYNTAPE_INLINE void spread_responses(const Model<T>& model, Data<T>& data, int i) {
  const Tree& tree = data.tree;
  const int p = model.parent[i], begin = tree.begin[i], end = tree.end[tree.root[i]], count = tree.count[i];
  const std::ptrdiff_t stride = data.stride;
  T *m = data.responses.data() + tree.depth[i] * 6 * stride, *row = data.upper.data() + begin * stride;
  if (p < 0) {
    for (int k = 0; k < 6; ++k) clear_row(tree, i, begin, m + k * stride);
  } else if (count == 1) {
    const int dof = tree.first[i];
    const bool leaf = tree.end[i] == begin + 1;
    over<T>(begin, end, [&](int s, auto lanes) {
      SixLanes<T> own(m - 6 * stride + s, stride, lanes);
      own.act_inverse(data.X_PB[i]);
      lanes.store(row + s, lanes.load(row + s) - own.dot(data.U[dof]) * data.D_inverse[dof]);
      if (!leaf) own.store(m + s, stride, lanes);
    });
    if (!leaf) add_along_columns<T>(tree.dofs[dof], row, m, stride, begin + 1, end);
    return;
  } else {
    act_inverse_columns<T>(data.X_PB[i], m - 6 * stride, m, stride, begin, end);
  }
  for (int c = 0; c < count; ++c, row += stride) {
    const int dof = tree.first[i] + c;
    if (tree.is_free(i)) {
      if (p >= 0) subtract_columns(m + c * stride, T(1), begin + c, end, row);
      continue;
    }
    if (p >= 0 || c > 0) {
      T* answer = data.rows.data();
      project_columns(data.U[dof], m, stride, begin + c, end, answer);
      subtract_columns(answer, data.D_inverse[dof], begin + c, end, row);
    }
    add_along_columns<T>(tree.dofs[dof], row, m, stride, begin + c + 1, end);
  }
  if (count != 6) return;
  row = data.upper.data() + begin * stride;
  for (int c = 0; c < 6; ++c) subtract_columns(row + c * stride, T(-1), begin + 6, end, m + c * stride);
}

template <class T>
void minverse_articulated(const Model<T>& model, Data<T>& data) {
  gather_unit_torques(model, data);
  const Tree& tree = data.tree;
  for (int i : tree.preorder) spread_responses(model, data, i);
  for (int i = 0; i < model.njoints(); ++i) {
    for (int place = tree.begin[i]; place < tree.begin[i] + tree.count[i]; ++place) {
      const T* row = data.upper.data() + place * std::ptrdiff_t{data.stride};
      const int k = tree.dof_at[place];
      data.Minv.data()[k + std::ptrdiff_t{k} * model.nv] = row[place];
      mirror(tree, k, place + 1, tree.end[tree.root[i]], row, data.Minv);
    }
  }
}

}  // namespace detail

template <class T>
const VectorX<T>& aba(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                      const VectorRef<T>& tau, const DynamicsTerms<T>& acting) {
  detail::check_arguments("aba", model, data, acting, q, &v, &tau, "tau");
  if (data.following) {
    detail::factorise(*data.following, crba<T>(model, data, q, acting));
    detail::accelerate_following(model, data, q, v, tau, acting);
    return data.ddq;
  }
  detail::place_joints(model, data, q);
  detail::articulate(model, data, acting);
  detail::aba_placed(model, data, v, tau, acting);
  return data.ddq;
}

template <class T>
const MatrixX<T>& minverse(const Model<T>& model, Data<T>& data, const VectorRef<T>& q,
                           const DynamicsTerms<T>& acting) {
  detail::check_arguments("minverse", model, data, acting, q);
  if (data.following) {
    detail::factorise(*data.following, crba<T>(model, data, q, acting));
    detail::invert_following(data);
    return data.Minv;
  }
  detail::place_joints(model, data, q);
  detail::articulate(model, data, acting);
  detail::minverse_articulated(model, data);
  return data.Minv;
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_FORWARD_DYNAMICS(T, ...) \
  DYNTAPE_COMPILE(aba, T, __VA_ARGS__)               \
  DYNTAPE_COMPILE(minverse, T, __VA_ARGS__)

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_FORWARD_DYNAMICS)
