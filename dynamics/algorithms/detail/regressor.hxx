// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/algorithms/regressor.h>
#include <dyntape/dynamics/algorithms/detail/checks.hxx>

namespace dyntape::dynamics {
namespace detail {

// Force and moment of one body: (d m + B h, h x d + K (Ixx, Ixy, Iyy, Ixz, Iyz, Izz)), K by columns.
template <class T>
struct BodyRegressor {
  Vector3<T> d;
  Matrix3<T> B;
  Vector3<T> K[6];
};

// B = [e] + [w]^2, K = L(e) + [w] L(w) with L(w) (Ixx, ..., Izz) = I w; all from six products of w.
template <class T>
BodyRegressor<T> body_regressor(const Motion<T>& v, const Motion<T>& a, const Vector3<T>& gravity) {
  const Vector3<T>&w = v.angular, &e = a.angular;
  const T xx = w[0] * w[0], yy = w[1] * w[1], zz = w[2] * w[2];
  const T xy = w[0] * w[1], xz = w[0] * w[2], yz = w[1] * w[2];
  return {a.linear + w.cross(v.linear) - gravity,
          {-(yy + zz), xy - e[2], xz + e[1],  //
           xy + e[2], -(xx + zz), yz - e[0],  //
           xz - e[1], yz + e[0], -(xx + yy)},
          {{e[0], xz, -xy},
           {e[1] - xz, e[0] + yz, xx - yy},
           {-yz, e[1], xy},
           {e[2] + xy, zz - xx, e[0] - yz},
           {yy - zz, e[2] - xy, e[1] + xz},
           {yz, -xz, e[2]}}};
}

template <class T>
void check_regressor(const char* function, const Model<T>& model, const RegressorData<T>& regressor) {
  check(function, "regressor", model, regressor.Y.rows(), model.nv);
  check(function, "regressor", model, regressor.kinetic.size(), 10L * model.njoints());
}

}  // namespace detail

template <class T>
Vector10<T> inertial_parameters(const Inertia<T>& inertia) {
  const Vector3<T> h = inertia.com * inertia.mass;
  const Matrix3<T> I = inertia.I_c + unit_point_inertia(inertia.com) * inertia.mass;
  Vector10<T> theta;
  theta << inertia.mass, h[0], h[1], h[2], I(0, 0), I(0, 1), I(1, 1), I(0, 2), I(1, 2), I(2, 2);
  return theta;
}

template <class T>
Inertia<T> inertia_from(const Vector10<T>& theta) {
  const T& mass = theta[0];
  const auto massless = mass == T(0);
  const T per_mass = select(massless, T(0), T(1) / select(massless, T(1), mass));
  Inertia<T> inertia;
  inertia.mass = mass;
  inertia.com = Vector3<T>(theta[1], theta[2], theta[3]) * per_mass;
  const Matrix3<T> I(theta[4], theta[5], theta[7], theta[5], theta[6], theta[8], theta[7], theta[8],
                     theta[9]);
  inertia.I_c = I - unit_point_inertia(inertia.com) * mass;
  return inertia;
}

template <class T>
VectorX<T> inertial_parameters(const Model<T>& model) {
  VectorX<T> theta(10 * model.njoints());
  for (int i = 0; i < model.njoints(); ++i) {
    theta.template segment<10>(10 * i) = inertial_parameters(model.inertias[i]);
  }
  return theta;
}

template <class T>
void set_inertial_parameters(Model<T>& model, const VectorRef<T>& theta) {
  detail::check("set_inertial_parameters", "theta", model, theta.size(), 10L * model.njoints());
  for (int i = 0; i < model.njoints(); ++i) {
    model.inertias[i] = inertia_from(Vector10<T>(theta.template segment<10>(10 * i)));
  }
}

template <class T>
RegressorData<T>::RegressorData(const Model<T>& model, const JointColumns& joint_columns)
    : columns(joint_columns) {
  const int bodies = 10 * model.njoints();
  for (const Joint<T>& joint : model.joints) {
    if (is_single(joint.type)) single.push_back(joint.idx_v);
  }
  Y = MatrixX<T>::Zero(model.nv, bodies + columns.per_dof() * static_cast<int>(single.size()));
  kinetic = potential = RowVectorX<T>::Zero(bodies);
}

template <class T>
const MatrixX<T>& torque_regressor(const Model<T>& model, Data<T>& data, RegressorData<T>& regressor,
                                   const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& a) {
  detail::check_arguments("torque_regressor", model, data, q, &v, &a);
  detail::check_regressor("torque_regressor", model, regressor);
  forward_kinematics(model, data, q, v, a);
  const Tree& tree = data.tree;
  MatrixX<T>& Y = regressor.Y;
  for (int i = 0; i < model.njoints(); ++i) {
    const Vector3<T> gravity = transposed_times(data.X_WB[i].R, Vector3<T>(model.gravity));
    const detail::BodyRegressor<T> body = detail::body_regressor(data.v[i], data.a[i], gravity);
    Placement<T> X_JB;  // of body i in body j, from i to the root
    for (int j = i; j >= 0; j = model.parent[j]) {
      for (int k = tree.first[j]; k < tree.first[j] + tree.count[j]; ++k) {
        const Motion<T> S = act_inverse(X_JB, motion<T>(tree.dofs[k]));
        Vector3<T> h = transposed_times(body.B, S.linear);
        if (tree.dofs[k].angular) h += body.d.cross(S.angular);
        Y(k, 10 * i) = S.linear.dot(body.d);
        for (int c = 0; c < 3; ++c) Y(k, 10 * i + 1 + c) = h[c];
        if (!tree.dofs[k].angular) continue;
        for (int c = 0; c < 6; ++c) Y(k, 10 * i + 4 + c) = S.angular.dot(body.K[c]);
      }
      X_JB = data.X_PB[j] * X_JB;
    }
  }
  int column = 10 * model.njoints();
  const T per_smoothing = T(1) / T(regressor.columns.smoothing);
  if (regressor.columns.armature) {
    for (int k : regressor.single) Y(k, column++) = a[k];
  }
  if (regressor.columns.viscous) {
    for (int k : regressor.single) Y(k, column++) = v[k];
  }
  if (regressor.columns.coulomb) {
    for (int k : regressor.single) Y(k, column++) = tanh(v[k] * per_smoothing);
  }
  return Y;
}

template <class T>
const RowVectorX<T>& kinetic_energy_regressor(const Model<T>& model, Data<T>& data,
                                              RegressorData<T>& regressor, const VectorRef<T>& q,
                                              const VectorRef<T>& v) {
  detail::check_arguments("kinetic_energy_regressor", model, data, q, &v);
  detail::check_regressor("kinetic_energy_regressor", model, regressor);
  forward_kinematics(model, data, q, v);
  for (int i = 0; i < model.njoints(); ++i) {
    const Vector3<T>&l = data.v[i].linear, &w = data.v[i].angular;
    const Vector3<T> h = l.cross(w), half = w * T(0.5);
    const T entries[] = {
        l.squaredNorm() * T(0.5), h[0],        h[1],        h[2],          half[0] * w[0], w[0] * w[1],
        half[1] * w[1],           w[0] * w[2], w[1] * w[2], half[2] * w[2]};
    for (int c = 0; c < 10; ++c) regressor.kinetic[10 * i + c] = entries[c];
  }
  return regressor.kinetic;
}

template <class T>
const RowVectorX<T>& potential_energy_regressor(const Model<T>& model, Data<T>& data,
                                                RegressorData<T>& regressor, const VectorRef<T>& q) {
  detail::check_arguments("potential_energy_regressor", model, data, q);
  detail::check_regressor("potential_energy_regressor", model, regressor);
  forward_kinematics(model, data, q);
  for (int i = 0; i < model.njoints(); ++i) {
    const Placement<T>& X = data.X_WB[i];
    const Vector3<T> g = model.gravity, h = transposed_times(X.R, g);
    regressor.potential[10 * i] = -g.dot(X.p);
    for (int c = 0; c < 3; ++c) regressor.potential[10 * i + 1 + c] = -h[c];
  }
  return regressor.potential;
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_REGRESSOR(T, ...)                              \
  __VA_ARGS__ template struct dyntape::dynamics::RegressorData<T>;         \
  DYNTAPE_COMPILE(inertia_from, T, __VA_ARGS__)                            \
  DYNTAPE_COMPILE(set_inertial_parameters, T, __VA_ARGS__)                 \
  DYNTAPE_COMPILE(torque_regressor, T, __VA_ARGS__)                        \
  DYNTAPE_COMPILE(kinetic_energy_regressor, T, __VA_ARGS__)                \
  DYNTAPE_COMPILE(potential_energy_regressor, T, __VA_ARGS__)              \
  namespace dyntape::dynamics {                                            \
  __VA_ARGS__ template Vector10<T> inertial_parameters(const Inertia<T>&); \
  __VA_ARGS__ template VectorX<T> inertial_parameters(const Model<T>&);    \
  }

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_REGRESSOR)
