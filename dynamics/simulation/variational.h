// SPDX-License-Identifier: BSD-3-Clause
//
// A step of a variational integrator (discrete principle of least action): momenta at both ends of q' = q (+) xi.
// Use it for long simulations of energy and momentum.
//
//   const auto derivatives = [&](const VectorX<T>& q, const VectorX<T>& v) { return LagrangianDerivatives<T>{...}; };
//   DiscreteMomenta<T> p = discrete_momenta(Q, derivatives, h, q, xi);
//   // xi solves p.before = dL/dv(q, v); then v' from dL/dv(q', v') = p.after
//
// With the discrete Lagrangian L_d(q, q') = h L(q (+) xi/2, xi/h), xi = q' (-) q, and forces F by the midpoint rule,
// the discrete Legendre transforms are the derivatives of L_d with respect to increments of q and q' in the moving
// frame:
//   p  = -D1 L_d = -(A^T f + K0^T s)          f = h (dL/dq + F) at the midpoint: an impulse
//   p' =  D2 L_d =   K1^T s                   s = dL/dv + J^T f / 2: the slope of L_d along xi
//   A, J: Jacobians of q (+) xi/2;            K0, K1: Jacobians of q' (-) q
// Properties: order 2.  If L has a symmetry that the space shares, e.g. a translation of the whole robot, its
// momentum is preserved to rounding for any h.  The energy stays within O(h^2) for exponentially long times.
//
// Sources: J. Marsden, M. West, Discrete mechanics and variational integrators, Acta Numerica 10 (2001), 1.3, 2.1 and
// 3.2; Z. Manchester, S. Kuindersma, Variational contact-implicit trajectory optimization, ISRR 2017.
#pragma once

#include <dyntape/dynamics/simulation/state_space.h>

namespace dyntape::dynamics {

template <class T>
struct LagrangianDerivatives {
  VectorX<T> q;  // by an increment of q in the moving frame, plus the forces that are not in L (N m or N)
  VectorX<T> v;  // by v: the momentum
};

template <class T>
struct DiscreteMomenta {
  VectorX<T> before, after;  // (nv)
};

template <StateSpace Q, class Slopes, class T = typename Q::Scalar>
DiscreteMomenta<T> discrete_momenta(const Q& space, const Slopes& derivatives,
                                    const std::type_identity_t<T>& h, const VectorX<T>& q,
                                    const VectorX<T>& xi) {
  const VectorX<T> half = xi * T(0.5);
  const LagrangianDerivatives<T> middle = derivatives(space.integrate(q, half), VectorX<T>(xi / h));
  const TangentJacobians<T> halfway = space.integrate_jacobians(half), ends = space.difference_jacobians(xi);
  const VectorX<T> impulse = middle.q * h;
  const VectorX<T> along = middle.v + halfway.second.transpose() * impulse * T(0.5);
  return {-(halfway.first.transpose() * impulse + ends.first.transpose() * along),
          ends.second.transpose() * along};
}

}  // namespace dyntape::dynamics
