// SPDX-License-Identifier: BSD-3-Clause
//
// Second derivatives of inverse and forward dynamics, as tensors or contracted with a vector.
//
//   Hessian<double> hessian(model);                        // results and working memory, allocated once
//   id_hessian(model, data, hessian, q, v, a, mu);         // hessian.d2tau, of mu^T tau(q, v, a)
//   SecondOrder<double> second(model);
//   id_second_order(model, data, second, q, v, a);         // second.d2tau_dqdq(i, j, k), ...
//
// Definition.  On a joint of several columns successive tangent derivatives do not commute.  The result is the
// symmetric one, the Hessian of tau(q (+) w) at w = 0, as needed by Newton's method.  With e_j the derivative along
// column j of the moving frame, w = S_j x S_k and w_c its entry at column c,
//   e_j e_k tau = d2tau_dqdq(:, j, k) + 1/2 sum_c w_c dtau/dq_c        (j, k columns of one joint)
// and without the second term for all other pairs.
//
// Shapes.  A tensor is (nv x nv x nv).  Entry (i, j, k) is the derivative of entry i with respect to the first
// variable of the name along column j and the second along k, at values()[i + nv (j + nv k)]; slice(k) is a matrix.
// Layout and order are Pinocchio's.  A Hessian is (3nv x 3nv) over (q, v, a), or over (q, v, tau), both triangles.
// Units follow from model.h.  Entries of inverse dynamics are nonzero only if i, j and k are on one path from root
// to leaf; the constructor sets the others to zero.
//
// External forces are constant in their body's frame.  Armature adds nothing.  All is in body frames, independent of
// positions in the world.
//
// Sources: docs/math.md (H.1 ...); S. Singh, R. Russell, P. Wensing, On Second-Order Derivatives of Rigid-Body
// Dynamics: Theory and Implementation, IEEE T-RO 2024 (which entries exist, expressions by columns).  Here they are
// integrals over the mass of products of velocity fields: a three-vector per pair and dot products per triple.
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

// The slices of column k as first, second and third index.
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
  std::vector<detail::Corner> path;  // (stride) the columns from the root to the current joint
  std::vector<int> starts, ends;     // (stride) first and last column of each one's joint
  detail::LaneArray<T> levels;       // motions of the columns of a path, one level per depth
  detail::LaneArray<T> fields;       // three-vectors of each with the deepest column
  detail::LaneArray<T> products;     // dot products of those
};

// Forward dynamics; the tensors of inverse dynamics are evaluated at ddq(q, v, tau).
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

// Tensors of second derivatives of tau(q, v, a); d2tau/da2 and d2tau/dadv are zero.  Cost: O(n d^2) for n columns on
// paths of length d.
template <class T>
void id_second_order(const Model<T>& model, Data<T>& data, SecondOrder<T>& second, const VectorRef<T>& q,
                     const VectorRef<T>& v, const VectorRef<T>& a, const DynamicsTerms<T>& acting = {});

// Tensors of second derivatives of ddq(q, v, tau); those for (tau, tau) and (tau, v) are zero.  Calls
// fd_derivatives; its results are in data.
template <class T>
void fd_second_order(const Model<T>& model, Data<T>& data, ForwardSecondOrder<T>& second,
                     const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& tau,
                     const DynamicsTerms<T>& acting = {});

}  // namespace dyntape::dynamics
