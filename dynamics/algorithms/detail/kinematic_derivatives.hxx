// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/algorithms/kinematic_derivatives.h>
#include <dyntape/dynamics/algorithms/detail/kinematics.hxx>

namespace dyntape::dynamics {
namespace detail {

// What the bodies and columns on the way from a site to the root look like in the frame asked for.  In
// kLocalWorldAligned that is a frame at the site's origin whose axes are the world's: no position of the base
// enters.
template <class T>
struct View {
  ReferenceFrame in;
  Placement<T> X_BF;  // of the frame asked for in the body at hand; unused in kWorld

  Motion<T> operator()(const Data<T>& data, int i, const Motion<T>& m) const {
    return in == ReferenceFrame::kWorld ? act(data.X_WB[i], m) : act_inverse(X_BF, m);
  }
};

// Calls visit(body, view) for each body from the site's to the root.
template <class T, class Visit>
void walk(const Model<T>& model, const Data<T>& data, const Site<T>& site, ReferenceFrame in, Visit visit) {
  View<T> view{in, site.X_BF};
  for (int i = site.body; i >= 0; i = model.parent[i]) {
    if (in == ReferenceFrame::kLocalWorldAligned) view.X_BF.R = data.X_WB[i].R.transpose();
    visit(i, view);
    if (model.parent[i] < 0 || in == ReferenceFrame::kWorld) continue;
    view.X_BF.p = data.X_PB[i].p + data.X_PB[i].R * view.X_BF.p;
    if (in == ReferenceFrame::kLocal) view.X_BF.R = data.X_PB[i].R * view.X_BF.R;
  }
}

template <class T>
void gather_columns(const Data<T>& data, int i, const View<T>& view, std::vector<int>& support,
                    std::vector<Motion<T>>& S) {
  for (int k = data.tree.first[i]; k < data.tree.first[i] + data.tree.count[i]; ++k) {
    support.push_back(k);
    S[k] = view(data, i, motion<T>(data.tree.dofs[k]));
  }
}

template <class T>
void put_column(Matrix6X<T>& columns, int k, const Motion<T>& m) {
  T* column = columns.data() + 6 * static_cast<Eigen::Index>(k);
  for (int r = 0; r < 3; ++r) {
    column[r] = m.linear.at(r);
    column[r + 3] = m.angular.at(r);
  }
}

// The place, once data and a workspace for `nv` dofs fit the model.
template <class T>
Site<T> checked_site(const char* function, const Model<T>& model, const Data<T>& data, Place place, long nv,
                     long njoints) {
  check_shape(function, "data", model, data.shape);
  check(function, "workspace", model, nv, model.nv);
  check_count(function, "workspace", model, njoints);
  return site_of(function, model, place);
}

// Up to which derivative in time the bodies are looked at.
enum class Order { kVelocity, kAcceleration };

// Columns, motions of the bodies, and K.V, K.A, K.C, K.J.
template <class T>
void gather_motions(const Model<T>& model, const Data<T>& data, KinematicDerivatives<T>& K,
                    const Site<T>& site, ReferenceFrame in, Order order) {
  K.support.clear();
  K.J.setZero();
  K.V = {};
  if (order == Order::kAcceleration) K.A = K.C = {};
  walk(model, data, site, in, [&](int i, const View<T>& view) {
    gather_columns(data, i, view, K.support, K.S);
    K.v[i] = view(data, i, data.v[i]);
    if (order == Order::kAcceleration) K.a[i] = view(data, i, data.a[i]);
  });
  for (int k : K.support) put_column(K.J, k, K.S[k]);
  if (site.body < 0) return;
  K.V = K.v[site.body];
  if (order == Order::kVelocity) return;
  K.A = K.C = K.a[site.body];
  K.C.linear += K.V.angular.cross(K.V.linear);
}

// (w x l, w x m): what turning the axes with w does to the components of m.
template <class T>
Motion<T> turned(const Vector3<T>& w, const Motion<T>& m) {
  return {w.cross(m.linear), w.cross(m.angular)};
}

// J_dot_j; V_i the velocity of the body of the column.  docs/math.md (K.6)
template <class T>
Motion<T> column_rate(ReferenceFrame in, const Motion<T>& J, const Motion<T>& V_i, const Motion<T>& V) {
  if (in == ReferenceFrame::kWorld) return cross(V_i, J);
  const Motion<T> beyond = V - V_i;
  if (in == ReferenceFrame::kLocal) return cross(J, beyond);
  return {V_i.angular.cross(J.linear) + J.angular.cross(beyond.linear), V_i.angular.cross(J.angular)};
}

// Slope by q_j of a motion m of the frame of which m_p comes from the parent, seen in the frame asked for: J_j
// turns what is beyond the joint, and kLocal sees m_p turn the other way.  docs/math.md (K.8)
template <class T>
Motion<T> slope(ReferenceFrame in, const Motion<T>& J, const Motion<T>& m_p, const Motion<T>& m) {
  if (in == ReferenceFrame::kLocal) return cross(m_p, J);
  const Motion<T> beyond = m - m_p;
  if (in == ReferenceFrame::kWorld) return cross(J, beyond);
  Motion<T> s = turned(J.angular, beyond);
  s.linear += m_p.angular.cross(J.linear);
  return s;
}

template <class T>
Motion<T> parent_motion(const Model<T>& model, const std::vector<Motion<T>>& m, int i) {
  return model.parent[i] < 0 ? Motion<T>{} : m[model.parent[i]];
}

// From derivatives of V and A those of C = A + (w x v, 0).
template <class T>
Motion<T> classical(const Motion<T>& V, const Motion<T>& dV, const Motion<T>& dA) {
  return {dA.linear + dV.angular.cross(V.linear) + V.angular.cross(dV.linear), dA.angular};
}

// dJ_k/dq_j; joint_k and joint_j on one path, the smaller nearer to the root.
template <class T>
Motion<T> hessian_entry(ReferenceFrame in, const Motion<T>& J_k, const Motion<T>& J_j, int joint_k,
                        int joint_j) {
  const bool nearer = joint_k < joint_j;
  switch (in) {
    case ReferenceFrame::kLocal:
      return nearer ? cross(J_k, J_j) : Motion<T>{};
    case ReferenceFrame::kWorld:
      return nearer ? Motion<T>{} : cross(J_j, J_k);
    case ReferenceFrame::kLocalWorldAligned:
      break;
  }
  if (nearer) return {J_k.angular.cross(J_j.linear), Vector3<T>::Zero()};
  return turned(J_j.angular, J_k);
}

// f . (a x b) = -b . (a x* f), and f . (w x b, w x c) = (b, c) . (f x w, ...): one vector a column.
template <class T>
Force<T> weight(ReferenceFrame in, const Motion<T>& J, const Force<T>& f) {
  if (in == ReferenceFrame::kLocalWorldAligned) {
    return {f.linear.cross(J.angular), f.angular.cross(J.angular)};
  }
  const Force<T> g = cross(J, f);
  return {-g.linear, -g.angular};
}

}  // namespace detail

template <class T>
KinematicDerivatives<T>::KinematicDerivatives(const Model<T>& model) {
  for (auto* x : {&J, &J_dot, &dV_dq, &dA_dq, &dA_dv, &dC_dq, &dC_dv}) *x = Matrix6X<T>::Zero(6, model.nv);
  fH = MatrixX<T>::Zero(model.nv, model.nv);
  support.reserve(model.nv);
  fH_support.reserve(model.nv);
  S.resize(model.nv);
  for (auto* x : {&v, &a}) x->resize(model.njoints());
}

template <class T>
KinematicHessian<T>::KinematicHessian(const Model<T>& model) : nv(model.nv), S(model.nv) {
  H = Matrix6X<T>::Zero(6, static_cast<Eigen::Index>(nv) * nv);
  support.reserve(nv);
}

template <class T>
const Matrix6X<T>& frame_jacobian_rate(const Model<T>& model, const Data<T>& data, KinematicDerivatives<T>& K,
                                       Place frame, ReferenceFrame in) {
  const auto site =
      detail::checked_site("frame_jacobian_rate", model, data, frame, K.J.cols(), std::ssize(K.v));
  detail::gather_motions(model, data, K, site, in, detail::Order::kVelocity);
  K.J_dot.setZero();
  for (int k : K.support)
    detail::put_column(K.J_dot, k, detail::column_rate(in, K.S[k], K.v[data.tree.dofs[k].joint], K.V));
  return K.J_dot;
}

template <class T>
void frame_velocity_derivatives(const Model<T>& model, const Data<T>& data, KinematicDerivatives<T>& K,
                                Place frame, ReferenceFrame in) {
  const auto site =
      detail::checked_site("frame_velocity_derivatives", model, data, frame, K.J.cols(), std::ssize(K.v));
  detail::gather_motions(model, data, K, site, in, detail::Order::kVelocity);
  K.dV_dq.setZero();
  for (int k : K.support) {
    detail::put_column(
        K.dV_dq, k,
        detail::slope(in, K.S[k], detail::parent_motion(model, K.v, data.tree.dofs[k].joint), K.V));
  }
}

template <class T>
void frame_acceleration_derivatives(const Model<T>& model, const Data<T>& data, KinematicDerivatives<T>& K,
                                    Place frame, ReferenceFrame in) {
  const auto site =
      detail::checked_site("frame_acceleration_derivatives", model, data, frame, K.J.cols(), std::ssize(K.v));
  detail::gather_motions(model, data, K, site, in, detail::Order::kAcceleration);
  for (auto* x : {&K.J_dot, &K.dV_dq, &K.dA_dq, &K.dA_dv, &K.dC_dq, &K.dC_dv}) x->setZero();
  for (int k : K.support) {
    const Motion<T>& J = K.S[k];
    const int i = data.tree.dofs[k].joint;
    const Motion<T> V_p = detail::parent_motion(model, K.v, i), A_p = detail::parent_motion(model, K.a, i);
    const Motion<T> shift = cross(V_p, J);
    const Motion<T> dV_dq = detail::slope(in, J, V_p, K.V);
    const Motion<T> dA_dq = detail::slope(in, J, A_p, K.A) + cross(shift, K.V - V_p);
    const Motion<T> dA_dv = cross(J, K.V - K.v[i]) + shift;
    detail::put_column(K.J_dot, k, detail::column_rate(in, J, K.v[i], K.V));
    detail::put_column(K.dV_dq, k, dV_dq);
    detail::put_column(K.dA_dq, k, dA_dq);
    detail::put_column(K.dA_dv, k, dA_dv);
    detail::put_column(K.dC_dq, k, detail::classical(K.V, dV_dq, dA_dq));
    detail::put_column(K.dC_dv, k, detail::classical(K.V, J, dA_dv));
  }
}

template <class T>
const Matrix6X<T>& frame_hessian(const Model<T>& model, const Data<T>& data, KinematicHessian<T>& K,
                                 Place frame, ReferenceFrame in) {
  const auto site = detail::checked_site("frame_hessian", model, data, frame, K.nv, model.njoints());
  for (int j : K.support) {
    for (int k : K.support) K.H.col(K.nv * j + k).setZero();
  }
  K.support.clear();
  detail::walk(model, data, site, in, [&](int i, const detail::View<T>& view) {
    detail::gather_columns(data, i, view, K.support, K.S);
  });
  const std::vector<Dof>& dofs = data.tree.dofs;
  for (int j : K.support) {
    for (int k : K.support) {
      detail::put_column(K.H, K.nv * j + k,
                         detail::hessian_entry(in, K.S[k], K.S[j], dofs[k].joint, dofs[j].joint));
    }
  }
  return K.H;
}

template <class T>
const MatrixX<T>& frame_weighted_hessian(const Model<T>& model, const Data<T>& data,
                                         KinematicDerivatives<T>& K, Place frame, ReferenceFrame in,
                                         const Force<T>& f) {
  const auto site =
      detail::checked_site("frame_weighted_hessian", model, data, frame, K.J.cols(), std::ssize(K.v));
  for (int j : K.fH_support) {
    for (int k : K.fH_support) K.fH(k, j) = T(0);
  }
  K.fH_support.clear();
  detail::walk(model, data, site, in, [&](int i, const detail::View<T>& view) {
    detail::gather_columns(data, i, view, K.fH_support, K.S);
  });
  for (int n : K.fH_support) {
    const Force<T> g = detail::weight(in, K.S[n], f);
    for (int m : K.fH_support) {  // n nearer to the root, or of the same joint
      const int joint_n = data.tree.dofs[n].joint, joint_m = data.tree.dofs[m].joint;
      if (joint_n > joint_m) continue;
      const bool one_joint = joint_n == joint_m;
      switch (in) {
        case ReferenceFrame::kLocal:
          if (!one_joint) K.fH(n, m) = dot(K.S[m], g);
          break;
        case ReferenceFrame::kWorld:
          K.fH(m, n) = dot(K.S[m], g);
          break;
        case ReferenceFrame::kLocalWorldAligned: {
          const T linear = K.S[m].linear.dot(g.linear);
          K.fH(m, n) = linear + K.S[m].angular.dot(g.angular);
          if (!one_joint) K.fH(n, m) = linear;
          break;
        }
      }
    }
  }
  return K.fH;
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_KINEMATIC_DERIVATIVES(T, ...)                 \
  __VA_ARGS__ template struct dyntape::dynamics::KinematicDerivatives<T>; \
  __VA_ARGS__ template struct dyntape::dynamics::KinematicHessian<T>;     \
  DYNTAPE_COMPILE(frame_jacobian_rate, T, __VA_ARGS__)                    \
  DYNTAPE_COMPILE(frame_velocity_derivatives, T, __VA_ARGS__)             \
  DYNTAPE_COMPILE(frame_acceleration_derivatives, T, __VA_ARGS__)         \
  DYNTAPE_COMPILE(frame_hessian, T, __VA_ARGS__)                          \
  DYNTAPE_COMPILE(frame_weighted_hessian, T, __VA_ARGS__)

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_KINEMATIC_DERIVATIVES)
