// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/algorithms/centroidal.h>
#include <dyntape/dynamics/algorithms/detail/subtree_sums.hxx>

namespace dyntape::dynamics {
namespace detail {

// Places the bodies about the origin of the first root: where that one is enters nothing but c.com.
template <class T>
void place_about_root(const Model<T>& model, Data<T>& data, Centroidal<T>& c, const VectorRef<T>& q) {
  place_joints(model, data, q);
  for (int i = 0; i < model.njoints(); ++i) {
    const int p = model.parent[i];
    if (p >= 0) {
      c.X_GB[i] = c.X_GB[p] * data.X_PB[i];
    } else if (i == 0) {
      c.X_GB[i] = {data.X_PB[i].R, Vector3<T>::Zero()};
    } else {
      c.X_GB[i] = {data.X_PB[i].R, data.X_PB[i].p - data.X_PB[0].p};
    }
  }
}

// Mass and centre of mass, from the moments of the roots; moves the origin of c.X_GB there.
template <class T>
void center(const Model<T>& model, const Data<T>& data, Centroidal<T>& c) {
  c.mass = T(0);
  Vector3<T> moment = Vector3<T>::Zero();
  for (int i = 0; i < model.njoints(); ++i) {
    if (model.parent[i] >= 0) continue;
    c.mass += c.composites[i].mass;
    moment += c.X_GB[i].R * c.composites[i].h + c.X_GB[i].p * c.composites[i].mass;
  }
  const Vector3<T> from_root = moment * per_mass(c.mass);
  for (Placement<T>& X : c.X_GB) X.p -= from_root;
  c.com = from_root;
  if (model.njoints() > 0) c.com += data.X_PB[0].p;
}

// The sum over all bodies, about G.
template <class T>
Force<T> total(const Model<T>& model, const Centroidal<T>& c, const std::vector<Force<T>>& sums) {
  Force<T> all;
  for (int i = 0; i < model.njoints(); ++i) {
    if (model.parent[i] < 0) all = all + act(c.X_GB[i], sums[i]);
  }
  return all;
}

template <class T>
void sum_momentum(const Model<T>& model, const Data<T>& data, Centroidal<T>& c) {
  for (int i = 0; i < model.njoints(); ++i) c.momentum[i] = model.inertias[i] * data.v[i];
  gather(model, data, c.momentum);
  c.h = total(model, c, c.momentum);
  c.velocity = c.h.linear * per_mass(c.mass);
}

template <class T>
void sum_force(const Model<T>& model, const Data<T>& data, Centroidal<T>& c) {
  for (int i = 0; i < model.njoints(); ++i) {
    const Inertia<T>& I = model.inertias[i];
    c.force[i] = I * data.a[i] + cross(data.v[i], I * data.v[i]);
  }
  gather(model, data, c.force);
  c.h_dot = total(model, c, c.force);
  c.acceleration = c.h_dot.linear * per_mass(c.mass);
}

// Mass, centre of mass, c.A and c.I, from composites.
template <class T>
void fill_matrix(const Model<T>& model, const Data<T>& data, Centroidal<T>& c) {
  center(model, data, c);
  Composite<T> whole;
  for (int i = 0; i < model.njoints(); ++i) {
    if (model.parent[i] < 0) accumulate(c.X_GB[i], c.composites[i], whole);
    for (int k = data.tree.first[i]; k < data.tree.first[i] + data.tree.count[i]; ++k) {
      c.A.col(k) = act(c.X_GB[i], c.composites[i] * data.tree.dofs[k]).vector();
    }
  }
  c.I = whole.I_o;
}

// Rate of a composite inertia in a frame at rest: that of its first moment is the momentum p, that of
// int |r|^2 1 - r r^T dm is 2 tr(U) 1 - U - U^T.
template <class T>
Composite<T> inertia_rate(const VelocityProduct<T>& w) {
  Composite<T> rate{T(0), w.p, -(w.U + w.U.transpose())};
  const T twice_trace = T(2) * (w.U(0, 0) + w.U(1, 1) + w.U(2, 2));
  for (int k = 0; k < 3; ++k) rate.I_o(k, k) += twice_trace;
  return rate;
}

template <class T>
Force<T> twice_b(const VelocityProduct<T>& b, const Dof& S) {
  return S.angular ? dynamics::twice_b(b, vector<T>(S.axis)) : Force<T>{};
}

// Does the column move all there is without turning it?
template <class T>
bool is_shift_of_all(const Model<T>& model, const Dof& S) {
  if (S.angular || S.joint != 0) return false;
  for (int i = 1; i < model.njoints(); ++i) {
    if (model.parent[i] < 0) return false;
  }
  return true;
}

template <class T>
void derivative_columns(const Model<T>& model, const Data<T>& data, Centroidal<T>& c, int i, int k) {
  const Dof& S = data.tree.dofs[k];
  const Composite<T>& I = c.composites[i];
  const VelocityProduct<T>& B = c.velocity_products[i];
  const Motion<T> S_v = c.S_dot[k] + cross(data.v[i], S);
  c.dh_dot_dv.col(k) = act(c.X_GB[i], I * S_v + twice_b(B, S)).vector();
  if (is_shift_of_all(model, S)) {
    c.dh_dq.col(k).setZero();
    c.dh_dot_dq.col(k).setZero();
    return;
  }
  const Vector3<T> dc = c.A.col(k).template head<3>() * per_mass(c.mass);
  Force<T> dh = act(c.X_GB[i], I * c.S_dot[k] + cross(S, c.momentum[i]));
  dh.angular -= dc.cross(c.h.linear);
  c.dh_dq.col(k) = dh.vector();
  Force<T> df =
      act(c.X_GB[i], I * c.S_ddot[k] + dynamics::twice_b(B, c.S_dot[k].angular) + cross(S, c.force[i]));
  df.angular -= dc.cross(c.h_dot.linear);
  c.dh_dot_dq.col(k) = df.vector();
}

// Is joint i a descendant of `body`?  (Parents have smaller indices.)
template <class T>
bool is_beyond(const Model<T>& model, int i, int body) {
  while (i > body) {
    i = model.parent[i];
    if (i == body) return true;
  }
  return false;
}

// How column k moves the centre of a mass of 1 / scale, of which all beyond its joint is part.
template <class T>
Vector3<T> com_column(const Data<T>& data, const Centroidal<T>& c, int k, const T& scale) {
  const Dof& S = data.tree.dofs[k];
  return c.X_GB[S.joint].R * Vector3<T>((c.composites[S.joint] * S).linear * scale);
}

// Position of a centre of mass from the moments, velocity and acceleration from momentum and force.
template <class T>
void divide_subtrees(const Model<T>& model, Centroidal<T>& c, bool with_velocity, bool with_acceleration) {
  for (int i = 0; i < model.njoints(); ++i) {
    const T scale = per_mass(c.composites[i].mass);
    c.subtree_mass[i] = c.composites[i].mass;
    c.subtree_com[i] = c.composites[i].h * scale;
    if (with_velocity) c.subtree_velocity[i] = c.momentum[i].linear * scale;
    if (with_acceleration) c.subtree_acceleration[i] = c.force[i].linear * scale;
  }
}

template <class T>
void place_center(const char* function, const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                  const VectorRef<T>& q, const VectorRef<T>* v = nullptr, const VectorRef<T>* a = nullptr) {
  check_arguments(function, model, data, q, v, a);
  check(function, "centroidal", model, c.A.cols(), model.nv);
  check_count(function, "centroidal", model, std::ssize(c.composites));
  place_about_root(model, data, c, q);
  gather_moments(model, data, c.composites);
  center(model, data, c);
  for (int i = 0; i < model.njoints(); ++i) {
    if (v) move_body(model, data, *v, i);
    if (a) accelerate_body(model, data, *v, *a, i);
  }
  if (v) sum_momentum(model, data, c);
  if (a) sum_force(model, data, c);
}

}  // namespace detail

template <class T>
const Vector3<T>& center_of_mass(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                 const VectorRef<T>& q) {
  detail::place_center<T>("center_of_mass", model, data, c, q);
  detail::divide_subtrees(model, c, false, false);
  return c.com;
}

template <class T>
const Vector3<T>& center_of_mass(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                 const VectorRef<T>& q, const VectorRef<T>& v) {
  detail::place_center<T>("center_of_mass", model, data, c, q, &v);
  detail::divide_subtrees(model, c, true, false);
  return c.com;
}

template <class T>
const Vector3<T>& center_of_mass(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                 const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& a) {
  detail::place_center<T>("center_of_mass", model, data, c, q, &v, &a);
  detail::divide_subtrees(model, c, true, true);
  return c.com;
}

template <class T>
const Matrix3X<T>& com_jacobian(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                const VectorRef<T>& q) {
  center_of_mass(model, data, c, q);
  const T scale = per_mass(c.mass);
  for (int k = 0; k < model.nv; ++k) c.J.col(k) = detail::com_column(data, c, k, scale);
  return c.J;
}

template <class T>
const Matrix3X<T>& subtree_com_jacobian(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                        const VectorRef<T>& q, int body) {
  detail::check_body("subtree_com_jacobian", model, body);
  center_of_mass(model, data, c, q);
  c.J.setZero();
  const T scale = per_mass(c.subtree_mass[body]);
  for (int k = 0; k < model.nv; ++k) {
    if (detail::is_beyond(model, data.tree.dofs[k].joint, body)) {
      c.J.col(k) = detail::com_column(data, c, k, scale);
    }
  }
  // Joints at the body or before it carry the subtree as one: a unit mass at its centre.
  Composite<T> point{T(1), c.subtree_com[body], Matrix3<T>::Zero()};
  for (int i = body; i >= 0; i = model.parent[i]) {
    for (int k = data.tree.first[i]; k < data.tree.first[i] + data.tree.count[i]; ++k) {
      c.J.col(k) = c.X_GB[i].R * (point * data.tree.dofs[k]).linear;
    }
    point.h = data.X_PB[i].R * point.h + data.X_PB[i].p;
  }
  return c.J;
}

template <class T>
const Force<T>& centroidal_momentum(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                    const VectorRef<T>& q, const VectorRef<T>& v) {
  detail::place_center<T>("centroidal_momentum", model, data, c, q, &v);
  return c.h;
}

template <class T>
const Force<T>& centroidal_momentum_rate(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                         const VectorRef<T>& q, const VectorRef<T>& v,
                                         const VectorRef<T>& a) {
  detail::place_center<T>("centroidal_momentum_rate", model, data, c, q, &v, &a);
  return c.h_dot;
}

template <class T>
const Matrix6X<T>& centroidal_matrix(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                     const VectorRef<T>& q) {
  detail::check_arguments("centroidal_matrix", model, data, q);
  detail::check("centroidal_matrix", "centroidal", model, c.A.cols(), model.nv);
  detail::check_count("centroidal_matrix", "centroidal", model, std::ssize(c.composites));
  detail::place_about_root(model, data, c, q);
  detail::gather_composites(model, data, c.composites);
  detail::fill_matrix(model, data, c);
  return c.A;
}

template <class T>
const Matrix6X<T>& centroidal_matrix_rate(const Model<T>& model, Data<T>& data, Centroidal<T>& c,
                                          const VectorRef<T>& q, const VectorRef<T>& v) {
  detail::check_arguments("centroidal_matrix_rate", model, data, q, &v);
  centroidal_matrix(model, data, c, q);
  for (int i = 0; i < model.njoints(); ++i) detail::move_body(model, data, v, i);
  detail::sum_momentum(model, data, c);
  detail::gather_velocity_products(model, data, c.velocity_products);
  for (int i = 0; i < model.njoints(); ++i) {
    const Composite<T> I_dot = detail::inertia_rate(c.velocity_products[i]);
    for (int k = data.tree.first[i]; k < data.tree.first[i] + data.tree.count[i]; ++k) {
      const Dof& S = data.tree.dofs[k];
      Force<T> rate = act(c.X_GB[i], I_dot * S + c.composites[i] * cross(data.v[i], S));
      rate.angular -= c.velocity.cross(Vector3<T>(c.A.col(k).template head<3>()));
      c.A_dot.col(k) = rate.vector();
    }
  }
  return c.A_dot;
}

template <class T>
void centroidal_derivatives(const Model<T>& model, Data<T>& data, Centroidal<T>& c, const VectorRef<T>& q,
                            const VectorRef<T>& v, const VectorRef<T>& a) {
  detail::check_arguments("centroidal_derivatives", model, data, q, &v, &a);
  centroidal_matrix(model, data, c, q);
  const Tree& tree = data.tree;
  for (int i = 0; i < model.njoints(); ++i) {
    const Motion<T> v_p = detail::move_body(model, data, v, i);
    const Motion<T> a_p = detail::accelerate_body(model, data, v, a, i);
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
      c.S_dot[k] = cross(v_p, tree.dofs[k]);
      c.S_ddot[k] = cross(a_p, tree.dofs[k]) + cross(v_p, c.S_dot[k]);
    }
  }
  detail::sum_momentum(model, data, c);
  detail::sum_force(model, data, c);
  detail::gather_velocity_products(model, data, c.velocity_products);
  for (int i = 0; i < model.njoints(); ++i) {
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
      detail::derivative_columns(model, data, c, i, k);
    }
  }
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_CENTROIDAL(T, ...)                                                     \
  DYNTAPE_COMPILE(com_jacobian, T, __VA_ARGS__)                                                    \
  DYNTAPE_COMPILE(subtree_com_jacobian, T, __VA_ARGS__)                                            \
  DYNTAPE_COMPILE(centroidal_momentum, T, __VA_ARGS__)                                             \
  DYNTAPE_COMPILE(centroidal_momentum_rate, T, __VA_ARGS__)                                        \
  DYNTAPE_COMPILE(centroidal_matrix, T, __VA_ARGS__)                                               \
  DYNTAPE_COMPILE(centroidal_matrix_rate, T, __VA_ARGS__)                                          \
  DYNTAPE_COMPILE(centroidal_derivatives, T, __VA_ARGS__)                                          \
  namespace dyntape::dynamics {                                                                    \
  __VA_ARGS__ template const Vector3<T>& center_of_mass(const Model<T>&, Data<T>&, Centroidal<T>&, \
                                                        const VectorRef<T>&);                      \
  __VA_ARGS__ template const Vector3<T>& center_of_mass(const Model<T>&, Data<T>&, Centroidal<T>&, \
                                                        const VectorRef<T>&, const VectorRef<T>&); \
  __VA_ARGS__ template const Vector3<T>& center_of_mass(const Model<T>&, Data<T>&, Centroidal<T>&, \
                                                        const VectorRef<T>&, const VectorRef<T>&,  \
                                                        const VectorRef<T>&);                      \
  }

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_CENTROIDAL)
