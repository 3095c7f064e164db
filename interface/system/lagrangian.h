// SPDX-License-Identifier: BSD-3-Clause
//
// The derivatives of a recorded Lagrangian for variational steps, made by the graph engine.
//
//   const Lagrangian L(system);
//   dynamics::LagrangianDerivatives<AD> s = L.derivatives(q, v, p);  // inside a recording: dL/dq, tangent, and dL/dv
//   VectorXad v1 = L.velocity(q1, momentum, p);                 // with dL/dv(q1, v1) = momentum
//
// Errors.  ArgumentError: no Lagrangian, a branch without select, a Lagrangian that is not quadratic in v (its
// second derivative by v, the mass matrix, must not depend on v).
#pragma once

#include <memory>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/graph/pattern.h>
#include <dyntape/dynamics/simulation/variational.h>
#include <dyntape/interface/system/system.h>

namespace dyntape {

class Lagrangian {
 public:
  explicit Lagrangian(const System& system);

  dynamics::LagrangianDerivatives<AD> derivatives(const VectorXad& q, const VectorXad& v,
                                                  const VectorXad& p) const;
  VectorXad velocity(const VectorXad& q, const VectorXad& momentum, const VectorXad& p) const;

 private:
  MatrixXad mass(const VectorXad& q, const VectorXad& p) const;

  Eigen::Index nv_;
  Pattern slope_places_, mass_places_;                 // columns: increments of q, then v
  std::shared_ptr<const Callee> slopes_of_, mass_of_;  // of (0, v, q, p)
};

}  // namespace dyntape
