// SPDX-License-Identifier: BSD-3-Clause
//
// Of forward dynamics, from those of inverse dynamics: docs/math.md (H.20) to (H.23).
#pragma once

#include <dyntape/dynamics/algorithms/detail/derivatives.hxx>
#include <dyntape/dynamics/algorithms/detail/hessian.hxx>
#include <dyntape/dynamics/algorithms/detail/second_order_tensors.hxx>

namespace dyntape::dynamics {
namespace detail {

// C += A B for A (n x n), column by column, four of A at a time; no memory is taken.
template <class T>
void add_product(const T* A, const T* B, int n, int columns, T* C) {
  for (int j = 0; j < columns; ++j, B += n, C += n) {
    T* __restrict c = C;
    int k = 0;
    for (; k + 4 <= n; k += 4) {
      const T *a0 = A + k * n, *a1 = a0 + n, *a2 = a1 + n, *a3 = a2 + n;
      const T b0 = B[k], b1 = B[k + 1], b2 = B[k + 2], b3 = B[k + 3];
      for (int i = 0; i < n; ++i) c[i] += (a0[i] * b0 + a1[i] * b1) + (a2[i] * b2 + a3[i] * b3);
    }
    for (; k < n; ++k) {
      const T* a = A + k * n;
      const T b = B[k];
      for (int i = 0; i < n; ++i) c[i] += a[i] * b;
    }
  }
}

template <class MA, class MB, class T>
void add_product(const MA& A, const MB& B, MatrixX<T>& C) {
  add_product(A.data(), B.data(), static_cast<int>(A.rows()), static_cast<int>(B.cols()), C.data());
}

}  // namespace detail

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
                     const Acting<T>& acting) {
  detail::check("fd_second_order", "workspace", model, second.id.d2tau_dqdq.size(), model.nv);
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

// With mu = M^-1 lambda, G the Hessian of mu^T tau over (q, v, a) and B = G_qa:
//   H_qq = -(G_qq + B a_q + (B a_q)^T)   H_qv = -(G_qv + B a_v)   H_vv = -G_vv   H_qtau = -B M^-1
template <class T>
const MatrixX<T>& fd_hessian(const Model<T>& model, Data<T>& data, Hessian<T>& hessian, const VectorRef<T>& q,
                             const VectorRef<T>& v, const VectorRef<T>& tau, const VectorRef<T>& lambda,
                             const Acting<T>& acting) {
  detail::check("fd_hessian", "lambda", model, lambda.size(), model.nv);
  detail::check("fd_hessian", "workspace", model, hessian.mu.size(), model.nv);
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
