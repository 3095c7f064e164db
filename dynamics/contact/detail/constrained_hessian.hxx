// SPDX-License-Identifier: BSD-3-Clause
//
// The Hessians of mu^T ddq + nu^T lambda and of mu^T v_plus + nu^T impulse: docs/math.md (L.16) to (L.24).
#pragma once

#include <dyntape/dynamics/contact/constrained_hessian.h>
#include <dyntape/dynamics/algorithms/detail/hessian.hxx>
#include <dyntape/dynamics/contact/detail/constraint_derivatives.hxx>

#include <algorithm>
#include <vector>

namespace dyntape::dynamics {
namespace detail {

// The rows of one constraint as a wrench.
template <class T>
Force<T> wrench_of(const ConstraintChain& chain, const VectorX<T>& x) {
  Force<T> f;
  f.linear = x.template segment<3>(chain.first_row);
  if (chain.rows == 6) f.angular = x.template segment<3>(chain.first_row + 3);
  return f;
}

// What the columns of one chain have in common.
template <class T>
struct ChainWeights {
  Force<T> f, on_V, lambda, residual;  // f: w_lambda; on_V: what V meets
  Motion<T> V;                         // of frame 1
  Vector3<T> e_linear, e_angular;
  Matrix3<T> E;  // Jr(e_angular)^-1, with b(z) of it and b'(z)
  T kp = T(0), b = T(0), slope_of_b = T(0);
  bool pulls = false, turns = false;  // whether there is a kp; and six rows
  bool contradicts = false;           // whether rows may contradict each other
};

// b(z) of Jr^-1 and its derivative, b = g / (4 c_1) at z/4 with g = c_2 - c_3 (lie.h, stumpff.h).
template <class T>
void set_inverse_jacobian(ChainWeights<T>& w) {
  const T y = w.e_angular.squaredNorm() * T(0.25);
  const T c1 = stumpff<1>(y), c3 = stumpff<3>(y), c4 = stumpff<4>(y), c5 = stumpff<5>(y);
  const T g = stumpff<2>(y) - c3, g_y = ((c4 - c5) * T(3) - c3) * T(0.5);
  w.b = inverse_jacobian_coefficient(T(w.e_angular.squaredNorm()));
  w.slope_of_b = (g_y * c1 + g * g * T(0.5)) / (T(16) * c1 * c1);
  w.E = inverse_right_jacobian(w.e_angular);
}

template <class T>
ChainWeights<T> weights_of(const ConstraintData<T>& c, const ConstrainedHessian<T>& h, std::size_t i,
                           const VectorRef<T>& v) {
  const ConstraintChain& chain = c.chains[i];
  const T kd(c.constraints[i].kd);
  ChainWeights<T> w;
  w.f = wrench_of(chain, h.w_lambda);
  w.lambda = wrench_of(chain, c.lambda);
  w.residual = wrench_of(chain, c.residual);
  w.V = chain_motion<T>(chain, c.columns[i], v).first;
  w.on_V = {w.f.linear.cross(w.V.angular), w.V.linear.cross(w.f.linear)};
  if (c.constraints[i].kd != 0) w.on_V = w.on_V + w.f * kd;
  w.kp = T(c.constraints[i].kp);
  w.pulls = c.constraints[i].kp != 0;
  w.turns = w.pulls && chain.rows == 6;
  w.contradicts = !c.independent;
  w.e_linear = c.error.template segment<3>(chain.first_row);
  if (w.turns) {
    w.e_angular = c.error.template segment<3>(chain.first_row + 3);
    set_inverse_jacobian(w);
  }
  return w;
}

// (L.22): E^T times the slope of f . Jr(e)^-1 w by e.
template <class T>
Vector3<T> turning_error(const ChainWeights<T>& weights, const Vector3<T>& w) {
  const Vector3<T>&f = weights.f.angular, &e = weights.e_angular;
  const T fe = f.dot(e), ew = e.dot(w), fw = f.dot(w), z = e.squaredNorm();
  const T along_e = (fe * ew - z * fw) * weights.slope_of_b - fw * weights.b;
  const Vector3<T> n = w.cross(f) * T(0.5) + (f * ew + w * fe) * weights.b + e * (along_e * T(2));
  return transposed_times(weights.E, n);
}

// Where the chain has come to: motions of the near and the far side of a link.
template <class T>
struct ChainPlace {
  Motion<T> V, V_next, A, A_next, W, W_next, U, U_next;
};

// (L.18), and what (L.20), (L.21) make of one column.
template <class T>
void set_column(ConstrainedColumn<T>& column, const ChainWeights<T>& w, const ChainPlace<T>& at,
                bool backward, const Motion<T>& s) {
  const Motion<T>& V_2 = backward ? at.V_next : at.V;
  const Motion<T> rest = w.V - V_2;
  column.V_q = cross(V_2, s);
  column.A_q = cross(backward ? at.A_next : at.A, s) + cross(column.V_q, rest);
  column.A_v = cross(at.V + at.V_next - w.V, s);
  column.W_q = cross(backward ? at.W_next : at.W, s);
  column.on_A = cross(s, w.f);
  column.on_V = cross(cross(s, rest), w.f) + cross(s, w.on_V);
  column.on_V =
      column.on_V + Force<T>{w.f.linear.cross(column.V_q.angular), column.V_q.linear.cross(w.f.linear)};
  column.on_W = cross(s, w.lambda);
  column.on_w = s.angular.cross(w.f.angular) + s.linear.cross(w.f.linear) * T(2);
  if (w.pulls) column.A_q.linear += (s.linear + w.e_linear.cross(s.angular)) * w.kp;
  if (w.turns) column.on_e = turning_error(w, s.angular) * w.kp;
  if (!w.contradicts) return;
  column.U_q = cross(backward ? at.U_next : at.U, s);
  column.on_U = cross(s, w.residual);
}

template <class T>
void set_columns(const ConstraintData<T>& c, ConstrainedHessian<T>& h, std::size_t i,
                 const ChainWeights<T>& w, const VectorRef<T>& v) {
  const ConstraintChain& chain = c.chains[i];
  const std::vector<Motion<T>>& columns = c.columns[i];
  ChainPlace<T> at;
  for (const auto& link : chain.links) {
    const Motion<T> m = link_motion(chain, columns, link, v);
    at.V_next = at.V + m;
    at.A_next = at.A + link_motion<T>(chain, columns, link, c.ddq) + cross(at.V, m);
    at.W_next = at.W + link_motion<T>(chain, columns, link, h.w_a);
    if (w.contradicts) at.U_next = at.U + link_motion<T>(chain, columns, link, h.u);
    for (int k = link.first; k < link.first + link.count; ++k) {
      ConstrainedColumn<T>& column = h.columns[static_cast<std::size_t>(k)];
      set_column(column, w, at, link.backward, columns[k]);
      set_rows<T>(h.D_w.col(chain.dofs[k]), chain, column.W_q.linear, column.W_q.angular);
      if (w.contradicts) set_rows<T>(h.D_u.col(chain.dofs[k]), chain, column.U_q.linear, column.U_q.angular);
    }
    at.V = at.V_next, at.A = at.A_next, at.W = at.W_next, at.U = at.U_next;
  }
}

// Two columns of one chain, the one nearer to frame 2 first, and their places in v.
template <class T>
struct ColumnPair {
  const ConstrainedColumn<T>&near, &far;
  const Motion<T>& near_column;
  int k, f;
};

// (L.20) to (L.22), what is symmetric.  Two columns of one joint come by in both orders, and the mean of these counts.
template <class T>
void add_symmetric(ConstrainedHessian<T>& h, const ChainWeights<T>& w, const ColumnPair<T>& p, bool beside) {
  const long n = h.B.rows();
  T qq = dot(p.near.A_q, p.far.on_A) + dot(p.near.V_q, p.far.on_V) - dot(p.near.W_q, p.far.on_W);
  T vv = p.near_column.angular.dot(p.far.on_w);
  if (w.turns) qq += p.near_column.angular.dot(p.far.on_e);
  if (w.contradicts) qq += dot(p.near.U_q, p.far.on_U);
  if (beside) qq *= T(0.5), vv *= T(0.5);
  h.H(p.k, p.f) += qq, h.H(p.f, p.k) += qq;
  h.H(n + p.k, n + p.f) += vv, h.H(n + p.f, n + p.k) += vv;
}

// Adds the second derivatives of w_lambda . (L.7) - lambda . J w_a + residual . J u at fixed ddq.
template <class T>
void add_chain(const ConstraintData<T>& c, ConstrainedHessian<T>& h, std::size_t i,
               const ChainWeights<T>& w) {
  const ConstraintChain& chain = c.chains[i];
  const long n = h.B.rows();
  for (const auto& link : chain.links) {
    const int end = link.first + link.count;
    for (int far = link.first; far < end; ++far) {
      for (int near = 0; near < end; ++near) {
        const bool beside = near >= link.first;
        const ColumnPair<T> p{h.columns[near], h.columns[far], c.columns[i][near], chain.dofs[near],
                              chain.dofs[far]};
        add_symmetric(h, w, p, beside);
        if (!beside || link.backward) {  // the near column turns with the far one
          h.H(p.f, n + p.k) += dot(p.near.A_v, p.far.on_A) + dot(p.near_column, p.far.on_V);
          h.B(p.f, p.k) += dot(p.near_column, p.far.on_A);
        }
        if (!beside || !link.backward) h.H(p.k, n + p.f) += p.near.V_q.angular.dot(p.far.on_w);
      }
    }
  }
}

// E += sign D^T X, over the joints of each chain only.
template <class T>
void add_transposed_product(const ConstraintData<T>& c, const MatrixX<T>& D, const MatrixX<T>& X, int sign,
                            MatrixX<T>& E) {
  for (const ConstraintChain& chain : c.chains) {
    for (long j = 0; j < X.cols(); ++j) {
      for (int k : chain.dofs) {
        T sum(0);
        for (int r = chain.first_row; r < chain.first_row + chain.rows; ++r) sum += D(r, k) * X(r, j);
        E(k, j) += sign < 0 ? T(-sum) : sum;
      }
    }
  }
}

// Y += J X, over the joints of each chain only.
template <class T>
void add_rows(const ConstraintData<T>& c, const MatrixX<T>& X, MatrixX<T>& Y) {
  for (const ConstraintChain& chain : c.chains) {
    for (long j = 0; j < X.cols(); ++j) {
      for (int k : chain.dofs) {
        for (int r = chain.first_row; r < chain.first_row + chain.rows; ++r) Y(r, j) += c.J(r, k) * X(k, j);
      }
    }
  }
}

// (L.16): w_a = Y mu - Z nu, w_lambda = Z^T mu + (J M^-1 J^T)^+ nu.
template <class T>
void solve_adjoint(const ConstraintData<T>& c, ConstrainedHessian<T>& h, const VectorRef<T>& mu,
                   const VectorRef<T>& nu) {
  h.w_a.noalias() = c.ddq_dtau * mu;
  h.w_lambda.noalias() = c.Z.transpose() * mu;
  if (nu.size() > 0) {
    h.w_a.noalias() -= c.Z * nu;
    h.w_lambda.noalias() += c.G_inverse * nu;
  }
  if (!c.independent) h.u.noalias() = c.Z * h.w_lambda;
}

// (L.23): how the residual of contradictory rows changes, J a_x + A_x, A without what turn_residual() has added.
template <class T>
void differentiate_residual(const ConstraintData<T>& c, ConstrainedHessian<T>& h) {
  h.E.setZero();
  subtract_turning_forces(c, c.residual, h.E);
  h.residual_q.noalias() = c.Z.transpose() * h.E;
  h.residual_q += c.A_dq;
  h.residual_v = c.A_dv;
  add_rows(c, c.ddq_dq, h.residual_q);
  add_rows(c, c.ddq_dv, h.residual_v);
}

// (L.17): E = L_qa a_x + L_qlambda lambda_x, x one of q, v, tau.
template <class T>
void mix(const ConstraintData<T>& c, ConstrainedHessian<T>& h, const MatrixX<T>& ddq_dx,
         const MatrixX<T>& lambda_dx) {
  h.E.setZero();
  add_product(h.B, ddq_dx, h.E);
  add_transposed_product(c, h.D_w, lambda_dx, -1, h.E);
}

// From what the chains have left in H and B, and the Hessian of inverse dynamics.
template <class T>
void finish_hessian(const ConstraintData<T>& c, ConstrainedHessian<T>& h) {
  const long n = h.B.rows();
  const MatrixX<T>& G = h.id.d2tau;
  h.B += G.topRightCorner(n, n);
  h.H.topLeftCorner(2 * n, 2 * n) += G.topLeftCorner(2 * n, 2 * n);
  mix(c, h, c.ddq_dq, c.lambda_dq);
  if (!c.independent) add_transposed_product(c, h.D_u, h.residual_q, 1, h.E);
  h.H.topLeftCorner(n, n) += h.E + h.E.transpose();
  mix(c, h, c.ddq_dv, c.lambda_dv);
  if (!c.independent) add_transposed_product(c, h.D_u, h.residual_v, 1, h.E);
  h.H.block(0, n, n, n) += h.E;
  mix(c, h, c.ddq_dtau, c.lambda_dtau);
  h.H.topRightCorner(n, n) = h.E;
  h.H.topRows(2 * n) = -h.H.topRows(2 * n);
  h.H.block(n, 0, n, n) = h.H.block(0, n, n, n).transpose();
  h.H.bottomLeftCorner(n, n) = h.H.topRightCorner(n, n).transpose();
}

// --- Impacts: u = v_plus + restitution v, w_a at joint velocities (L.24) ------------------------------------------

template <class T>
void set_impulse_columns(const ConstraintData<T>& c, ConstrainedHessian<T>& h, std::size_t i,
                         const VectorX<T>& u) {
  const ConstraintChain& chain = c.chains[i];
  const Force<T> f = wrench_of(chain, h.w_lambda), impulse = wrench_of(chain, c.impulse);
  Motion<T> V, W;
  for (const auto& link : chain.links) {
    const Motion<T> V_next = V + link_motion<T>(chain, c.columns[i], link, u);
    const Motion<T> W_next = W + link_motion<T>(chain, c.columns[i], link, h.w_a);
    for (int k = link.first; k < link.first + link.count; ++k) {
      const Motion<T>& s = c.columns[i][k];
      ConstrainedColumn<T>& column = h.columns[k];
      column.V_q = cross(link.backward ? V_next : V, s);
      column.W_q = cross(link.backward ? W_next : W, s);
      column.on_V = cross(s, f);
      column.on_W = cross(s, impulse);
      set_rows<T>(h.D_w.col(chain.dofs[k]), chain, column.W_q.linear, column.W_q.angular);
    }
    V = V_next, W = W_next;
  }
}

// Adds the second derivatives of w_lambda . J u - impulse . J w_a at fixed u.
template <class T>
void add_impulse_chain(const ConstraintData<T>& c, ConstrainedHessian<T>& h, std::size_t i) {
  const ConstraintChain& chain = c.chains[i];
  for (const auto& link : chain.links) {
    const int end = link.first + link.count;
    for (int far = link.first; far < end; ++far) {
      const ConstrainedColumn<T>& by_far = h.columns[far];
      for (int near = 0; near < end; ++near) {
        const bool beside = near >= link.first;
        const int k = chain.dofs[near], f = chain.dofs[far];
        T qq = dot(h.columns[near].V_q, by_far.on_V) - dot(h.columns[near].W_q, by_far.on_W);
        if (beside) qq *= T(0.5);
        h.H_impulse(k, f) += qq, h.H_impulse(f, k) += qq;
        if (!beside || link.backward) h.B(f, k) += dot(c.columns[i][near], by_far.on_V);
      }
    }
  }
}

template <class T>
void finish_impulse_hessian(const ConstraintData<T>& c, ConstrainedHessian<T>& h, const T& restitution) {
  const long n = h.B.rows();
  MatrixX<T>& H = h.H_impulse;
  const auto& M_q = h.id.d2tau.topRightCorner(n, n);
  H.topLeftCorner(n, n) += h.id.d2tau.topLeftCorner(n, n);
  H.topRightCorner(n, n) = h.B * restitution - M_q;
  h.B += M_q;
  mix(c, h, c.v_plus_dq, c.impulse_dq);
  H.topLeftCorner(n, n) += h.E + h.E.transpose();
  mix(c, h, c.v_plus_dv, c.impulse_dv);
  H.topRightCorner(n, n) += h.E;
  H.topRows(n) = -H.topRows(n);
  H.bottomLeftCorner(n, n) = H.topRightCorner(n, n).transpose();
}

}  // namespace detail

template <class T>
ConstrainedHessian<T>::ConstrainedHessian(const Model<T>& model, const ConstraintData<T>& c) : id(model) {
  const long nv = model.nv, m = c.lambda.size();
  H = MatrixX<T>::Zero(3 * nv, 3 * nv);
  H_impulse = MatrixX<T>::Zero(2 * nv, 2 * nv);
  std::size_t longest = 0;
  for (const ConstraintChain& chain : c.chains) longest = std::max(longest, chain.dofs.size());
  columns.resize(longest);
  for (auto* x : {&w_a, &u}) *x = VectorX<T>::Zero(nv);
  w_lambda = VectorX<T>::Zero(m);
  for (auto* x : {&B, &E}) *x = MatrixX<T>::Zero(nv, nv);
  for (auto* x : {&D_w, &D_u, &residual_q, &residual_v}) *x = MatrixX<T>::Zero(m, nv);
}

namespace detail {

template <class T>
void check_multipliers(const char* function, const Model<T>& model, const ConstraintData<T>& c,
                       const ConstrainedHessian<T>& second, const VectorRef<T>& mu, const VectorRef<T>& nu) {
  check(function, "mu", model, mu.size(), model.nv);
  if (nu.size() > 0) check(function, "nu", model, nu.size(), c.lambda.size());
  check_shape(function, "workspace", model, second.id.bodies.shape);
  check(function, "workspace", model, second.D_w.rows(), c.lambda.size());
}

}  // namespace detail

template <class T>
const MatrixX<T>& constrained_hessian(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                      ConstrainedHessian<T>& second, const VectorRef<T>& q,
                                      const VectorRef<T>& v, const VectorRef<T>& tau, const VectorRef<T>& mu,
                                      const VectorRef<T>& nu, const DynamicsTerms<T>& acting) {
  detail::check_multipliers<T>("constrained_hessian", model, c, second, mu, nu);
  constrained_dynamics_derivatives<T>(model, data, c, q, v, tau, acting);
  detail::solve_adjoint(c, second, mu, nu);
  id_hessian<T>(model, data, second.id, q, v, c.ddq, second.w_a, acting);
  second.H.setZero();
  second.B.setZero();
  for (std::size_t i = 0; i < c.chains.size(); ++i) {
    const detail::ChainWeights<T> weights = detail::weights_of<T>(c, second, i, v);
    detail::set_columns<T>(c, second, i, weights, v);
    detail::add_chain(c, second, i, weights);
  }
  if (!c.independent) detail::differentiate_residual(c, second);
  detail::finish_hessian(c, second);
  return second.H;
}

template <class T>
const MatrixX<T>& impulse_hessian(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                  ConstrainedHessian<T>& second, const VectorRef<T>& q, const VectorRef<T>& v,
                                  const std::type_identity_t<T>& restitution, const VectorRef<T>& mu,
                                  const VectorRef<T>& nu, const DynamicsTerms<T>& acting) {
  detail::check_multipliers<T>("impulse_hessian", model, c, second, mu, nu);
  impulse_dynamics_derivatives<T>(model, data, c, q, v, restitution, acting);
  detail::solve_adjoint(c, second, mu, nu);
  DynamicsTerms<T> still = acting;
  still.gravity = false;
  still.external = nullptr;
  c.along = c.v_plus - v;
  c.step.setZero();
  id_hessian<T>(model, data, second.id, q, c.step, c.along, second.w_a, still);
  c.along = c.v_plus + v * restitution;
  second.H_impulse.setZero();
  second.B.setZero();
  for (std::size_t i = 0; i < c.chains.size(); ++i) {
    detail::set_impulse_columns(c, second, i, c.along);
    detail::add_impulse_chain(c, second, i);
  }
  detail::finish_impulse_hessian<T>(c, second, restitution);
  return second.H_impulse;
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_CONSTRAINED_HESSIAN(T, ...)                 \
  __VA_ARGS__ template struct dyntape::dynamics::ConstrainedHessian<T>; \
  DYNTAPE_COMPILE(constrained_hessian, T, __VA_ARGS__)                  \
  DYNTAPE_COMPILE(impulse_hessian, T, __VA_ARGS__)

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_CONSTRAINED_HESSIAN)
