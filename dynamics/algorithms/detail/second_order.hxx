// SPDX-License-Identifier: BSD-3-Clause
//
// Second derivatives of inverse dynamics as tensors: docs/math.md (H.5) to (H.12).
//
// For each column D, all columns m of the path from the root to it, seen from the body of D, stand beside one
// another.  Of each, three-vectors with D and the mass beyond D (fields); of each pair (l, m), dot
// products of those, which are the entries for the triple (l, m, D).  Of forward dynamics: (H.20), (H.21).
#pragma once

#include <dyntape/dynamics/algorithms/second_order.h>
#include <dyntape/dynamics/algorithms/detail/derivatives.hxx>
#include <dyntape/dynamics/algorithms/detail/second_order_common.hxx>

namespace dyntape::dynamics {
namespace detail {

// Rows of a level: motions of the columns on a path (six rows each, linear first).
enum MotionRow { kS = 0, kSDot = 6, kSDdot = 12, kSv = 18, kMotionRows = 24 };
// Rows of the fields: W(X) = int f_D x X dm of four motions, and the moments of (H.8) to (H.10).
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

// out = moment of the motions in `in`, for n columns; three quantities out of six.
template <class T>
DYNTAPE_INLINE void apply(const Moment<T>& M, const T* in, T* out, int stride, int n) {
  over<T>(0, n, [&](int s, auto lanes) {
    const SixLanes<T> six(in + s, stride, lanes);
    const auto& m = six.x;
    for (int r = 0; r < 3; ++r) {
      const int i = (r + 1) % 3, j = (r + 2) % 3;
      lanes.store(out + r * stride + s,
                  (m[j] * M.k.at(i) - m[i] * M.k.at(j)) +
                      (m[3] * M.E.at(r, 0) + m[4] * M.E.at(r, 1) + m[5] * M.E.at(r, 2)));
    }
  });
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
  over<T>(0, n, [&](int s, auto lanes) {
    for (int r = 0; r < 3; ++r) {
      const int i = (r + 1) % 3, j = (r + 2) % 3;
      const auto turned = lanes.load(w + i * stride + s) * c.at(j) - lanes.load(w + j * stride + s) * c.at(i);
      lanes.store(beside + r * stride + s, (turned - lanes.load(beside + r * stride + s)) * T(2));
    }
  });
}

// Rows of the dot products of one column m with all columns l.  The names say the entry: row, then
// derivatives.
enum ProductRow {
  kLM,
  kML,  // w_l.W_m, w_m.W_l
  kDotLM,
  kDotML,  // 2 S_dot_l.W_m, 2 S_dot_m.W_l
  kD_LM,
  kM_LD,
  kL_MD,  // second in q
  kDqMvL,
  kMqDvL,
  kLqDvM,  // q, v
  kForceQLM,
  kForceVLM,  // (S_l x S_m).K
  kProductRows
};

template <class T>
DYNTAPE_INLINE Vector3<T> entry(const T* from, std::ptrdiff_t stride, int m) {
  return {from[m], from[stride + m], from[2 * stride + m]};
}

// Column m with the columns before `end`.
template <class T>
void multiply(const T* level, const T* fields, T* products, int stride, int m, int end) {
  const auto at = [&](const T* from, int row) { return entry(from + row * stride, stride, m); };
  const Vector3<T> w = at(level, kS + 3), dot = at(level, kSDot + 3), ddot = at(level, kSDdot + 3),
                   wv = at(level, kSv + 3);
  const Vector3<T> W = at(fields, kW), W_ddot = at(fields, kWDdot), W_v = at(fields, kWv),
                   above = at(fields, kAbove), beside = at(fields, kBeside), force_q = at(fields, kForceQ),
                   force_v = at(fields, kForceV);
  over<T>(0, end, [&](int s, auto lanes) {
    using Vector = typename Lanes<T>::Vector;
    const auto put = [&](int row, const Vector& x) { lanes.store(products + row * stride + s, x); };
    const auto of = [&](const T* from, int row) {
      return ThreeLanes<T>(from + row * stride + s, stride, lanes);
    };
    const ThreeLanes<T> w_l = of(level, kS + 3), dot_l = of(level, kSDot + 3), ddot_l = of(level, kSDdot + 3),
                        wv_l = of(level, kSv + 3), W_l = of(fields, kW), above_l = of(fields, kAbove);
    put(kLM, w_l.dot(W));
    put(kML, W_l.dot(w));
    put(kDotLM, dot_l.dot(W) * T(2));
    put(kDotML, W_l.dot(dot) * T(2));
    const Vector by_q = of(fields, kWDdot).dot(w), turned_q = ddot_l.dot(W);
    put(kD_LM, by_q - turned_q + dot_l.dot(beside));
    put(kM_LD, by_q + turned_q + dot_l.dot(above));
    put(kL_MD, W_l.dot(ddot) + w_l.dot(W_ddot) + above_l.dot(dot));
    const Vector by_v = of(fields, kWv).dot(w), turned_v = wv_l.dot(W);
    put(kDqMvL, by_v - turned_v + w_l.dot(beside));
    put(kMqDvL, by_v + turned_v + w_l.dot(above));
    put(kLqDvM, W_l.dot(wv) + w_l.dot(W_v) + above_l.dot(w));
    put(kForceQLM, w_l.dot(force_q) - of(fields, kForceQ).dot(w));
    put(kForceVLM, w_l.dot(force_v) - of(fields, kForceV).dot(w));
  });
}

template <class T>
struct Entries {
  T *qq, *qv, *vv, *aq;
};

// The products of m with column l.
template <class T>
struct ProductsOf {
  const T* x;  // at l
  int stride;
  const T& operator[](ProductRow row) const { return x[row * stride]; }
};

// l on a joint above that of m.  `above`: m is on a joint above that of D; if not, entries of the row l are
// successive derivatives, first by D.
template <class T>
DYNTAPE_INLINE void store_apart(const Entries<T>& e, const ProductsOf<T>& x, const Corner& l, const Corner& m,
                                const Corner& D, bool above) {
  const T lm = x[kLM], ml = x[kML], dot_lm = x[kDotLM], dot_ml = x[kDotML];
  const long Dlm = D.i + l.j + m.k, Dml = D.i + m.j + l.k, lmD = l.i + m.j + D.k, lDm = l.i + D.j + m.k;
  e.vv[Dlm] = e.vv[Dml] = lm * T(-2);
  e.aq[lDm] = e.aq[Dlm] = ml - lm;
  e.qq[Dlm] = e.qq[Dml] = x[kD_LM];
  e.qv[Dml] = x[kDqMvL];
  e.qv[Dlm] = -dot_lm;
  e.qv[lmD] = dot_ml + x[kForceVLM];
  const T v_l = ml * T(2), q_l = x[kL_MD] + x[kForceQLM];
  e.vv[lmD] = v_l;
  e.qq[lmD] = q_l;
  if (!above) return;
  const long mlD = m.i + l.j + D.k, mDl = m.i + D.j + l.k;
  e.vv[lDm] = v_l;
  e.qq[lDm] = q_l;
  e.vv[mlD] = e.vv[mDl] = lm * T(2);
  e.aq[lmD] = e.aq[mlD] = lm + ml;
  e.qq[mlD] = e.qq[mDl] = x[kM_LD];
  e.qv[mlD] = dot_lm;
  e.qv[lDm] = x[kLqDvM];
  e.qv[mDl] = x[kMqDvL];
}

// l and m on one joint; entries of the row D are successive derivatives, first by m.  Zeros are left alone.
template <class T>
DYNTAPE_INLINE void store_beside(const Entries<T>& e, const ProductsOf<T>& x, const Corner& l,
                                 const Corner& m, const Corner& D, bool above) {
  const long Dlm = D.i + l.j + m.k;
  e.qq[Dlm] = x[kD_LM];
  if (l.i != D.i || m.i != D.i) {
    e.vv[Dlm] = x[kLM] * T(-2);
    e.qv[D.i + m.j + l.k] = -x[kDotML];
  }
  if (!above) return;
  const long lmD = l.i + m.j + D.k, lDm = l.i + D.j + m.k;
  const T lm = x[kLM], ml = x[kML];
  e.vv[lmD] = e.vv[lDm] = ml * T(2);
  e.aq[lmD] = lm + ml;
  e.qq[lmD] = e.qq[lDm] = x[kL_MD];
  e.qv[lmD] = x[kDotML];
  e.qv[lDm] = x[kLqDvM];
}

// All triples whose deepest column is D, at position `at` of the path; its joint ends with the n-th column.
template <class T>
void fill_triples(SecondOrder<T>& second, const T* level, int at, int n) {
  const Entries<T> e{second.d2tau_dqdq.values().data(), second.d2tau_dqdv.values().data(),
                     second.d2tau_dvdv.values().data(), second.d2tau_dadq.values().data()};
  const Corner D = second.path[at];
  const Corner* path = second.path.data();
  const int joint_start = second.starts[at], stride = second.stride;
  T* products = second.products.data();
  for (int m = 0; m < n; ++m) {
    const int start = second.starts[m], end = second.ends[m];
    const Corner C = path[m];
    multiply(level, second.fields.data(), products, stride, m, end);
    if (start < joint_start) {
      for (int l = 0; l < start; ++l) store_apart<T>(e, {products + l, stride}, path[l], C, D, true);
      for (int l = start; l < end; ++l) store_beside<T>(e, {products + l, stride}, path[l], C, D, true);
    } else {
      for (int l = 0; l < start; ++l) store_apart<T>(e, {products + l, stride}, path[l], C, D, false);
      for (int l = start; l < end; ++l) store_beside<T>(e, {products + l, stride}, path[l], C, D, false);
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
      stride(static_cast<int>(detail::whole_lines<T>(bodies.longest_path))) {
  path.resize(stride, detail::Corner(0, 0));
  starts.resize(stride);
  ends.resize(stride);
  const auto lanes = [&](int quantities) {
    return detail::LaneArray<T>(std::ptrdiff_t{stride} * quantities);
  };
  levels = lanes(bodies.levels * detail::kMotionRows);
  fields = lanes(detail::kFieldRows);
  products = lanes(detail::kProductRows);
}

template <class T>
void id_second_order(const Model<T>& model, Data<T>& data, SecondOrder<T>& second, const VectorRef<T>& q,
                     const VectorRef<T>& v, const VectorRef<T>& a, const DynamicsTerms<T>& acting) {
  detail::check_arguments("id_second_order", model, data, acting, q, &v, &a);
  detail::check_shape("id_second_order", "workspace", model, second.bodies.shape);
  MovingBodies<T>& b = second.bodies;
  detail::move_and_gather(model, data, b, q, v, a, acting);
  const Tree& tree = data.tree;
  const int stride = second.stride;
  for (int i : tree.preorder) {
    const int start = b.above[i], n = start + tree.count[i];
    T* level =
        second.levels.data() + static_cast<std::ptrdiff_t>(tree.depth[i]) * detail::kMotionRows * stride;
    for (int row = 0; row < detail::kMotionRows && start > 0; row += 6) {
      const T* from = level + (row - detail::kMotionRows) * stride;
      detail::act_inverse_columns(data.X_PB[i], from, level + row * stride, stride, 0, start);
    }
    for (int at = start, k = tree.first[i]; at < n; ++at, ++k) {
      second.path[at] = detail::Corner(k, model.nv);
      second.starts[at] = start;
      second.ends[at] = n;
      detail::put_spatial(level + detail::kS * stride, stride, at, b.S[k]);
      detail::put_spatial(level + detail::kSDot * stride, stride, at, b.S_dot[k]);
      detail::put_spatial(level + detail::kSDdot * stride, stride, at, b.S_ddot[k]);
      detail::put_spatial(level + detail::kSv * stride, stride, at, b.S_v[k]);
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

template <class T>
ForwardSecondOrder<T>::ForwardSecondOrder(const Model<T>& model)
    : id(model),
      d2ddq_dqdq(model.nv),
      d2ddq_dqdv(model.nv),
      d2ddq_dvdv(model.nv),
      d2ddq_dtaudq(model.nv),
      work(MatrixX<T>::Zero(model.nv, model.nv)),
      solved(MatrixX<T>::Zero(model.nv, model.nv)) {}

// With a_x = ddq_dx and M_j = dM/dq_j:
//   d2a/dq_j dq_k = -M^-1 (d2tau/dq_j dq_k + M_j a_qk + M_k a_qj)    d2a/dv2       = -M^-1 d2tau/dv2
//   d2a/dq_j dv_k = -M^-1 (d2tau/dq_j dv_k + M_j a_vk)               d2a/dtau dq_j = -M^-1 M_j M^-1
template <class T>
void fd_second_order(const Model<T>& model, Data<T>& data, ForwardSecondOrder<T>& second,
                     const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& tau,
                     const DynamicsTerms<T>& acting) {
  detail::check_shape("fd_second_order", "workspace", model, second.id.bodies.shape);
  fd_derivatives<T>(model, data, q, v, tau, acting);
  id_second_order<T>(model, data, second.id, q, v, data.ddq, acting);
  const int n = model.nv;
  const SecondOrder<T>& id = second.id;
  MatrixX<T>& work = second.work;
  second.d2ddq_dqdq.values() = id.d2tau_dqdq.values();
  for (int j = 0; j < n; ++j) {
    const auto M_j = id.d2tau_dadq.slice(j);
    work.setZero();
    detail::add_product(M_j, data.ddq_dq, work);
    second.d2ddq_dqdq.slice(j) += work;  // entries (:, k, j) by M_j a_qk
    for (int k = 0; k < n; ++k) second.d2ddq_dqdq.slice(k).col(j) += work.col(k);
    for (int k = 0; k < n; ++k) work.col(k) = id.d2tau_dqdv.slice(k).col(j);
    detail::add_product(M_j, data.ddq_dv, work);
    second.solved.setZero();
    detail::add_product(data.Minv, work, second.solved);
    for (int k = 0; k < n; ++k) second.d2ddq_dqdv.slice(k).col(j) = -second.solved.col(k);
    work.setZero();
    detail::add_product(M_j, data.Minv, work);
    second.solved.setZero();
    detail::add_product(data.Minv, work, second.solved);
    second.d2ddq_dtaudq.slice(j) = -second.solved;
    second.solved.setZero();
    detail::add_product(data.Minv, id.d2tau_dvdv.slice(j), second.solved);
    second.d2ddq_dvdv.slice(j) = -second.solved;
  }
  for (int k = 0; k < n; ++k) {
    second.solved.setZero();
    detail::add_product(data.Minv, second.d2ddq_dqdq.slice(k), second.solved);
    second.d2ddq_dqdq.slice(k) = -second.solved;
  }
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_SECOND_ORDER(T, ...)                        \
  __VA_ARGS__ template struct dyntape::dynamics::SecondOrder<T>;        \
  __VA_ARGS__ template struct dyntape::dynamics::ForwardSecondOrder<T>; \
  DYNTAPE_COMPILE(id_second_order, T, __VA_ARGS__)                      \
  DYNTAPE_COMPILE(fd_second_order, T, __VA_ARGS__)

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_SECOND_ORDER)
