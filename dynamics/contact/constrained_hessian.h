// SPDX-License-Identifier: BSD-3-Clause
//
// Second derivatives of constrained dynamics, contracted with multipliers.
//
//   ConstraintData<double> feet(model, {point_constraint(model, left, p_left), frame_constraint(model, right, X)});
//   ConstrainedHessian<double> second(model, feet);        // results and working memory, allocated once
//   const MatrixX<double>& H = constrained_hessian(model, data, feet, second, q, v, tau, mu, nu);
//
// H is the Hessian of  mu^T ddq(q, v, tau) + nu^T lambda(q, v, tau)  over (q, v, tau): (3nv x 3nv), both triangles, mu
// (nv), nu (m, the rows of all constraints; empty: zero).  Derivatives by q are those of ddq(q (+) w) at w = 0, as in
// second_order.h; entries by tau twice and by v and tau are zero.
//
// Method.  One solve with the transposed equations of motion replaces the tensors: with w_a, w_lambda the solutions
// for mu, nu,
//   L = w_a . (M a + h - J^T lambda - tau) + w_lambda . (J a + gamma + kd J v + kp e)
// is linear in (a, lambda).  So the Hessian is that of L at fixed a and lambda, plus products of its mixed part with
// the first derivatives (constraints.h), which are computed too.  id_hessian() is the part of inverse dynamics; a
// chain of k columns takes one dot product of 18 entries per pair.
//
// For an impact,
//   const MatrixX<double>& H = impulse_hessian(model, data, feet, second, q, v, 0.0, mu, nu);
// is the Hessian of  mu^T v_plus(q, v) + nu^T impulse(q, v)  over (q, v), which has no entries for (v, v).
//
// Dependent rows are treated as in the first derivatives.  If the rank is constant around q, the part of mu is
// exact, also for contradictory rows.  The part of nu needs unique forces, i.e. full row rank.  If the rank changes,
// there are no derivatives.
//
// Errors.  ArgumentError: wrong sizes, a workspace of another robot or of other constraints, and cases that
// id_hessian() does not support (disabled velocity products, added inertias).  Source: docs/math.md (L.16) to
// (L.24).
#pragma once

#include <dyntape/dynamics/algorithms/hessian.h>
#include <dyntape/dynamics/contact/constraints.h>

#include <vector>

namespace dyntape::dynamics {

// A column c of a chain, in frame 1: its factors for columns farther from frame 2, and for nearer ones.
template <class T>
struct ConstrainedColumn {
  Motion<T> V_q, A_q, A_v;  // derivatives of V by q, of A + kp e by q, of A by v
  Motion<T> W_q, U_q;       // derivatives of J w_a and J u by q
  Force<T> on_A, on_V;      // c x* w_lambda; the factor of V_q
  Force<T> on_W, on_U;      // c x* lambda, c x* residual
  Vector3<T> on_e, on_w;    // factors of the angular parts of c (by kp) and of V_q and c (by v)
};

template <class T>
struct ConstrainedHessian {
  ConstrainedHessian(const Model<T>& model, const ConstraintData<T>& c);

  MatrixX<T> H;          // (3nv x 3nv)
  MatrixX<T> H_impulse;  // (2nv x 2nv)

  // Working memory.
  std::vector<ConstrainedColumn<T>> columns;  // of the current chain
  Hessian<T> id;                              // at ddq, contracted with w_a
  VectorX<T> w_a, w_lambda, u;                // (nv), (m), (nv): J u = w_lambda
  MatrixX<T> B, E;                            // (nv x nv) L_qa; products with it
  MatrixX<T> D_w, D_u;                        // (m x nv) derivatives of J w_a and J u by q
  MatrixX<T> residual_q, residual_v;          // (m x nv) derivatives of the residual of contradictory rows
};

// Returns second.H.  Calls constrained_dynamics_derivatives; its results are in c.
template <class T>
const MatrixX<T>& constrained_hessian(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                      ConstrainedHessian<T>& second, const VectorRef<T>& q,
                                      const VectorRef<T>& v, const VectorRef<T>& tau, const VectorRef<T>& mu,
                                      const VectorRef<T>& nu, const DynamicsTerms<T>& acting = {});

// Returns second.H_impulse.  Calls impulse_dynamics_derivatives; its results are in c.
template <class T>
const MatrixX<T>& impulse_hessian(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                  ConstrainedHessian<T>& second, const VectorRef<T>& q, const VectorRef<T>& v,
                                  const std::type_identity_t<T>& restitution, const VectorRef<T>& mu,
                                  const VectorRef<T>& nu, const DynamicsTerms<T>& acting = {});

}  // namespace dyntape::dynamics
