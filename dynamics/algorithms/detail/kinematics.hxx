// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/algorithms/detail/checks.hxx>

namespace dyntape::dynamics {
namespace detail {

template <class T>
void place_bodies(const Model<T>& model, Data<T>& data, const VectorRef<T>& q) {
  place_joints(model, data, q);
  for (int i = 0; i < model.njoints(); ++i) {
    const int p = model.parent[i];
    data.X_WB[i] = p < 0 ? data.X_PB[i] : data.X_WB[p] * data.X_PB[i];
  }
}

// A place on a body.
template <class T>
struct Site {
  int body = -1;      // -1: fixed to the world
  Placement<T> X_BF;  // in the body
};

template <class T>
Site<T> site_of(const char* function, const Model<T>& model, Place place) {
  if (!place.is_body) {
    const Frame<T>& F = frame_at(function, model, place.index);
    return {F.body, F.X_BF};
  }
  check_body(function, model, place.index);
  return {place.index, {}};
}

// A motion of frame F, known in F, in the frame asked for.
template <class T>
Motion<T> expressed(const Placement<T>& X_WF, const Motion<T>& m, ReferenceFrame in) {
  if (in == ReferenceFrame::kLocal) return m;
  if (in == ReferenceFrame::kWorld) return act(X_WF, m);
  return {X_WF.R * m.linear, X_WF.R * m.angular};
}

// Of a frame, from the motions of the bodies, each in its own frame.
template <class T>
Motion<T> frame_motion(const char* function, const Model<T>& model, const Data<T>& data, int frame,
                       const std::vector<Motion<T>>& bodies, ReferenceFrame in) {
  const Frame<T>& F = frame_at(function, model, frame);
  if (F.body < 0) return {};
  return expressed(frame_placement(model, data, frame), act_inverse(F.X_BF, bodies[F.body]), in);
}

// Column S_j, seen from F: the placement of F in body j is gathered on the way to the root.
template <class T>
const Matrix6X<T>& site_jacobian(const Model<T>& model, Data<T>& data, const VectorRef<T>& q,
                                 const Site<T>& site, ReferenceFrame in) {
  data.J.setZero();
  Placement<T> X_BF = site.X_BF;
  const Tree& tree = data.tree;
  for (int i = site.body; i >= 0; i = model.parent[i]) {
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
      data.J.col(k) = act_inverse(X_BF, motion<T>(tree.dofs[k])).vector();
    }
    X_BF = joint_placement<T>(model.joints[i], tree.axes[i], model.X_PJ[i], q) * X_BF;
  }
  if (in == ReferenceFrame::kLocal) return data.J;
  for (int i = site.body; i >= 0; i = model.parent[i]) {
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
      const Motion<T> local{data.J.col(k).template head<3>(), data.J.col(k).template tail<3>()};
      data.J.col(k) = expressed(X_BF, local, in).vector();
    }
  }
  return data.J;
}

}  // namespace detail

template <class T>
void forward_kinematics(const Model<T>& model, Data<T>& data, const VectorRef<T>& q) {
  detail::check_arguments("forward_kinematics", model, data, q);
  detail::place_bodies(model, data, q);
}

template <class T>
void forward_kinematics(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v) {
  detail::check_arguments("forward_kinematics", model, data, q, &v);
  detail::place_bodies(model, data, q);
  detail::move_bodies(model, data, v);
}

template <class T>
void forward_kinematics(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                        const VectorRef<T>& a) {
  detail::check_arguments("forward_kinematics", model, data, q, &v, &a);
  detail::place_bodies(model, data, q);
  detail::move_bodies(model, data, v);
  for (int i = 0; i < model.njoints(); ++i) {
    const int p = model.parent[i];
    const Motion<T> own = detail::joint_motion(data, a, i) + detail::bias_motion(data, v, i);
    data.a[i] = p < 0 ? own : act_inverse(data.X_PB[i], data.a[p]) + own;
  }
}

template <class T>
Placement<T> frame_placement(const Model<T>& model, const Data<T>& data, int frame) {
  const Frame<T>& F = detail::frame_at("frame_placement", model, frame);
  return F.body < 0 ? F.X_BF : data.X_WB[F.body] * F.X_BF;
}

template <class T>
Motion<T> frame_velocity(const Model<T>& model, const Data<T>& data, int frame, ReferenceFrame in) {
  return detail::frame_motion("frame_velocity", model, data, frame, data.v, in);
}

template <class T>
Motion<T> frame_acceleration(const Model<T>& model, const Data<T>& data, int frame, ReferenceFrame in) {
  return detail::frame_motion("frame_acceleration", model, data, frame, data.a, in);
}

template <class T>
Motion<T> frame_classical_acceleration(const Model<T>& model, const Data<T>& data, int frame,
                                       ReferenceFrame in) {
  const char* who = "frame_classical_acceleration";
  const Motion<T> v = detail::frame_motion(who, model, data, frame, data.v, in);
  Motion<T> a = detail::frame_motion(who, model, data, frame, data.a, in);
  a.linear += v.angular.cross(v.linear);
  return a;
}

template <class T>
const Matrix6X<T>& frame_jacobian(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, Place frame,
                                  ReferenceFrame in) {
  detail::check_arguments("frame_jacobian", model, data, q);
  return detail::site_jacobian(model, data, q, detail::site_of("frame_jacobian", model, frame), in);
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_KINEMATICS(T, ...)                                                  \
  DYNTAPE_COMPILE(frame_placement, T, __VA_ARGS__)                                              \
  DYNTAPE_COMPILE(frame_velocity, T, __VA_ARGS__)                                               \
  DYNTAPE_COMPILE(frame_acceleration, T, __VA_ARGS__)                                           \
  DYNTAPE_COMPILE(frame_classical_acceleration, T, __VA_ARGS__)                                 \
  DYNTAPE_COMPILE(frame_jacobian, T, __VA_ARGS__)                                               \
  namespace dyntape::dynamics {                                                                 \
  __VA_ARGS__ template void forward_kinematics(const Model<T>&, Data<T>&, const VectorRef<T>&); \
  __VA_ARGS__ template void forward_kinematics(const Model<T>&, Data<T>&, const VectorRef<T>&,  \
                                               const VectorRef<T>&);                            \
  __VA_ARGS__ template void forward_kinematics(const Model<T>&, Data<T>&, const VectorRef<T>&,  \
                                               const VectorRef<T>&, const VectorRef<T>&);       \
  }

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_KINEMATICS)
