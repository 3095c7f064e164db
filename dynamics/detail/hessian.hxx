// SPDX-License-Identifier: BSD-3-Clause
//
// The Hessian of mu^T tau(q, v, a) in one sweep: docs/math.md (H.13) to (H.19).
//
// mu is a virtual velocity: with m the motion it makes, mu^T tau = int m . acceleration dm over all bodies.
// Each column sends four wrenches and two couples to the root; they meet the motions of the columns
// there.  All that is under way through one joint stands side by side, a subtree's columns in one piece.
#pragma once

#include <dyntape/dynamics/detail/moving_bodies.hxx>

#include <algorithm>

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

// Momentum under mu of the bodies beyond a joint: int m, int x x m dm.
template <class T>
Force<T> momentum(const VelocityProduct<T>& m) {
  return {m.p, Vector3<T>(m.U(2, 1) - m.U(1, 2), m.U(0, 2) - m.U(2, 0), m.U(1, 0) - m.U(0, 1))};
}

template <class T>
void put(const Vector3<T>& x, T* out, int stride) {
  for (int r = 0; r < 3; ++r) out[r * stride] = x[r];
}

template <class T>
void put(const Force<T>& f, T* out, int stride) {
  put(f.linear, out, stride);
  put(f.angular, out + 3 * stride, stride);
}

// Column k of joint i sets out, from position `at`.
template <class T>
void set_out(Hessian<T>& h, int i, int k, int at) {
  const MovingBodies<T>& b = h.bodies;
  const Composite<T>& I = b.composites[i];
  const VelocityProduct<T>& B = b.products[i];
  const Motion<T>& S = b.S[k];
  T* out = h.travellers.data() + at;
  const auto row = [&](int r) { return out + r * h.stride; };
  put(slope_of_force(I, B, b.S_ddot[k], b.S_dot[k].angular) + cross(S, b.f[i]), row(kByQ), h.stride);
  put(slope_of_force(I, B, b.S_v[k], S.angular), row(kByV), h.stride);
  put(I * S, row(kByA), h.stride);
  put(I * h.S_mu[k] + cross(S, momentum(h.m_products[i])), row(kByMu), h.stride);
  const Vector3<T> mixed =
      couple_with(B, h.S_mu[k]) - couple_with(h.m_products[i], b.S_dot[k]) + S.angular.cross(h.couples[i]);
  put(Vector3<T>(mixed * T(2)), row(kMixed), h.stride);
  put(Vector3<T>(-couple_with(h.m_products[i], S)), row(kWithMu), h.stride);
}

// Travellers at positions first ... end, from the body's frame to the parent's.
template <class T>
void raise(const Placement<T>& X, T* travellers, int stride, int first, int end) {
  constexpr int kLanes = kColumnLanes<T>;
  const Matrix3<T>& R = X.R;
  const Vector3<T>& p = X.p;
  for (int from = first; from < end; from += kLanes) {
    const int left = end - from;
    for (int row = 0; row < kTravellerRows; row += row < kMixed ? 6 : 3) {
      T* f = travellers + row * stride + from;
      T y[6][kLanes];
      for (int c = 0; c < kLanes; ++c) {
        const T a = f[c], b = f[stride + c], d = f[2 * stride + c];
        y[0][c] = R(0, 0) * a + R(0, 1) * b + R(0, 2) * d;
        y[1][c] = R(1, 0) * a + R(1, 1) * b + R(1, 2) * d;
        y[2][c] = R(2, 0) * a + R(2, 1) * b + R(2, 2) * d;
      }
      const bool wrench = row < kMixed;
      if (wrench) {
        for (int c = 0; c < kLanes; ++c) {
          const T a = f[3 * stride + c], b = f[4 * stride + c], d = f[5 * stride + c];
          y[3][c] = (R(0, 0) * a + R(0, 1) * b + R(0, 2) * d) + (p[1] * y[2][c] - p[2] * y[1][c]);
          y[4][c] = (R(1, 0) * a + R(1, 1) * b + R(1, 2) * d) + (p[2] * y[0][c] - p[0] * y[2][c]);
          y[5][c] = (R(2, 0) * a + R(2, 1) * b + R(2, 2) * d) + (p[0] * y[1][c] - p[1] * y[0][c]);
        }
      }
      for (int r = 0; r < (wrench ? 6 : 3); ++r) {
        for (int c = 0; c < kLanes; ++c) f[r * stride + c] = c < left ? y[r][c] : f[r * stride + c];
      }
    }
  }
}

template <class T>
T dot_rows(const T* f, int stride, const Motion<T>& m) {
  const T linear = m.linear[0] * f[0] + m.linear[1] * f[stride] + m.linear[2] * f[2 * stride];
  f += 3 * stride;
  return linear + (m.angular[0] * f[0] + m.angular[1] * f[stride] + m.angular[2] * f[2 * stride]);
}

template <class T>
T dot_rows(const T* f, int stride, const Vector3<T>& x) {
  return x[0] * f[0] + x[1] * f[stride] + x[2] * f[2 * stride];
}

// What column b, in its own frame, makes of kColumnLanes travellers.
template <class T>
struct Meetings {
  static constexpr int kLanes = kColumnLanes<T>;
  T qq[kLanes], q_v[kLanes], v_q[kLanes], vv[kLanes], q_a[kLanes],
      a_q[kLanes];  // first b, then the traveller
};

template <class T>
void meet(const Hessian<T>& h, int b, int from, Meetings<T>& out) {
  const Motion<T>&S = h.bodies.S[b], &S_dot = h.bodies.S_dot[b], &S_ddot = h.bodies.S_ddot[b],
        &S_v = h.bodies.S_v[b], &S_mu = h.S_mu[b];
  const int stride = h.stride;
  const T* at = h.travellers.data() + from;
  for (int c = 0; c < Meetings<T>::kLanes; ++c) {
    const T *by_q = at + kByQ * stride + c, *by_v = at + kByV * stride + c, *by_a = at + kByA * stride + c,
            *by_mu = at + kByMu * stride + c, *mixed = at + kMixed * stride + c,
            *with_mu = at + kWithMu * stride + c;
    out.qq[c] = dot_rows(by_q, stride, S_mu) + dot_rows(by_mu, stride, S_ddot) +
                dot_rows(mixed, stride, S_dot.angular);
    out.q_v[c] = dot_rows(by_v, stride, S_mu) + dot_rows(with_mu, stride, S_dot.angular) * T(2);
    out.v_q[c] = dot_rows(by_mu, stride, S_v) + dot_rows(mixed, stride, S.angular);
    out.vv[c] = dot_rows(with_mu, stride, S.angular) * T(2);
    out.q_a[c] = dot_rows(by_a, stride, S_mu);
    out.a_q[c] = dot_rows(by_mu, stride, S);
  }
}

// Entries of b and of a column a beyond b's joint.
template <class T>
void store_beyond(const Meetings<T>& x, int c, int b, int a, int n, MatrixX<T>& H) {
  H(a, b) = H(b, a) = x.qq[c];
  H(n + a, b) = H(b, n + a) = x.q_v[c];
  H(a, n + b) = H(n + b, a) = x.v_q[c];
  H(n + a, n + b) = H(n + b, n + a) = x.vv[c];
  H(2 * n + a, b) = H(b, 2 * n + a) = x.q_a[c];
  H(a, 2 * n + b) = H(2 * n + b, a) = x.a_q[c];
}

// The same where both are on one joint: successive derivatives, of which the mean of both orders counts.
template <class T>
void store_beside(const Meetings<T>& x, int c, int b, int a, int n, MatrixX<T>& H) {
  H(n + a, b) = H(b, n + a) = x.q_v[c];
  H(2 * n + a, b) = H(b, 2 * n + a) = x.q_a[c];
  if (a > b) {
    H(a, b) = x.qq[c];
    H(n + a, n + b) = x.vv[c];
  } else if (a < b) {
    H(a, b) = H(b, a) = (x.qq[c] + H(b, a)) * T(0.5);
    H(n + a, n + b) = H(n + b, n + a) = (x.vv[c] + H(n + b, n + a)) * T(0.5);
  } else {
    H(a, a) = x.qq[c];
    H(n + a, n + a) = x.vv[c];
  }
}

template <class T>
void gather_hessian(const Model<T>& model, const Data<T>& data, Hessian<T>& h) {
  const Tree& tree = data.tree;
  Meetings<T> x;
  for (auto joint = h.bodies.preorder.rbegin(); joint != h.bodies.preorder.rend(); ++joint) {
    const int i = *joint, first = h.first[i], own = first + tree.count[i], end = h.end[i];
    for (int at = first; at < own; ++at) set_out(h, i, h.columns[at], at);
    for (int at = first; at < own; ++at) {
      const int b = h.columns[at];
      for (int from = first; from < end; from += Meetings<T>::kLanes) {
        meet(h, b, from, x);
        const int last = std::min(from + Meetings<T>::kLanes, end);
        for (int l = from; l < std::min(last, own); ++l) {
          store_beside(x, l - from, b, h.columns[l], model.nv, h.d2tau);
        }
        for (int l = std::max(from, own); l < last; ++l) {
          store_beyond(x, l - from, b, h.columns[l], model.nv, h.d2tau);
        }
      }
    }
    if (model.parent[i] >= 0) raise(data.X_PB[i], h.travellers.data(), h.stride, first, end);
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
  first.resize(n);
  end.resize(n);
  const Tree tree = tree_of(model);
  for (int i : bodies.preorder) {
    first[i] = static_cast<int>(columns.size());
    end[i] = first[i] + tree.count[i] + static_cast<int>(tree.subtree[i].size());
    for (int k = 0; k < tree.count[i]; ++k) columns.push_back(tree.first[i] + k);
  }
  stride = nv + detail::kColumnLanes<T>;
  travellers = VectorX<T>::Zero(static_cast<long>(detail::kTravellerRows) * stride);
  mu = VectorX<T>::Zero(nv);
  B = E = MatrixX<T>::Zero(nv, nv);
}

template <class T>
const MatrixX<T>& id_hessian(const Model<T>& model, Data<T>& data, Hessian<T>& hessian, const VectorRef<T>& q,
                             const VectorRef<T>& v, const VectorRef<T>& a, const VectorRef<T>& mu,
                             const Acting<T>& acting) {
  detail::check_arguments("id_hessian", model, data, q, &v, &a);
  detail::check("id_hessian", "mu", model, mu.size(), model.nv);
  detail::check("id_hessian", "workspace", model, hessian.mu.size(), model.nv);
  detail::check_acting("id_hessian", model, acting);
  detail::move_and_gather(model, data, hessian.bodies, q, v, a, acting);
  detail::move_along_mu(model, data, hessian, mu);
  detail::gather_hessian(model, data, hessian);
  return hessian.d2tau;
}

}  // namespace dyntape::dynamics
