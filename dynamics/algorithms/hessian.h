// SPDX-License-Identifier: BSD-3-Clause
//
// Second derivatives contracted with a vector, as matrices; second_order.h defines them and their order.
#pragma once

#include <dyntape/dynamics/algorithms/second_order_common.h>

#include <vector>

namespace dyntape::dynamics {

template <class T>
struct Hessian {
  explicit Hessian(const Model<T>& model);

  MatrixX<T> d2tau;  // (3nv x 3nv) of mu^T tau over (q, v, a)
  MatrixX<T> d2ddq;  // (3nv x 3nv) of lambda^T ddq over (q, v, tau)

  // Working memory.
  MovingBodies<T> bodies;
  std::vector<Motion<T>> m_p, m;               // (njoints) the motion with velocity mu, as v_p and v
  std::vector<VelocityProduct<T>> m_products;  // (njoints)
  std::vector<Vector3<T>> couples;             // (njoints) int v x m dm
  std::vector<Motion<T>> S_mu;                 // (nv) m_p x S
  int stride = 0;
  detail::LaneArray<T> travellers;  // wrenches and couples of all columns on the way to the root
  detail::LaneArray<T> meetings;    // their products with one column
  VectorX<T> mu;                    // (nv)
  MatrixX<T> B, E;                  // (nv x nv)
};

// Computes the Hessian of mu^T tau over (q, v, a), in one sweep without tensors: O(n d), as id_derivatives.
template <class T>
const MatrixX<T>& id_hessian(const Model<T>& model, Data<T>& data, Hessian<T>& hessian, const VectorRef<T>& q,
                             const VectorRef<T>& v, const VectorRef<T>& a, const VectorRef<T>& mu,
                             const DynamicsTerms<T>& acting = {});

// Computes the Hessian of lambda^T ddq over (q, v, tau).  Calls fd_derivatives; its results are in data.
template <class T>
const MatrixX<T>& fd_hessian(const Model<T>& model, Data<T>& data, Hessian<T>& hessian, const VectorRef<T>& q,
                             const VectorRef<T>& v, const VectorRef<T>& tau, const VectorRef<T>& lambda,
                             const DynamicsTerms<T>& acting = {});

}  // namespace dyntape::dynamics
