// SPDX-License-Identifier: BSD-3-Clause
//
// Second derivatives of inverse and of forward dynamics: as tensors, or contracted with a vector.
//
//   Hessian<double> hessian(model);                        // results and working memory, allocated once
//   id_hessian(model, data, hessian, q, v, a, mu);         // hessian.d2tau, of mu^T tau(q, v, a)
//   SecondOrder<double> second(model);
//   id_second_order(model, data, second, q, v, a);         // second.d2tau_dqdq(i, j, k), ...
//
// Which second derivative.  On a joint of several columns successive tangent derivatives do not commute.
// What comes back is the symmetric one, the Hessian of tau(q (+) w) at w = 0, which Newton's method needs.
// With e_j the derivative along column j of the moving frame, w = S_j x S_k and w_c its entry at column c,
//   e_j e_k tau = d2tau_dqdq(:, j, k) + 1/2 sum_c w_c dtau/dq_c        (j, k columns of one joint)
// and without the second term for all other pairs.
//
// Shapes.  A tensor is (nv x nv x nv): entry (i, j, k) is the derivative of entry i, by the first variable of
// the name along column j, by the second along k, at values()[i + nv (j + nv k)]; slice(k) is a matrix.
// Layout and order are Pinocchio's.  A Hessian is (3nv x 3nv) over (q, v, a), or over (q, v, tau), both
// triangles.  Units follow from model.h.  Entries of inverse dynamics are non-zero only where i, j and k lie
// on one path from root to leaf; the others are set once, to zero, by the constructor.
//
// External forces are constant in their body's frame.  Armature adds nothing.
// Equations: docs/math.md (H.1 ...).  Everything is expressed in body frames and no absolute position enters.
// Sources: S. Singh, R. Russell, P. Wensing, On Second-Order Derivatives of Rigid-Body Dynamics: Theory and
// Implementation, IEEE T-RO 2024 (which entries exist, expressions by columns); ours are integrals over the
// mass of products of velocity fields, which leaves a three-vector a pair and dot products a triple.
#pragma once

#include <dyntape/dynamics/algorithms/hessian.h>
#include <dyntape/dynamics/algorithms/second_order_common.h>

#include <vector>

namespace dyntape::dynamics {

// nv x nv x nv numbers, the first index fastest.
template <class T>
class Tensor3 {
 public:
  explicit Tensor3(int n = 0) : n_(n), values_(VectorX<T>::Zero(static_cast<long>(n) * n * n)) {}

  int size() const { return n_; }
  T& operator()(int i, int j, int k) { return values_[i + n_ * (j + static_cast<long>(n_) * k)]; }
  const T& operator()(int i, int j, int k) const { return values_[i + n_ * (j + static_cast<long>(n_) * k)]; }
  // Entries (i, j) at a fixed last index.
  Eigen::Map<MatrixX<T>> slice(int k) { return {values_.data() + static_cast<long>(n_) * n_ * k, n_, n_}; }
  Eigen::Map<const MatrixX<T>> slice(int k) const {
    return {values_.data() + static_cast<long>(n_) * n_ * k, n_, n_};
  }
  VectorX<T>& values() { return values_; }
  const VectorX<T>& values() const { return values_; }

 private:
  int n_;
  VectorX<T> values_;
};

namespace detail {

// Where column k stands in a tensor as first, second and third index.
struct Corner {
  long i, j, k;
  Corner(int column, long n) : i(column), j(column * n), k(column * n * n) {}
};

}  // namespace detail

template <class T>
struct SecondOrder {
  explicit SecondOrder(const Model<T>& model);

  Tensor3<T> d2tau_dqdq;  // symmetric in the last two indices
  Tensor3<T> d2tau_dqdv;
  Tensor3<T> d2tau_dvdv;  // symmetric in the last two indices
  Tensor3<T> d2tau_dadq;  // dM(i, j) / dq_k, symmetric in the first two indices

  // Working memory.
  MovingBodies<T> bodies;
  int stride = 0;                    // columns of the longest path, in whole chunks of lanes
  std::vector<detail::Corner> path;  // (stride) the columns from the root to the joint at hand
  std::vector<int> starts, ends;     // (stride) where the joint of each of them starts and ends there
  detail::LaneArray<T> levels;       // motions of the columns of a path, a level for each depth
  detail::LaneArray<T> fields;       // three-vectors of each with one column, the deepest
  detail::LaneArray<T> products;     // dot products of those
};

// Forward dynamics; the tensors of inverse dynamics are at ddq(q, v, tau).
template <class T>
struct ForwardSecondOrder {
  explicit ForwardSecondOrder(const Model<T>& model);

  SecondOrder<T> id;
  Tensor3<T> d2ddq_dqdq;  // symmetric in the last two indices
  Tensor3<T> d2ddq_dqdv;
  Tensor3<T> d2ddq_dvdv;    // symmetric in the last two indices
  Tensor3<T> d2ddq_dtaudq;  // dMinv(i, j) / dq_k, symmetric in the first two indices

  MatrixX<T> work, solved;  // (nv x nv)
};

// Tensors of second derivatives of tau(q, v, a); d2tau/da2 and d2tau/dadv are zero.  O(n d^2) for n columns
// on paths of d.
template <class T>
void id_second_order(const Model<T>& model, Data<T>& data, SecondOrder<T>& second, const VectorRef<T>& q,
                     const VectorRef<T>& v, const VectorRef<T>& a, const DynamicsTerms<T>& acting = {});

// Tensors of second derivatives of ddq(q, v, tau); those by tau twice and by tau and v are zero.  Calls
// fd_derivatives, whose results it leaves in data.
template <class T>
void fd_second_order(const Model<T>& model, Data<T>& data, ForwardSecondOrder<T>& second,
                     const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& tau,
                     const DynamicsTerms<T>& acting = {});

}  // namespace dyntape::dynamics
