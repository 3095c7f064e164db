// SPDX-License-Identifier: BSD-3-Clause
//
// Configurations of a whole robot: q is in a product of lines, circles and SE(3); v is in its tangent space.
//
//   VectorX<double> q1 = integrate(model, q0, v);     // q0 (+) v: move by v, each joint in its moving frame
//   VectorX<double> d  = difference(model, q0, q1);   // v again (angles up to half a turn)
//
// q (nq), v (nv).  Pairs (cos, sin) and quaternions may have any nonzero norm; results have unit norm.  The
// quaternion keeps the sign branch of its argument.  ArgumentError for wrong sizes.
#pragma once

#include <dyntape/dynamics/model/joints.h>

namespace dyntape::dynamics {

template <class T>
VectorX<T> integrate(const Model<T>& model, const VectorRef<T>& q, const VectorRef<T>& v);

// v with q0 (+) v = q1.
template <class T>
VectorX<T> difference(const Model<T>& model, const VectorRef<T>& q0, const VectorRef<T>& q1);

// Two tangent Jacobians (nv x nv), increments in the moving frames on both sides.
template <class T>
struct TangentJacobians {
  MatrixX<T> first, second;
};

// d(q (+) v) with respect to q and to v.
template <class T>
TangentJacobians<T> integrate_jacobians(const Model<T>& model, const VectorRef<T>& v);

// d(q1 (-) q0) with respect to q0 and to q1, at v = difference(q0, q1).
template <class T>
TangentJacobians<T> difference_jacobians(const Model<T>& model, const VectorRef<T>& v);

// All joints at zero.
template <class T>
VectorX<T> neutral(const Model<T>& model);

// Random, within the limits (joints.h); the same engine state gives the same q on every machine, up to its libm.
template <class T>
VectorX<T> random_configuration(const Model<T>& model, std::mt19937_64& random);

}  // namespace dyntape::dynamics
