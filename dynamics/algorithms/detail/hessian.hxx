// SPDX-License-Identifier: BSD-3-Clause
//
// The Hessian of mu^T tau(q, v, a) in one sweep, and that of lambda^T ddq: docs/math.md (H.13) to (H.19), (H.22).
//
// mu is a virtual velocity: with m the motion it makes, mu^T tau = int m . acceleration dm over all bodies.
// Each column sends four wrenches and two couples to the root; they meet the motions of the columns
// there.  All that is under way through one joint stands side by side, a subtree's columns in one piece.
#pragma once

#include <dyntape/dynamics/algorithms/hessian.h>
#include <dyntape/dynamics/algorithms/detail/derivatives.hxx>
#include <dyntape/dynamics/algorithms/detail/second_order_common.hxx>

namespace dyntape::dynamics {
namespace detail {

// Rows of the travellers: wrenches (linear first), then couples.
enum TravellerRow {
  kByQ = 0,      // slope of force by q: I S_ddot + 2 B S_dot + S x* f
  kByV = 6,      // by v: I S_v + 2 B S
  kByA = 12,     // by a: I S
  kByMu = 18,    // of the momentum under mu, by q: I S_mu + S x* h_mu
  kMixed = 24,   // 2 (int v x S_mu + S_dot x m dm + w x int v x m dm)
  kWithMu = 27,  // int S x m dm
  kTravellerRows = 30
};

// From the roots: motions under mu; then, per body, their moments.
template <class T>
void move_along_mu(const Model<T>& model, const Data<T>& data, Hessian<T>& h, const VectorRef<T>& mu) {
  const MovingBodies<T>& b = h.bodies;
  const Tree& tree = data.tree;
  for (int i = 0; i < model.njoints(); ++i) {
    const int p = model.parent[i];
    h.m_p[i] = p < 0 ? Motion<T>{} : act_inverse(data.X_PB[i], h.m[p]);
    h.m[i] = h.m_p[i] + along_columns<T>(tree, mu, i);
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
      h.S_mu[k] = cross(h.m_p[i], tree.dofs[k]);
    }
    const Composite<T> I = composite(model.inertias[i]);
    h.m_products[i] = velocity_product(I, h.m[i]);
    h.couples[i] = couple_with(velocity_product(I, b.v[i]), h.m[i]);
  }
  for (int i = model.njoints() - 1; i >= 0; --i) {
    const int p = model.parent[i];
    if (p < 0) continue;
    accumulate(data.X_PB[i], h.m_products[i], h.m_products[p]);
    h.couples[p] += data.X_PB[i].R * h.couples[i];
  }
}

// Column k of joint i sets out, from position `at`.
template <class T>
void set_out(Hessian<T>& h, int i, int k, int at) {
  const MovingBodies<T>& b = h.bodies;
  const Composite<T>& I = b.composites[i];
  const VelocityProduct<T>& B = b.products[i];
  const Motion<T>& S = b.S[k];
  const int stride = h.stride;
  const auto row = [&](int r) { return h.travellers.data() + r * stride; };
  put_spatial(row(kByQ), stride, at,
              slope_of_force(I, B, b.S_ddot[k], b.S_dot[k].angular) + cross(S, b.f[i]));
  put_spatial(row(kByV), stride, at, slope_of_force(I, B, b.S_v[k], S.angular));
  put_spatial(row(kByA), stride, at, I * S);
  put_spatial(row(kByMu), stride, at, I * h.S_mu[k] + cross(S, momentum(h.m_products[i])));
  const Vector3<T> mixed =
      couple_with(B, h.S_mu[k]) - couple_with(h.m_products[i], b.S_dot[k]) + S.angular.cross(h.couples[i]);
  put(row(kMixed), stride, at, Vector3<T>(mixed * T(2)));
  put(row(kWithMu), stride, at, Vector3<T>(-couple_with(h.m_products[i], S)));
}

// What column b makes of the travellers in its body's frame: rows of `meetings`.  First the variable of b.
enum MeetingRow { kQQ, kQV, kVQ, kVV, kQA, kAQ, kMeetingRows };

template <class T>
void meet(Hessian<T>& h, int b, int begin, int end) {
  const Motion<T>&S = h.bodies.S[b], &S_dot = h.bodies.S_dot[b], &S_ddot = h.bodies.S_ddot[b],
        &S_v = h.bodies.S_v[b], &S_mu = h.S_mu[b];
  const int stride = h.stride;
  const T* travellers = h.travellers.data();
  T* meetings = h.meetings.data();
  over<T>(begin, end, [&](int s, auto lanes) {
    using Vector = typename Lanes<T>::Vector;
    const auto put = [&](int row, const Vector& x) { lanes.store(meetings + row * stride + s, x); };
    const auto six = [&](int row) { return SixLanes<T>(travellers + row * stride + s, stride, lanes); };
    const auto three = [&](int row) { return ThreeLanes<T>(travellers + row * stride + s, stride, lanes); };
    const SixLanes<T> by_mu = six(kByMu);
    const ThreeLanes<T> mixed = three(kMixed), with_mu = three(kWithMu);
    put(kQQ, six(kByQ).dot(S_mu) + by_mu.dot(S_ddot) + mixed.dot(S_dot.angular));
    put(kQV, six(kByV).dot(S_mu) + with_mu.dot(S_dot.angular) * T(2));
    put(kVQ, by_mu.dot(S_v) + mixed.dot(S.angular));
    put(kVV, with_mu.dot(S.angular) * T(2));
    put(kQA, six(kByA).dot(S_mu));
    put(kAQ, by_mu.dot(S));
  });
}

// Entries of b and of a column a beyond b's joint.
template <class T>
DYNTAPE_INLINE void store_beyond(const T* x, int stride, int b, int a, int n, MatrixX<T>& H) {
  H(a, b) = H(b, a) = x[kQQ * stride];
  H(n + a, b) = H(b, n + a) = x[kQV * stride];
  H(a, n + b) = H(n + b, a) = x[kVQ * stride];
  H(n + a, n + b) = H(n + b, n + a) = x[kVV * stride];
  H(2 * n + a, b) = H(b, 2 * n + a) = x[kQA * stride];
  H(a, 2 * n + b) = H(2 * n + b, a) = x[kAQ * stride];
}

// The same where both are on one joint: successive derivatives, of which the mean of both orders counts.
template <class T>
DYNTAPE_INLINE void store_beside(const T* x, int stride, int b, int a, int n, MatrixX<T>& H) {
  const T qq = x[kQQ * stride], vv = x[kVV * stride];
  H(n + a, b) = H(b, n + a) = x[kQV * stride];
  H(2 * n + a, b) = H(b, 2 * n + a) = x[kQA * stride];
  if (a >= b) {
    H(a, b) = qq;
    H(n + a, n + b) = vv;
  } else {
    H(a, b) = H(b, a) = (qq + H(b, a)) * T(0.5);
    H(n + a, n + b) = H(n + b, n + a) = (vv + H(n + b, n + a)) * T(0.5);
  }
}

template <class T>
void gather_hessian(const Model<T>& model, const Data<T>& data, Hessian<T>& h) {
  const Tree& tree = data.tree;
  const int stride = h.stride;
  T *travellers = h.travellers.data(), *meetings = h.meetings.data();
  for (auto joint = tree.preorder.rbegin(); joint != tree.preorder.rend(); ++joint) {
    const int i = *joint, begin = tree.begin[i], own = begin + tree.count[i], end = tree.end[i];
    for (int at = begin; at < own; ++at) set_out(h, i, tree.dof_at[at], at);
    for (int at = begin; at < own; ++at) {
      const int b = tree.dof_at[at];
      meet(h, b, begin, end);
      for (int l = begin; l < own; ++l) {
        store_beside(meetings + l, stride, b, tree.dof_at[l], model.nv, h.d2tau);
      }
      for (int l = own; l < end; ++l) {
        store_beyond(meetings + l, stride, b, tree.dof_at[l], model.nv, h.d2tau);
      }
    }
    if (model.parent[i] < 0) continue;
    for (const int wrench : {kByQ, kByV, kByA, kByMu}) {
      act_columns(data.X_PB[i], travellers + wrench * stride, stride, begin, end);
    }
    for (const int couple : {kMixed, kWithMu}) {
      rotate_columns(data.X_PB[i].R, travellers + couple * stride, stride, begin, end);
    }
  }
}

}  // namespace detail

template <class T>
Hessian<T>::Hessian(const Model<T>& model) : bodies(model) {
  const int n = model.njoints(), nv = model.nv;
  d2tau = d2ddq = MatrixX<T>::Zero(3 * nv, 3 * nv);
  m_p.resize(n);
  m.resize(n);
  m_products.resize(n);
  couples.resize(n);
  S_mu.resize(nv);
  stride = static_cast<int>(detail::whole_lines<T>(nv));
  travellers = detail::LaneArray<T>(std::ptrdiff_t{stride} * detail::kTravellerRows);
  meetings = detail::LaneArray<T>(std::ptrdiff_t{stride} * detail::kMeetingRows);
  mu = VectorX<T>::Zero(nv);
  B = E = MatrixX<T>::Zero(nv, nv);
}

template <class T>
const MatrixX<T>& id_hessian(const Model<T>& model, Data<T>& data, Hessian<T>& hessian, const VectorRef<T>& q,
                             const VectorRef<T>& v, const VectorRef<T>& a, const VectorRef<T>& mu,
                             const DynamicsTerms<T>& acting) {
  detail::check_arguments("id_hessian", model, data, q, &v, &a);
  detail::check("id_hessian", "mu", model, mu.size(), model.nv);
  detail::check_shape("id_hessian", "workspace", model, hessian.bodies.shape);
  detail::check_acting("id_hessian", model, acting);
  detail::move_and_gather(model, data, hessian.bodies, q, v, a, acting);
  detail::move_along_mu(model, data, hessian, mu);
  detail::gather_hessian(model, data, hessian);
  return hessian.d2tau;
}

// With mu = M^-1 lambda, G the Hessian of mu^T tau over (q, v, a) and B = G_qa:
//   H_qq = -(G_qq + B a_q + (B a_q)^T)   H_qv = -(G_qv + B a_v)   H_vv = -G_vv   H_qtau = -B M^-1
template <class T>
const MatrixX<T>& fd_hessian(const Model<T>& model, Data<T>& data, Hessian<T>& hessian, const VectorRef<T>& q,
                             const VectorRef<T>& v, const VectorRef<T>& tau, const VectorRef<T>& lambda,
                             const DynamicsTerms<T>& acting) {
  detail::check("fd_hessian", "lambda", model, lambda.size(), model.nv);
  detail::check_shape("fd_hessian", "workspace", model, hessian.bodies.shape);
  fd_derivatives<T>(model, data, q, v, tau, acting);
  hessian.mu.setZero();
  detail::add_product(data.Minv.data(), lambda.data(), model.nv, 1, hessian.mu.data());
  id_hessian<T>(model, data, hessian, q, v, data.ddq, hessian.mu, acting);
  const int n = model.nv;
  const MatrixX<T>& G = hessian.d2tau;
  MatrixX<T>& H = hessian.d2ddq;
  hessian.B = -G.topRightCorner(n, n);
  const auto fill = [&](const MatrixX<T>& by, int at) {
    hessian.E.setZero();
    detail::add_product(hessian.B, by, hessian.E);
    if (at < 2 * n) hessian.E -= G.block(0, at, n, n);
    H.block(0, at, n, n) = hessian.E;
    H.block(at, 0, n, n) = hessian.E.transpose();
  };
  fill(data.ddq_dv, n);
  fill(data.Minv, 2 * n);
  hessian.E.setZero();
  detail::add_product(hessian.B, data.ddq_dq, hessian.E);
  H.topLeftCorner(n, n) = hessian.E + hessian.E.transpose();
  H.topLeftCorner(n, n) -= G.topLeftCorner(n, n);
  H.block(n, n, n, n) = -G.block(n, n, n, n);
  return H;
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_HESSIAN(T, ...)                  \
  __VA_ARGS__ template struct dyntape::dynamics::Hessian<T>; \
  DYNTAPE_COMPILE(id_hessian, T, __VA_ARGS__)                \
  DYNTAPE_COMPILE(fd_hessian, T, __VA_ARGS__)

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_HESSIAN)
