// SPDX-License-Identifier: BSD-3-Clause
//
// Checks of argument sizes, and small functions that several recursions share.
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/checks.h>

namespace dyntape::dynamics::detail {

template <class T>
void check_arguments(const char* function, const Model<T>& model, const Data<T>& data, const VectorRef<T>& q,
                     const VectorRef<T>* v = nullptr, const VectorRef<T>* a = nullptr,
                     const char* last = "a") {
  check(function, "q", model, q.size(), model.nq);
  if (v) check(function, "v", model, v->size(), model.nv);
  if (a) check(function, last, model, a->size(), model.nv);
  check_shape(function, "data", model, data.shape);
}

template <class T>
void check_body(const char* function, const Model<T>& model, int body) {
  if (body >= 0 && body < model.njoints()) return;
  throw ArgumentError(std::string(function) + ": body " + std::to_string(body) + " does not exist, model \"" +
                      model.name + "\" has " + std::to_string(model.njoints()));
}

template <class T>
const Frame<T>& frame_at(const char* function, const Model<T>& model, int frame) {
  const int n = static_cast<int>(model.frames.size());
  if (frame >= 0 && frame < n) return model.frames[frame];
  throw ArgumentError(std::string(function) + ": frame " + std::to_string(frame) +
                      " does not exist, model \"" + model.name + "\" has " + std::to_string(n));
}

template <class T>
void check_acting(const char* function, const Model<T>& model, const DynamicsTerms<T>& acting) {
  if (acting.armature_values) check(function, "armature", model, acting.armature_values->size(), model.nv);
  if (acting.rotor_inertia && acting.gear_ratio) {
    check(function, "rotor inertia", model, acting.rotor_inertia->size(), model.nv);
    check(function, "gear ratio", model, acting.gear_ratio->size(), model.nv);
  }
  for (int i = 0; i < acting.added.count; ++i) {
    const int body = acting.added.at(acting.added.list, i).body;
    if (body >= 0) check_body(function, model, body);
  }
  if (acting.external) {
    check(function, "external", model, static_cast<long>(acting.external->size()), model.njoints());
  }
}

template <class T>
void check_arguments(const char* function, const Model<T>& model, const Data<T>& data,
                     const DynamicsTerms<T>& acting, const VectorRef<T>& q, const VectorRef<T>* v = nullptr,
                     const VectorRef<T>* a = nullptr, const char* last = "a") {
  check_arguments(function, model, data, q, v, a, last);
  check_acting(function, model, acting);
}

// Returns true if an armature acts at joint i; armature_at returns it.
template <class T>
DYNTAPE_INLINE bool has_armature(const Model<T>& model, const DynamicsTerms<T>& acting, int i) {
  return acting.armature && is_single(model.joints[i].type);
}

template <class T>
DYNTAPE_INLINE T armature_at(const Model<T>& model, const DynamicsTerms<T>& acting, int i) {
  if (!has_armature(model, acting, i)) return T(0);
  const int k = model.joints[i].idx_v;
  T inertia = acting.armature_values ? (*acting.armature_values)[k] : model.joints[i].armature;
  if (acting.rotor_inertia && acting.gear_ratio) {
    const T& ratio = (*acting.gear_ratio)[k];
    inertia += ratio * ratio * (*acting.rotor_inertia)[k];
  }
  return inertia;
}

// In plain double, the sines of all joints are computed in lanes, with the bits of one at a time.
template <class T>
void place_joints(const Model<T>& model, Data<T>& data, const VectorRef<T>& q) {
  const Tree& tree = data.tree;
  std::size_t turned = 0, turning = 0;
  if constexpr (std::is_same_v<T, double>) {
    turning = tree.turning.size();
    for (std::size_t k = 0; k < turning; ++k) data.angles[k] = q[model.joints[tree.turning[k]].idx_q];
    own::sincos(data.angles.data(), data.sines.data(), data.cosines.data(), static_cast<int>(turning));
  }
  for (int i = 0; i < model.njoints(); ++i) {
    if (turned < turning && tree.turning[turned] == i) {
      data.X_PB[i] = turned_placement<T>(model.joints[i], tree.axes[i], model.X_PJ[i], data.angles[turned],
                                         data.sines[turned], data.cosines[turned]);
      ++turned;
    } else {
      data.X_PB[i] = joint_placement<T>(model.joints[i], tree.axes[i], model.X_PJ[i], q);
    }
  }
}

// S x: the joint's part of a velocity or acceleration.
template <class T>
DYNTAPE_INLINE Motion<T> joint_motion(const Data<T>& data, const VectorRef<T>& x, int i) {
  const Tree& tree = data.tree;
  const int k = tree.first[i];
  if (tree.is_free(i)) return {x.template segment<3>(k), x.template segment<3>(k + 3)};
  Motion<T> m;
  for (int c = k; c < k + tree.count[i]; ++c) add_along(tree.dofs[c], x[c], m);
  return m;
}

// v_i x S v_i: for a single column computed directly.
template <class T>
DYNTAPE_INLINE Motion<T> bias_motion(const Data<T>& data, const VectorRef<T>& v, int i) {
  const Tree& tree = data.tree;
  if (tree.count[i] > 1) return cross(data.v[i], joint_motion(data, v, i));
  const Motion<T> c = cross(data.v[i], tree.dofs[tree.first[i]]);
  const T& s = v[tree.first[i]];
  return {c.linear * s, c.angular * s};
}

// Acceleration of the world relative to free fall, in a root body's frame: depends on the root's rotation only.
template <class T>
DYNTAPE_INLINE Motion<T> root_acceleration(const Model<T>& model, const Data<T>& data,
                                           const DynamicsTerms<T>& acting, int i) {
  Motion<T> a;
  const Vector3<T>& gravity = acting.gravity_value ? *acting.gravity_value : model.gravity;
  if (acting.gravity) a.linear = -(data.X_PB[i].R.transpose() * gravity);
  return a;
}

// Velocities of all bodies.
template <class T>
void move_bodies(const Model<T>& model, Data<T>& data, const VectorRef<T>& v) {
  for (int i = 0; i < model.njoints(); ++i) {
    const int p = model.parent[i];
    const Motion<T> own = joint_motion(data, v, i);
    data.v[i] = p < 0 ? own : act_inverse(data.X_PB[i], data.v[p]) + own;
  }
}

// The velocities for recursions: zero if velocity products are disabled, so that their terms fold on a tape.
template <class T>
void move_bodies(const Model<T>& model, Data<T>& data, const VectorRef<T>& v,
                 const DynamicsTerms<T>& acting) {
  if (acting.coriolis) return move_bodies(model, data, v);
  for (Motion<T>& motion : data.v) motion = {};
}

}  // namespace dyntape::dynamics::detail
