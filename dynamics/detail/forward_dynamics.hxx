// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/detail/checks.hxx>

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
// block elimination, exactly.
template <class T>
Articulated<T> hinge(const Model<T>& model, Data<T>& data, const Acting<T>& acting, int i) {
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
void articulate(const Model<T>& model, Data<T>& data, const Acting<T>& acting) {
  for (int i = 0; i < model.njoints(); ++i) data.articulated[i] = articulated(model.inertias[i]);
  for (int i = model.njoints() - 1; i >= 0; --i) {
    const int p = model.parent[i];
    if (data.tree.count[i] == 6) {
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
                 const Acting<T>& acting) {
  const Tree& tree = data.tree;
  for (int i = 0; i < model.njoints(); ++i) {
    data.p_A[i] = cross(data.v[i], model.inertias[i] * data.v[i]);
    if (acting.external) data.p_A[i] = data.p_A[i] - (*acting.external)[i];
  }
  for (int i = model.njoints() - 1; i >= 0; --i) {
    const int p = model.parent[i], k = tree.first[i];
    if (tree.count[i] == 6) {
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
                          const Acting<T>& acting) {
  const Tree& tree = data.tree;
  for (int i = 0; i < model.njoints(); ++i) {
    const int p = model.parent[i], k = tree.first[i];
    Motion<T> a = p < 0 ? root_acceleration(model, data, acting, i) : act_inverse(data.X_PB[i], data.a_gf[p]);
    if (p >= 0) a = a + bias_motion(data, v, i);  // v_i x S v = 0 at a root
    if (tree.count[i] == 6) {
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
                const Acting<T>& acting) {
  move_bodies(model, data, v);
  gather_bias(model, data, v, tau, acting);
  spread_accelerations(model, data, v, acting);
}

// A column c of joint i that is not its first: unit torques beyond it pass, its own starts.
template <class T>
void resist_inner_column(Data<T>& data, int i, int c) {
  const Tree& tree = data.tree;
  const auto pass = [&](int s) {
    data.Minv(c, s) = -(data.D_inverse[c] * dot(tree.dofs[c], data.F[s]));
    data.F[s] = data.F[s] + data.U[c] * data.Minv(c, s);
  };
  for (int s = c + 1; s < tree.first[i] + tree.count[i]; ++s) pass(s);
  for (int s : tree.subtree[i]) pass(s);
  data.Minv(c, c) = data.D_inverse[c];
  data.F[c] = data.U[c] * data.D_inverse[c];
}

// Column by column: the bias force F of a unit torque on its way to the root, as far as each joint resists
// it.
template <class T>
void gather_unit_torques(const Model<T>& model, Data<T>& data) {
  const Tree& tree = data.tree;
  for (int i = model.njoints() - 1; i >= 0; --i) {
    const bool hung = model.parent[i] >= 0;
    const int k = tree.first[i];
    const Placement<T>& X = data.X_PB[i];
    if (tree.count[i] == 6) {
      for (int s : tree.subtree[i]) {
        data.Minv.col(s).template segment<6>(k) = -data.ldlt[i].solve(data.F[s].vector());
        data.F[s] = {};
      }
      for (int c = 0; c < 6; ++c) {
        const Vector6<T> unit = Vector6<T>::Unit(c);
        data.Minv.col(k + c).template segment<6>(k) = data.ldlt[i].solve(unit);
        if (hung) data.F[k + c] = act(X, Force<T>{unit.template head<3>(), unit.template tail<3>()});
      }
      continue;
    }
    for (int c = k + tree.count[i] - 1; c > k; --c) resist_inner_column(data, i, c);
    const T& D_inverse = data.D_inverse[k];
    const Force<T>& U = data.U[k];
    data.Minv(k, k) = D_inverse;
    if (hung) data.F[k] = act(X, U * D_inverse);
    const auto pass = [&](int s) {
      const T row = -(D_inverse * dot(tree.dofs[k], data.F[s]));
      data.Minv(k, s) = row;
      if (hung) data.F[s] = act(X, data.F[s] + U * row);
    };
    for (int c = k + 1; c < k + tree.count[i]; ++c) pass(c);
    for (int s : tree.subtree[i]) pass(s);
  }
}

// Response of body i, in data.column, to the unit torque j, given the response of its parent.
template <class T>
void respond(const Model<T>& model, Data<T>& data, int i, int j) {
  const Tree& tree = data.tree;
  const int p = model.parent[i], k = tree.first[i];
  Motion<T> m;
  if (p >= 0) m = act_inverse(data.X_PB[i], data.column[p]);
  if (tree.count[i] == 6) {
    if (p >= 0) data.Minv.col(j).template segment<6>(k) -= m.vector();
    data.column[i] = m + motion_of<T>(data.Minv.col(j).template segment<6>(k));
    return;
  }
  // Minv(c, j) with c after j waits for its mirror image.
  const bool own = i == tree.dofs[j].joint;
  const int end = own ? j + 1 : k + tree.count[i];
  for (int c = k; c < end; ++c) {
    if (p >= 0 || c > k) data.Minv(c, j) -= data.D_inverse[c] * dot(m, data.U[c]);
    if (!own || c < j) add_along(tree.dofs[c], data.Minv(c, j), m);
  }
  data.column[i] = m;
}

template <class T>
void minverse_articulated(const Model<T>& model, Data<T>& data) {
  data.Minv.setZero();
  gather_unit_torques(model, data);
  const Tree& tree = data.tree;
  for (int j = 0; j < model.nv; ++j) {
    const int last = tree.dofs[j].joint;
    for (int i = tree.root[last]; i <= last; ++i) {
      if (tree.root[i] == tree.root[last]) respond(model, data, i, j);
    }
  }
  for (int j = 0; j < model.nv; ++j) {
    for (int k = 0; k < j; ++k) data.Minv(j, k) = data.Minv(k, j);
  }
}

}  // namespace detail

template <class T>
const VectorX<T>& aba(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                      const VectorRef<T>& tau, const Acting<T>& acting) {
  detail::check_arguments("aba", model, data, q, &v, &tau, "tau");
  detail::check_acting("aba", model, acting);
  detail::place_joints(model, data, q);
  detail::articulate(model, data, acting);
  detail::aba_placed(model, data, v, tau, acting);
  return data.ddq;
}

template <class T>
const MatrixX<T>& minverse(const Model<T>& model, Data<T>& data, const VectorRef<T>& q,
                           const Acting<T>& acting) {
  detail::check_arguments("minverse", model, data, q);
  detail::check_acting("minverse", model, acting);
  detail::place_joints(model, data, q);
  detail::articulate(model, data, acting);
  detail::minverse_articulated(model, data);
  return data.Minv;
}

}  // namespace dyntape::dynamics
