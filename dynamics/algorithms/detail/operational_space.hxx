// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/algorithms/operational_space.h>
#include <dyntape/dynamics/algorithms/detail/checks.hxx>

namespace dyntape::dynamics {
namespace detail {

// Throws ArgumentError for rows that are not a choice of 0..5.
void check_task_rows(const std::vector<int>& rows, const std::string& model);
void check_damping(double damping);

// A = L D L^T of the positive definite A, without a branch; the lower triangle is read.  D L^T is kept above
// the diagonal of L.
template <class T>
void factor_mobility(OperationalSpace<T>& s) {
  const int m = s.size();
  for (int j = 0; j < m; ++j) {
    T d = s.A(j, j);
    for (int k = 0; k < j; ++k) d -= s.L(j, k) * s.L(k, j);
    s.D_inverse[j] = T(1) / d;
    for (int i = j + 1; i < m; ++i) {
      T sum = s.A(i, j);
      for (int k = 0; k < j; ++k) sum -= s.L(i, k) * s.L(k, j);
      s.L(j, i) = sum;
      s.L(i, j) = sum * s.D_inverse[j];
    }
  }
}

// x = A^-1 x.
template <class T, class X>
void solve_mobility(const OperationalSpace<T>& s, X&& x) {
  const int m = s.size();
  for (int i = 0; i < m; ++i) {
    for (int k = 0; k < i; ++k) x[i] -= s.L(i, k) * x[k];
  }
  for (int i = m - 1; i >= 0; --i) {
    x[i] *= s.D_inverse[i];
    for (int k = i + 1; k < m; ++k) x[i] -= s.L(k, i) * x[k];
  }
}

// The inverse of A, symmetric to the last bit.
template <class T>
void invert_mobility(const OperationalSpace<T>& s, MatrixX<T>& inverse) {
  const int m = s.size();
  for (int j = 0; j < m; ++j) {
    auto column = inverse.col(j);
    for (int i = 0; i < m; ++i) column[i] = T(i == j ? 1 : 0);
    solve_mobility(s, column);
  }
  for (int j = 0; j < m; ++j) {
    for (int i = 0; i < j; ++i) {
      inverse(i, j) = inverse(j, i) = (inverse(i, j) + inverse(j, i)) * T(0.5);
    }
  }
}

// J M^-1 and J M^-1 J^T of all six rows of the frame.
template <class T>
void gather_mobility(const Data<T>& data, OperationalSpace<T>& s) {
  const KinematicDerivatives<T>& K = s.kinematics;
  const int nv = static_cast<int>(K.J.cols());
  for (int c = 0; c < nv; ++c) {
    for (int r = 0; r < 6; ++r) {
      T sum = T(0);
      for (int k : K.support) sum += K.J(r, k) * data.Minv(k, c);
      s.J_Minv(r, c) = sum;
    }
  }
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c <= r; ++c) {
      T sum = T(0);
      for (int k : K.support) sum += s.J_Minv(r, k) * K.J(c, k);
      s.mobility(r, c) = s.mobility(c, r) = sum;
    }
  }
}

// A += phi delta e D (A + e D)^-1 D.  docs/math.md (K.20), (K.22)
template <class T>
void lift_mobility(OperationalSpace<T>& s, double damping) {
  const int m = s.size();
  const T delta = T(damping), e = T(damping / 8);
  for (int i = 0; i < m; ++i) {
    const int first = s.rows[i] < 3 ? 0 : 3;
    const T mean =
        (s.mobility(first, first) + s.mobility(first + 1, first + 1) + s.mobility(first + 2, first + 2)) *
        T(1.0 / 3);
    s.D[i] = select(mean > T(0), mean, T(1));
    s.A(i, i) += e * s.D[i];
  }
  factor_mobility(s);
  invert_mobility(s, s.A_inverse);
  T trace = T(0);
  for (int i = 0; i < m; ++i) trace += s.D[i] * s.A_inverse(i, i);
  const T left = T(1) - T(1) / (trace * delta);
  s.phi = select(left > T(0), T(left * left), T(0));
  const T size = s.phi * delta * e;
  for (int j = 0; j < m; ++j) {
    for (int i = 0; i < m; ++i) {
      s.A(i, j) = s.Lambda_inverse(i, j) + size * (s.D[i] * s.A_inverse(i, j) * s.D[j]);
    }
  }
}

}  // namespace detail

template <class T>
OperationalSpace<T>::OperationalSpace(const Model<T>& model, const std::vector<int>& task_rows)
    : rows(task_rows), kinematics(model) {
  detail::check_task_rows(rows, model.name);
  const int m = size();
  J = MatrixX<T>::Zero(m, model.nv);
  J_bar = MatrixX<T>::Zero(model.nv, m);
  for (auto* x : {&Lambda_inverse, &Lambda, &A, &L, &A_inverse}) *x = MatrixX<T>::Zero(m, m);
  for (auto* x : {&J_dot_v, &F, &mu, &D, &D_inverse}) *x = VectorX<T>::Zero(m);
  tau = VectorX<T>::Zero(model.nv);
  J_Minv = Matrix6X<T>::Zero(6, model.nv);
  mobility.setZero();
}

template <class T>
void operational_space(const Model<T>& model, Data<T>& data, OperationalSpace<T>& space,
                       const VectorRef<T>& q, const VectorRef<T>& v, int frame, ReferenceFrame in,
                       const OperationalOptions& options, const DynamicsTerms<T>& acting) {
  detail::check("operational_space", "workspace", model, space.tau.size(), model.nv);
  detail::check_damping(options.damping);
  forward_kinematics(model, data, q, v);
  frame_jacobian_rate(model, data, space.kinematics, frame, in);
  minverse(model, data, q, acting);
  detail::gather_mobility(data, space);
  const KinematicDerivatives<T>& K = space.kinematics;
  const int m = space.size();
  for (int i = 0; i < m; ++i) {
    const int row = space.rows[i];
    space.J.row(i) = K.J.row(row);
    space.J_dot_v[i] = T(0);
    for (int k : K.support) space.J_dot_v[i] += K.J_dot(row, k) * v[k];
    for (int j = 0; j < m; ++j) space.Lambda_inverse(i, j) = space.mobility(row, space.rows[j]);
  }
  space.A = space.Lambda_inverse;
  space.phi = T(0);
  if (options.damping > 0) detail::lift_mobility(space, options.damping);
  detail::factor_mobility(space);
  detail::invert_mobility(space, space.Lambda);
  for (int k = 0; k < model.nv; ++k) {
    for (int i = 0; i < m; ++i) {
      T sum = T(0);
      for (int j = 0; j < m; ++j) sum += space.J_Minv(space.rows[j], k) * space.Lambda(j, i);
      space.J_bar(k, i) = sum;
    }
  }
}

template <class T>
const VectorX<T>& operational_torque(const Model<T>& model, Data<T>& data, OperationalSpace<T>& space,
                                     const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& x_dd,
                                     const VectorX<T>* tau_0, const DynamicsTerms<T>& acting) {
  const char* who = "operational_torque";
  detail::check(who, "workspace", model, space.tau.size(), model.nv);
  detail::check(who, "x_dd", model, x_dd.size(), space.size());
  if (tau_0) detail::check(who, "tau_0", model, tau_0->size(), model.nv);
  nonlinear_effects(model, data, q, v, acting);
  const int m = space.size();
  for (int i = 0; i < m; ++i) {
    space.F[i] = x_dd[i] - space.J_dot_v[i];
    if (!tau_0) continue;
    for (int k = 0; k < model.nv; ++k) space.F[i] -= space.J_Minv(space.rows[i], k) * (*tau_0)[k];
  }
  detail::solve_mobility(space, space.F);
  for (int k = 0; k < model.nv; ++k) {
    T sum = data.nle[k];
    if (tau_0) sum += (*tau_0)[k];
    for (int i = 0; i < m; ++i) sum += space.J(i, k) * space.F[i];
    space.tau[k] = sum;
  }
  return space.tau;
}

template <class T>
const VectorX<T>& operational_bias(const Model<T>& model, Data<T>& data, OperationalSpace<T>& space,
                                   const VectorRef<T>& q, const VectorRef<T>& v,
                                   const DynamicsTerms<T>& acting) {
  detail::check("operational_bias", "workspace", model, space.tau.size(), model.nv);
  nonlinear_effects(model, data, q, v, acting);
  for (int i = 0; i < space.size(); ++i) {
    space.mu[i] = -space.J_dot_v[i];
    for (int k = 0; k < model.nv; ++k) space.mu[i] += space.J_Minv(space.rows[i], k) * data.nle[k];
  }
  detail::solve_mobility(space, space.mu);
  return space.mu;
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_OPERATIONAL_SPACE(T, ...)                 \
  __VA_ARGS__ template struct dyntape::dynamics::OperationalSpace<T>; \
  DYNTAPE_COMPILE(operational_space, T, __VA_ARGS__)                  \
  DYNTAPE_COMPILE(operational_torque, T, __VA_ARGS__)                 \
  DYNTAPE_COMPILE(operational_bias, T, __VA_ARGS__)

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_OPERATIONAL_SPACE)
