// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/model/checks.h>
#include <dyntape/dynamics/model/configuration.h>

namespace dyntape::dynamics {

template <class T>
VectorX<T> integrate(const Model<T>& model, const VectorRef<T>& q, const VectorRef<T>& v) {
  detail::check("integrate", "q", model, q.size(), model.nq);
  detail::check("integrate", "v", model, v.size(), model.nv);
  VectorX<T> next(model.nq);
  for (const Joint<T>& joint : model.joints) integrate<T>(joint, q, v, next);
  return next;
}

template <class T>
VectorX<T> difference(const Model<T>& model, const VectorRef<T>& q0, const VectorRef<T>& q1) {
  detail::check("difference", "q0", model, q0.size(), model.nq);
  detail::check("difference", "q1", model, q1.size(), model.nq);
  VectorX<T> v(model.nv);
  for (const Joint<T>& joint : model.joints) difference<T>(joint, q0, q1, v);
  return v;
}

template <class T>
TangentJacobians<T> integrate_jacobians(const Model<T>& model, const VectorRef<T>& v) {
  detail::check("integrate_jacobians", "v", model, v.size(), model.nv);
  TangentJacobians<T> d{MatrixX<T>::Zero(model.nv, model.nv), MatrixX<T>::Zero(model.nv, model.nv)};
  for (const Joint<T>& joint : model.joints) integrate_jacobians<T>(joint, v, d.first, d.second);
  return d;
}

template <class T>
TangentJacobians<T> difference_jacobians(const Model<T>& model, const VectorRef<T>& v) {
  detail::check("difference_jacobians", "v", model, v.size(), model.nv);
  TangentJacobians<T> d{MatrixX<T>::Zero(model.nv, model.nv), MatrixX<T>::Zero(model.nv, model.nv)};
  for (const Joint<T>& joint : model.joints) difference_jacobians<T>(joint, v, d.first, d.second);
  return d;
}

template <class T>
VectorX<T> neutral(const Model<T>& model) {
  VectorX<T> q(model.nq);
  for (const Joint<T>& joint : model.joints) neutral<T>(joint, q);
  return q;
}

template <class T>
VectorX<T> random_configuration(const Model<T>& model, std::mt19937_64& random) {
  VectorX<T> q(model.nq);
  for (const Joint<T>& joint : model.joints) random_configuration<T>(joint, random, q);
  return q;
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_CONFIGURATION(T, ...)                                                        \
  namespace dyntape::dynamics {                                                                          \
  __VA_ARGS__ template VectorX<T> integrate(const Model<T>&, const VectorRef<T>&, const VectorRef<T>&);  \
  __VA_ARGS__ template VectorX<T> difference(const Model<T>&, const VectorRef<T>&, const VectorRef<T>&); \
  __VA_ARGS__ template TangentJacobians<T> integrate_jacobians(const Model<T>&, const VectorRef<T>&);    \
  __VA_ARGS__ template TangentJacobians<T> difference_jacobians(const Model<T>&, const VectorRef<T>&);   \
  __VA_ARGS__ template VectorX<T> neutral(const Model<T>&);                                              \
  __VA_ARGS__ template VectorX<T> random_configuration(const Model<T>&, std::mt19937_64&);               \
  }

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_CONFIGURATION)
