// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/effects/wrenches.h>
#include <dyntape/dynamics/algorithms/detail/checks.hxx>

namespace dyntape::dynamics {
namespace detail {

template <class T>
void accumulate(const Placement<T>& X_PB, const WrenchSum<T>& w, WrenchSum<T>& parent) {
  const Vector3<T> f = X_PB.R * w.f;
  const Matrix3<T> RP = X_PB.R * w.P;
  parent.all = parent.all + act(X_PB, w.all);
  parent.f += f;
  parent.n += X_PB.R * w.n;
  parent.P += RP * X_PB.R.transpose() + X_PB.p * f.transpose();
}

// What wrenches that do not turn lose, seen from a frame that turns with s:
//   (s x f, s x n + sum r x (s x f)),   sum r x (s x f) = tr(P) s - P^T s.
template <class T>
Force<T> left_behind(const WrenchSum<T>& w, const Vector3<T>& s) {
  const T trace = w.P(0, 0) + w.P(1, 1) + w.P(2, 2);
  return {s.cross(w.f), s.cross(w.n) + s * trace - w.P.transpose() * s};
}

// The couple c with c . s = S . left_behind(s) for every s.
template <class T>
Vector3<T> left_behind_transposed(const WrenchSum<T>& w, const Motion<T>& S) {
  const T trace = w.P(0, 0) + w.P(1, 1) + w.P(2, 2);
  return w.f.cross(S.linear) + w.n.cross(S.angular) + S.angular * trace - w.P * S.angular;
}

template <class T>
void check_wrenches(const char* function, const Model<T>& model, const std::vector<Wrench<T>>& wrenches) {
  for (std::size_t k = 0; k < wrenches.size(); ++k) {
    if (wrenches[k].body >= -1 && wrenches[k].body < model.njoints()) continue;
    throw ArgumentError(std::string(function) + ": wrench " + std::to_string(k) + " acts on body " +
                        std::to_string(wrenches[k].body) + ", model \"" + model.name + "\" has " +
                        std::to_string(model.njoints()));
  }
}

// From the leaves: w.sums of whole subtrees, and w.tau.
template <class T>
void gather_wrenches(const Model<T>& model, const Data<T>& data, WrenchTorques<T>& w) {
  const Tree& tree = data.tree;
  for (int i = model.njoints() - 1; i >= 0; --i) {
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
      w.tau[k] = dot(tree.dofs[k], w.sums[i].all);
    }
    const int p = model.parent[i];
    if (p >= 0) accumulate(data.X_PB[i], w.sums[i], w.sums[p]);
  }
}

template <class T>
void clear_wrenches(WrenchTorques<T>& w) {
  for (WrenchSum<T>& sum : w.sums) sum = {};
}

// Column k, and row k where the joint of another column stands before it.
template <class T>
void wrench_column(const Model<T>& model, const Data<T>& data, WrenchTorques<T>& w, int i, int k) {
  const Tree& tree = data.tree;
  const Dof& S = tree.dofs[k];
  const WrenchSum<T>& sum = w.sums[i];
  const Force<T> left = S.angular ? left_behind(sum, vector<T>(S.axis)) : Force<T>{};
  for (int r = tree.first[i]; r < tree.first[i] + tree.count[i]; ++r) {
    w.dtau_dq(r, k) = -dot(tree.dofs[r], left);
  }
  Force<T> change = cross(S, sum.all) - left;
  Vector3<T> couple = left_behind_transposed(sum, motion<T>(S));
  for (int j = i; model.parent[j] >= 0;) {
    change = act(data.X_PB[j], change);
    couple = data.X_PB[j].R * couple;
    j = model.parent[j];
    for (int r = tree.first[j]; r < tree.first[j] + tree.count[j]; ++r) {
      const Dof& S_r = tree.dofs[r];
      w.dtau_dq(r, k) = dot(S_r, change);
      if (S_r.angular) w.dtau_dq(k, r) = -dot(S_r.axis, couple);
    }
  }
}

template <class T>
void start_wrenches(const char* function, const Model<T>& model, Data<T>& data, WrenchTorques<T>& w,
                    const std::vector<Wrench<T>>& wrenches, const VectorRef<T>& q) {
  check_arguments(function, model, data, q);
  check(function, "torques", model, w.tau.size(), model.nv);
  check_count(function, "torques", model, std::ssize(w.sums));
  check_wrenches(function, model, wrenches);
  forward_kinematics(model, data, q);
  clear_wrenches(w);
  for (const Wrench<T>& wrench : wrenches) add_wrench(data, w, wrench);
  gather_wrenches(model, data, w);
}

// w.dtau_dq, after gather_wrenches.
template <class T>
void differentiate_wrenches(const Model<T>& model, const Data<T>& data, WrenchTorques<T>& w) {
  for (int i = 0; i < model.njoints(); ++i) {
    for (int k = data.tree.first[i]; k < data.tree.first[i] + data.tree.count[i]; ++k) {
      wrench_column(model, data, w, i, k);
    }
  }
}

}  // namespace detail

template <class T>
void add_wrench(const Data<T>& data, WrenchTorques<T>& w, const Wrench<T>& wrench) {
  if (wrench.body < 0) return;
  WrenchSum<T>& sum = w.sums[wrench.body];
  if (wrench.fixed_in == FixedIn::kBody) {
    sum.all = sum.all + act(wrench.X_BF, wrench.value);
    return;
  }
  const Matrix3<T> R_BW = data.X_WB[wrench.body].R.transpose();
  const Vector3<T> f = R_BW * wrench.value.linear, n = R_BW * wrench.value.angular, &r = wrench.X_BF.p;
  sum.all = sum.all + Force<T>{f, n + r.cross(f)};
  sum.f += f;
  sum.n += n;
  sum.P += r * f.transpose();
}

template <class T>
Wrench<T> wrench_at_frame(const Model<T>& model, int frame, FixedIn fixed_in,
                          const std::type_identity_t<Force<T>>& value) {
  const Frame<T>& F = detail::frame_at("wrench_at_frame", model, frame);
  return {F.body, F.X_BF, fixed_in, value};
}

template <class T>
const VectorX<T>& wrench_torques(const Model<T>& model, Data<T>& data, WrenchTorques<T>& w,
                                 const std::vector<Wrench<T>>& wrenches, const VectorRef<T>& q) {
  detail::start_wrenches("wrench_torques", model, data, w, wrenches, q);
  return w.tau;
}

template <class T>
const MatrixX<T>& wrench_torque_derivatives(const Model<T>& model, Data<T>& data, WrenchTorques<T>& w,
                                            const std::vector<Wrench<T>>& wrenches, const VectorRef<T>& q) {
  detail::start_wrenches("wrench_torque_derivatives", model, data, w, wrenches, q);
  detail::differentiate_wrenches(model, data, w);
  return w.dtau_dq;
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_WRENCHES(T, ...)       \
  DYNTAPE_COMPILE(add_wrench, T, __VA_ARGS__)      \
  DYNTAPE_COMPILE(wrench_at_frame, T, __VA_ARGS__) \
  DYNTAPE_COMPILE(wrench_torques, T, __VA_ARGS__)  \
  DYNTAPE_COMPILE(wrench_torque_derivatives, T, __VA_ARGS__)

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_WRENCHES)
