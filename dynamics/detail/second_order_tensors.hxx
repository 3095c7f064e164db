// SPDX-License-Identifier: BSD-3-Clause
//
// Second derivatives of inverse dynamics as tensors: docs/math.md (H.5) to (H.12).
//
// For each column D, all columns m of the path from the root to it, seen from the body of D, stand beside one
// another.  Of each, three-vectors with D and the mass beyond D (fields); of each pair (l, m), dot
// products of those, which are the entries for the triple (l, m, D).
#pragma once

#include <dyntape/dynamics/detail/moving_bodies.hxx>

#include <algorithm>

namespace dyntape::dynamics {
namespace detail {

// Rows of a level: motions of the columns on a path (six rows each, linear first).
enum MotionRow { kS = 0, kSDot = 6, kSDdot = 12, kSv = 18, kMotionRows = 24 };
// Rows of the fields: W(X) = int f_D x X dm of four motions, and the moments of (H.7) to (H.9).
enum FieldRow {
  kW = 0,
  kWDdot = 3,
  kWv = 6,
  kAbove = 9,
  kBeside = 12,
  kForceQ = 15,
  kForceV = 18,
  kFieldRows = 21
};

// The linear map (l, w) -> k x l + E w.
template <class T>
struct Moment {
  Vector3<T> k;
  Matrix3<T> E;
};

// out = moment of the motions in `in`, for n columns; three rows out of six.
template <class T>
void apply(const Moment<T>& M, const T* in, T* out, int stride, int n) {
  const T k0 = M.k[0], k1 = M.k[1], k2 = M.k[2];
  const T E00 = M.E(0, 0), E01 = M.E(0, 1), E02 = M.E(0, 2), E10 = M.E(1, 0), E11 = M.E(1, 1),
          E12 = M.E(1, 2), E20 = M.E(2, 0), E21 = M.E(2, 1), E22 = M.E(2, 2);
  const T *l0 = in, *l1 = in + stride, *l2 = in + 2 * stride;
  const T *w0 = in + 3 * stride, *w1 = in + 4 * stride, *w2 = in + 5 * stride;
  T *o0 = out, *o1 = out + stride, *o2 = out + 2 * stride;
  constexpr int kLanes = kColumnLanes<T>;
  for (int from = 0; from < n; from += kLanes) {
    T y0[kLanes], y1[kLanes], y2[kLanes];
    for (int c = 0; c < kLanes; ++c) {
      const int s = from + c;
      y0[c] = (k1 * l2[s] - k2 * l1[s]) + (E00 * w0[s] + E01 * w1[s] + E02 * w2[s]);
      y1[c] = (k2 * l0[s] - k0 * l2[s]) + (E10 * w0[s] + E11 * w1[s] + E12 * w2[s]);
      y2[c] = (k0 * l1[s] - k1 * l0[s]) + (E20 * w0[s] + E21 * w1[s] + E22 * w2[s]);
    }
    for (int c = 0; c < kLanes; ++c) {
      o0[from + c] = y0[c];
      o1[from + c] = y1[c];
      o2[from + c] = y2[c];
    }
  }
}

// Motions of n columns, from the parent's frame to the body's.
template <class T>
void lower_columns(const Placement<T>& X, const T* in, T* out, int stride, int n) {
  for (int row = 0; row < kMotionRows; row += 6) {
    const T *l0 = in + row * stride, *l1 = l0 + stride, *l2 = l1 + stride;
    const T *w0 = l2 + stride, *w1 = w0 + stride, *w2 = w1 + stride;
    T* o = out + row * stride;
    constexpr int kLanes = kColumnLanes<T>;
    const Matrix3<T>& R = X.R;
    const Vector3<T>& p = X.p;
    for (int from = 0; from < n; from += kLanes) {
      T y[6][kLanes];
      for (int c = 0; c < kLanes; ++c) {
        const int s = from + c;
        const T a = w0[s], b = w1[s], d = w2[s];
        const T x0 = l0[s] - (p[1] * d - p[2] * b), x1 = l1[s] - (p[2] * a - p[0] * d),
                x2 = l2[s] - (p[0] * b - p[1] * a);
        y[0][c] = R(0, 0) * x0 + R(1, 0) * x1 + R(2, 0) * x2;
        y[1][c] = R(0, 1) * x0 + R(1, 1) * x1 + R(2, 1) * x2;
        y[2][c] = R(0, 2) * x0 + R(1, 2) * x1 + R(2, 2) * x2;
        y[3][c] = R(0, 0) * a + R(1, 0) * b + R(2, 0) * d;
        y[4][c] = R(0, 1) * a + R(1, 1) * b + R(2, 1) * d;
        y[5][c] = R(0, 2) * a + R(1, 2) * b + R(2, 2) * d;
      }
      for (int r = 0; r < 6; ++r) {
        for (int c = 0; c < kLanes; ++c) o[r * stride + from + c] = y[r][c];
      }
    }
  }
}

template <class T>
void put(const Motion<T>& m, T* out, int stride) {
  for (int r = 0; r < 3; ++r) {
    out[r * stride] = m.linear[r];
    out[(r + 3) * stride] = m.angular[r];
  }
}

// [w] A
template <class T>
Matrix3<T> cross_columns(const Vector3<T>& w, const Matrix3<T>& A) {
  Matrix3<T> m;
  for (int j = 0; j < 3; ++j) {
    m(0, j) = w[1] * A(2, j) - w[2] * A(1, j);
    m(1, j) = w[2] * A(0, j) - w[0] * A(2, j);
    m(2, j) = w[0] * A(1, j) - w[1] * A(0, j);
  }
  return m;
}

// A [w]
template <class T>
Matrix3<T> times_skew(const Matrix3<T>& A, const Vector3<T>& w) {
  Matrix3<T> m;
  for (int i = 0; i < 3; ++i) {
    m(i, 0) = A(i, 1) * w[2] - A(i, 2) * w[1];
    m(i, 1) = A(i, 2) * w[0] - A(i, 0) * w[2];
    m(i, 2) = A(i, 0) * w[1] - A(i, 1) * w[0];
  }
  return m;
}

// W(X) = int f_D x X dm = (I D)_l x l + E w,   E = (l_D.h) 1 - h l_D^T + Sigma [w_D].              (H.6)
template <class T>
Moment<T> moment_with(const Composite<T>& I, const Matrix3<T>& sigma, const Motion<T>& D) {
  Moment<T> M{D.linear * I.mass + D.angular.cross(I.h), times_skew(sigma, D.angular)};
  const T along = D.linear.dot(I.h);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) M.E(i, j) -= I.h[i] * D.linear[j];
    M.E(i, i) += along;
  }
  return M;
}

// int (2 D_dot + ...) of (H.8): the field that a column above D meets in the slope of a torque by D.
template <class T>
Moment<T> moment_above(const Composite<T>& I, const Matrix3<T>& sigma, const VelocityProduct<T>& b,
                       const Motion<T>& D, const Motion<T>& D_dot) {
  const Matrix3<T> Ut = b.U.transpose();
  const Matrix3<T> turning = times_skew(sigma, D_dot.angular), before = times_skew(Ut, D.angular),
                   after = cross_columns(D.angular, Ut);
  Moment<T> M;
  M.k = (D_dot.linear * I.mass + D_dot.angular.cross(I.h) + D.angular.cross(b.p)) * T(2);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      M.E(i, j) =
          (turning(i, j) + before(i, j) - after(i, j) - I.h[i] * D_dot.linear[j] - D.linear[i] * b.p[j]) *
          T(2);
    }
  }
  const T trace = M.E(0, 0) + M.E(1, 1) + M.E(2, 2);
  for (int k = 0; k < 3; ++k) M.E(k, k) -= trace;
  return M;
}

// (S_l x S_m).K = w_l.u_m - w_m.u_l with u = l x K_l + w x K_w / 2.                               (H.9)
template <class T>
Moment<T> moment_of_force(const Force<T>& K) {
  Moment<T> M{-K.linear, Matrix3<T>::Zero()};
  const Vector3<T> n = K.angular * T(0.5);
  M.E(0, 1) = n[2], M.E(1, 0) = -n[2];
  M.E(1, 2) = n[0], M.E(2, 1) = -n[0];
  M.E(2, 0) = n[1], M.E(0, 2) = -n[1];
  return M;
}

// Fields of column D = k of joint i with the n columns of its path.
template <class T>
void fill_fields(const MovingBodies<T>& b, const Matrix3<T>& sigma, int i, int k, const T* level, T* fields,
                 int stride, int n) {
  const Composite<T>& I = b.composites[i];
  const VelocityProduct<T>& B = b.products[i];
  const Motion<T>&D = b.S[k], &D_dot = b.S_dot[k];
  const Moment<T> W = moment_with(I, sigma, D);
  apply(W, level + kS * stride, fields + kW * stride, stride, n);
  apply(W, level + kSDdot * stride, fields + kWDdot * stride, stride, n);
  apply(W, level + kSv * stride, fields + kWv * stride, stride, n);
  apply(moment_above(I, sigma, B, D, D_dot), level + kS * stride, fields + kAbove * stride, stride, n);
  const Force<T> by_q = slope_of_force(I, B, b.S_ddot[k], D_dot.angular) + cross(D, b.f[i]);
  apply(moment_of_force(by_q), level + kS * stride, fields + kForceQ * stride, stride, n);
  const Force<T> by_v = slope_of_force(I, B, b.S_v[k], D.angular);
  apply(moment_of_force(by_v), level + kS * stride, fields + kForceV * stride, stride, n);
  // 2 (w x c - W(S_dot)), c = int v x f_D dm                                                     (H.10)
  T* beside = fields + kBeside * stride;
  const T* w = level + (kS + 3) * stride;
  const Vector3<T> c = couple_with(B, D);
  apply(W, level + kSDot * stride, beside, stride, n);
  constexpr int kLanes = kColumnLanes<T>;
  for (int from = 0; from < n; from += kLanes) {
    for (int r = 0; r < 3; ++r) {
      const int s = (r + 1) % 3, t = (r + 2) % 3;
      for (int l = from; l < from + kLanes; ++l) {
        beside[r * stride + l] =
            (w[s * stride + l] * c[t] - w[t * stride + l] * c[s] - beside[r * stride + l]) * T(2);
      }
    }
  }
}

// Dot products of column m with kColumnLanes columns l.  The names say the entry: row, then derivatives.
template <class T>
struct Products {
  static constexpr int kLanes = kColumnLanes<T>;
  T lm[kLanes], ml[kLanes];                       // w_l.W_m, w_m.W_l
  T dot_lm[kLanes], dot_ml[kLanes];               // 2 w'_l.W_m, 2 w'_m.W_l
  T D_lm[kLanes], m_lD[kLanes], l_mD[kLanes];     // second in q
  T D_m_l[kLanes], m_D_l[kLanes], l_D_m[kLanes];  // q, v
  T force_q[kLanes], force_v[kLanes];             // (S_l x S_m).K
};

template <class T>
T dot3(const T* x, int stride, const T* y) {
  return x[0] * y[0] + x[stride] * y[1] + x[2 * stride] * y[2];
}

template <class T>
void multiply(const T* level, const T* fields, int stride, int from, int m, Products<T>& out) {
  T w[3], w_dot[3], w_ddot[3], w_v[3], W[3], W_ddot[3], W_v[3], above[3], beside[3], force_q[3], force_v[3];
  for (int r = 0; r < 3; ++r) {
    w[r] = level[(kS + 3 + r) * stride + m];
    w_dot[r] = level[(kSDot + 3 + r) * stride + m];
    w_ddot[r] = level[(kSDdot + 3 + r) * stride + m];
    w_v[r] = level[(kSv + 3 + r) * stride + m];
    W[r] = fields[(kW + r) * stride + m];
    W_ddot[r] = fields[(kWDdot + r) * stride + m];
    W_v[r] = fields[(kWv + r) * stride + m];
    above[r] = fields[(kAbove + r) * stride + m];
    beside[r] = fields[(kBeside + r) * stride + m];
    force_q[r] = fields[(kForceQ + r) * stride + m];
    force_v[r] = fields[(kForceV + r) * stride + m];
  }
  for (int c = 0; c < Products<T>::kLanes; ++c) {
    const T* x = level + from + c;
    const T* y = fields + from + c;
    const T *wl = x + (kS + 3) * stride, *dot = x + (kSDot + 3) * stride, *ddot = x + (kSDdot + 3) * stride;
    const T ddot_lm = dot3(ddot, stride, W), v_lm = dot3(x + (kSv + 3) * stride, stride, W);
    const T W_ddot_l = dot3(y + kWDdot * stride, stride, w), W_v_l = dot3(y + kWv * stride, stride, w);
    out.lm[c] = dot3(wl, stride, W);
    out.ml[c] = dot3(y + kW * stride, stride, w);
    out.dot_lm[c] = dot3(dot, stride, W) * T(2);
    out.dot_ml[c] = dot3(y + kW * stride, stride, w_dot) * T(2);
    out.D_lm[c] = W_ddot_l - ddot_lm + dot3(dot, stride, beside);
    out.m_lD[c] = W_ddot_l + ddot_lm + dot3(dot, stride, above);
    out.l_mD[c] = dot3(y + kW * stride, stride, w_ddot) + dot3(wl, stride, W_ddot) +
                  dot3(y + kAbove * stride, stride, w_dot);
    out.D_m_l[c] = W_v_l - v_lm + dot3(wl, stride, beside);
    out.m_D_l[c] = W_v_l + v_lm + dot3(wl, stride, above);
    out.l_D_m[c] =
        dot3(y + kW * stride, stride, w_v) + dot3(wl, stride, W_v) + dot3(y + kAbove * stride, stride, w);
    out.force_q[c] = dot3(wl, stride, force_q) - dot3(y + kForceQ * stride, stride, w);
    out.force_v[c] = dot3(wl, stride, force_v) - dot3(y + kForceV * stride, stride, w);
  }
}

template <class T>
struct Entries {
  T *qq, *qv, *vv, *aq;
};

// l on a joint above that of m.  `above`: m is on a joint above that of D; if not, entries of the row l are
// successive derivatives, first by D.
template <class T>
void store_apart(const Entries<T>& e, const Products<T>& x, int c, const Corner& l, const Corner& m,
                 const Corner& D, bool above) {
  const long Dlm = D.i + l.j + m.k, Dml = D.i + m.j + l.k, lmD = l.i + m.j + D.k, lDm = l.i + D.j + m.k;
  e.vv[Dlm] = e.vv[Dml] = x.lm[c] * T(-2);
  e.vv[lmD] = x.ml[c] * T(2);
  e.aq[lDm] = e.aq[Dlm] = x.ml[c] - x.lm[c];
  e.qq[Dlm] = e.qq[Dml] = x.D_lm[c];
  e.qq[lmD] = x.l_mD[c] + x.force_q[c];
  e.qv[Dml] = x.D_m_l[c];
  e.qv[Dlm] = -x.dot_lm[c];
  e.qv[lmD] = x.dot_ml[c] + x.force_v[c];
  if (!above) return;
  const long mlD = m.i + l.j + D.k, mDl = m.i + D.j + l.k;
  e.vv[lDm] = e.vv[lmD];
  e.qq[lDm] = e.qq[lmD];
  e.vv[mlD] = e.vv[mDl] = x.lm[c] * T(2);
  e.aq[lmD] = e.aq[mlD] = x.lm[c] + x.ml[c];
  e.qq[mlD] = e.qq[mDl] = x.m_lD[c];
  e.qv[mlD] = x.dot_lm[c];
  e.qv[lDm] = x.l_D_m[c];
  e.qv[mDl] = x.m_D_l[c];
}

// l and m on one joint; entries of the row D are successive derivatives, first by m.  Zeros are left alone.
template <class T>
void store_beside(const Entries<T>& e, const Products<T>& x, int c, const Corner& l, const Corner& m,
                  const Corner& D, bool above) {
  const long Dlm = D.i + l.j + m.k;
  e.qq[Dlm] = x.D_lm[c];
  if (l.i != D.i || m.i != D.i) {
    e.vv[Dlm] = x.lm[c] * T(-2);
    e.qv[D.i + m.j + l.k] = -x.dot_ml[c];
  }
  if (!above) return;
  const long lmD = l.i + m.j + D.k, lDm = l.i + D.j + m.k;
  e.vv[lmD] = e.vv[lDm] = x.ml[c] * T(2);
  e.aq[lmD] = x.lm[c] + x.ml[c];
  e.qq[lmD] = e.qq[lDm] = x.l_mD[c];
  e.qv[lmD] = x.dot_ml[c];
  e.qv[lDm] = x.l_D_m[c];
}

// All triples whose deepest column is D, at position `at` of the path; its joint ends with the n-th column.
template <class T>
void fill_triples(SecondOrder<T>& second, const T* level, int at, int n) {
  const Entries<T> e{second.d2tau_dqdq.values().data(), second.d2tau_dqdv.values().data(),
                     second.d2tau_dvdv.values().data(), second.d2tau_dadq.values().data()};
  const Corner D = second.path[at];
  const int joint_start = second.starts[at];
  const T* fields = second.fields.data();
  Products<T> x;
  for (int m = 0; m < n; ++m) {
    const int start = second.starts[m], end = second.ends[m];
    const Corner C = second.path[m];
    const bool above = start < joint_start;
    for (int from = 0; from < end; from += Products<T>::kLanes) {
      multiply(level, fields, second.stride, from, m, x);
      const int last = std::min(from + Products<T>::kLanes, end);
      for (int l = from; l < std::min(last, start); ++l) {
        store_apart(e, x, l - from, second.path[l], C, D, above);
      }
      for (int l = std::max(from, start); l < last; ++l) {
        store_beside(e, x, l - from, second.path[l], C, D, above);
      }
    }
  }
}

// Of successive derivatives along columns of one joint, the mean of both orders.
template <class T>
void symmetrise_joints(const Tree& tree, Tensor3<T>& tensor) {
  for (std::size_t i = 0; i < tree.first.size(); ++i) {
    for (int k = tree.first[i]; k < tree.first[i] + tree.count[i]; ++k) {
      for (int j = tree.first[i]; j < k; ++j) {
        for (int r = 0; r < tensor.size(); ++r) {
          tensor(r, j, k) = tensor(r, k, j) = (tensor(r, j, k) + tensor(r, k, j)) * T(0.5);
        }
      }
    }
  }
}

}  // namespace detail

template <class T>
SecondOrder<T>::SecondOrder(const Model<T>& model)
    : d2tau_dqdq(model.nv),
      d2tau_dqdv(model.nv),
      d2tau_dvdv(model.nv),
      d2tau_dadq(model.nv),
      bodies(model),
      stride(detail::whole_chunks<T>(bodies.longest_path)) {
  path.resize(stride, detail::Corner(0, 0));
  starts.resize(stride);
  ends.resize(stride);
  levels = VectorX<T>::Zero(static_cast<long>(bodies.levels) * detail::kMotionRows * stride);
  fields = VectorX<T>::Zero(static_cast<long>(detail::kFieldRows) * stride);
}

template <class T>
void id_second_order(const Model<T>& model, Data<T>& data, SecondOrder<T>& second, const VectorRef<T>& q,
                     const VectorRef<T>& v, const VectorRef<T>& a, const Acting<T>& acting) {
  detail::check_arguments("id_second_order", model, data, q, &v, &a);
  detail::check_acting("id_second_order", model, acting);
  detail::check("id_second_order", "workspace", model, second.d2tau_dqdq.size(), model.nv);
  MovingBodies<T>& b = second.bodies;
  detail::move_and_gather(model, data, b, q, v, a, acting);
  const Tree& tree = data.tree;
  const int stride = second.stride;
  for (int i : b.preorder) {
    const int start = b.above[i], count = tree.count[i], n = start + count;
    T* level = second.levels.data() + static_cast<long>(b.depth[i]) * detail::kMotionRows * stride;
    detail::lower_columns(data.X_PB[i], level - detail::kMotionRows * stride, level, stride, start);
    for (int at = start, k = tree.first[i]; at < n; ++at, ++k) {
      second.path[at] = detail::Corner(k, model.nv);
      second.starts[at] = start;
      second.ends[at] = n;
      detail::put(b.S[k], level + detail::kS * stride + at, stride);
      detail::put(b.S_dot[k], level + detail::kSDot * stride + at, stride);
      detail::put(b.S_ddot[k], level + detail::kSDdot * stride + at, stride);
      detail::put(b.S_v[k], level + detail::kSv * stride + at, stride);
    }
    const Matrix3<T> sigma = detail::second_moment(b.composites[i]);
    for (int at = start; at < n; ++at) {
      detail::fill_fields(b, sigma, i, tree.first[i] + at - start, level, second.fields.data(), stride, n);
      detail::fill_triples(second, level, at, n);
    }
  }
  detail::symmetrise_joints(tree, second.d2tau_dqdq);
  detail::symmetrise_joints(tree, second.d2tau_dvdv);
}

}  // namespace dyntape::dynamics
