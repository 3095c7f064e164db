// SPDX-License-Identifier: BSD-3-Clause
//
// Second derivatives of constrained dynamics, contracted with multipliers.
//
//   ConstraintData<double> feet(model, {point_constraint(model, left, p_left), frame_constraint(model, right, X)});
//   ConstrainedHessian<double> second(model, feet);        // results and working memory, allocated once
//   const MatrixX<double>& H = constrained_hessian(model, data, feet, second, q, v, tau, mu, nu);
//
// H is the Hessian of  mu^T ddq(q, v, tau) + nu^T lambda(q, v, tau)  over (q, v, tau): (3nv x 3nv), both triangles,
// mu (nv), nu (m, the rows of all constraints; empty: zero).  Derivatives by q are those of ddq(q (+) w) at w = 0, as in
// second_order.h; entries by tau twice and by v and tau are zero.
//
// One solution with the transposed equations of motion takes the place of the tensors: with w_a, w_lambda the answers to
// mu, nu,
//   L = w_a . (M a + h - J^T lambda - tau) + w_lambda . (J a + gamma + kd J v + kp e)
// is linear in (a, lambda) together, so that the Hessian is that of L at fixed a and lambda, and products of its mixed part
// with the first derivatives (constraints.h), which come with it.  The part of inverse dynamics is id_hessian();
// that of a chain of k columns takes one dot product of 18 entries for each two of them.
//
// Of an impact, likewise,
//   const MatrixX<double>& H = impulse_hessian(model, data, feet, second, q, v, 0.0, mu, nu);
// the Hessian of  mu^T v_plus(q, v) + nu^T impulse(q, v)  over (q, v), which has no entries by v twice.
//
// Dependent rows are treated as the first derivatives treat them.  Where the rank is constant around q the part of
// mu is exact, also where rows contradict each other.  The part of nu needs forces that are unique: full row rank.
// Where the rank changes there are no derivatives.
//
// Errors: ArgumentError for arguments of other sizes, for a workspace of another robot or of other constraints, and
// where id_hessian() has no answer (velocity products that do not act, added inertias).
// Equations: docs/math.md (L.16) to (L.24).
#pragma once

#include <dyntape/dynamics/algorithms/hessian.h>
#include <dyntape/dynamics/contact/constraints.h>

#include <vector>

namespace dyntape::dynamics {

// A column c of a chain, seen from frame 1: what meets columns farther from frame 2, and what nearer ones meet.
template <class T>
struct ConstrainedColumn {
  Motion<T> V_q, A_q, A_v;  // slopes of V by q, of A + kp e by q, of A by v
  Motion<T> W_q, U_q;       // slopes of J w_a and J u by q
  Force<T> on_A, on_V;      // c x* w_lambda; what V_q meets
  Force<T> on_W, on_U;      // c x* lambda, c x* residual
  Vector3<T> on_e, on_w;    // what the angular parts of c (by kp) and of V_q and c (by v) meet
};

template <class T>
struct ConstrainedHessian {
  ConstrainedHessian(const Model<T>& model, const ConstraintData<T>& c);

  MatrixX<T> H;          // (3nv x 3nv)
  MatrixX<T> H_impulse;  // (2nv x 2nv)

  // Working memory.
  std::vector<ConstrainedColumn<T>> columns;  // of the chain at hand
  Hessian<T> id;                              // at ddq, contracted with w_a
  VectorX<T> w_a, w_lambda, u;                // (nv), (m), (nv): J u = w_lambda
  MatrixX<T> B, E;                            // (nv x nv) L_qa; products with it
  MatrixX<T> D_w, D_u;                        // (m x nv) slopes of J w_a and J u by q
  MatrixX<T> residual_q, residual_v;          // (m x nv) slopes of what contradictory rows leave
};

// Returns second.H.  Calls constrained_dynamics_derivatives, whose results it leaves in c.
template <class T>
const MatrixX<T>& constrained_hessian(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                      ConstrainedHessian<T>& second, const VectorRef<T>& q,
                                      const VectorRef<T>& v, const VectorRef<T>& tau, const VectorRef<T>& mu,
                                      const VectorRef<T>& nu, const DynamicsTerms<T>& acting = {});

// Returns second.H_impulse.  Calls impulse_dynamics_derivatives, whose results it leaves in c.
template <class T>
const MatrixX<T>& impulse_hessian(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                  ConstrainedHessian<T>& second, const VectorRef<T>& q, const VectorRef<T>& v,
                                  const std::type_identity_t<T>& restitution, const VectorRef<T>& mu,
                                  const VectorRef<T>& nu, const DynamicsTerms<T>& acting = {});

}  // namespace dyntape::dynamics
