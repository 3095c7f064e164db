// SPDX-License-Identifier: BSD-3-Clause
//
// Rigid contacts and closed loops: accelerations, constraint forces, impulses, and the derivatives of all.  Use it
// for bilateral constraints; rigid_contacts.h has unilateral ones.
//
//   ConstraintData<double> feet(model, {point_constraint(model, left, p_left), frame_constraint(model, right, X)});
//   const VectorX<double>& a = constrained_dynamics(model, data, feet, q, v, tau);       // feet.lambda: forces
//   constrained_dynamics_derivatives(model, data, feet, q, v, tau);                      // feet.ddq_dq, ...
//   const VectorX<double>& after = impulse_dynamics(model, data, feet, q, v, 0.0);       // feet.impulse
//
// A constraint holds frame 1 on one body at frame 2 on another body or the world.  It constrains the origin (3
// rows), or origin and orientation (6 rows, linear first).  All quantities are the motion of frame 1 relative to
// frame 2, in the axes of frame 1.  With X_21 = (R, p), the placement of frame 1 in frame 2:
//   error         e = (R^T p, log R)                                                        (m, rad)
//   velocity      J v = (R^T dp/dt, w),  w the angular velocity of 1 relative to 2          (m/s, rad/s)
//   acceleration  J a + gamma = (R^T d2p/dt2, dw/dt)                                        (m/s^2, rad/s^2)
// The constraint is  J a + gamma + kd J v + kp e = 0  (Baumgarte), so that p'' + kd p' + kp p = 0, seen from frame
// 2.  The default is critically damped: kp = 100 /s^2, kd = 20 /s, and an error decays as (1 + 10 t) exp(-10 t).
// With zero gains the error has no influence.  Joints that carry both frames have no column in J.
//
// The force lambda (N, N m) acts on body 1 at frame 1, in the axes of frame 1.  Body 2 has the opposite wrench:
//   M(q) a + h(q, v) = tau + J^T lambda          M (v+ - v) = J^T impulse,  J v+ = -restitution J v
//
// Dependent rows (four coplanar feet, a constraint given twice) are detected while J M^-1 J^T is factorised, without
// branches on recorded values.  A row is dependent if less than 2^-40 of its inertia remains, i.e. the sine of its
// angle to the other rows is below 1e-6.  The acceleration is unique; lambda is the solution of least norm.
// Contradictory rows are solved in the least-squares sense; ConstraintData::residual is the remaining error.
//
// Frames.  J, gamma and all results have the same bits wherever the base is.  Only e of a constraint against the
// world depends on a position in the world; with kp = 0 it is not read.
//
// Sources: docs/math.md (L.1) to (L.15); R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 8 and 11;
// J. Baumgarte, Computer Methods in Applied Mechanics and Engineering 1, 1972.
#pragma once

#include <dyntape/dynamics/algebra/semidefinite.h>
#include <dyntape/dynamics/effects/effects.h>

#include <string>
#include <vector>

namespace dyntape::dynamics {

template <class T>
struct Constraint {
  int rows = 3;              // 3: the origins coincide; 6: the frames coincide
  int body_1 = -1;           // joint index of the body; -1: the world
  Placement<T> X_1;          // frame 1 in body 1
  int body_2 = -1;           // the other body, likewise
  Placement<T> X_2;          // frame 2 in body 2
  double kp = 100, kd = 20;  // stabilisation (1/s^2, 1/s); both >= 0

  template <class S>
  Constraint<S> cast() const {
    return {rows, body_1, X_1.template cast<S>(), body_2, X_2.template cast<S>(), kp, kd};
  }
};

// Holds the origin of frame `frame` (index into model.frames) at a point of the world (m).
template <class T>
Constraint<T> point_constraint(const Model<T>& model, int frame,
                               const std::type_identity_t<Vector3<T>>& point);
// Holds frame `frame` at a placement in the world.
template <class T>
Constraint<T> frame_constraint(const Model<T>& model, int frame,
                               const std::type_identity_t<Placement<T>>& placement);
// Holds frame `frame_1` at `frame_2` of another body.  rows = 3: a ball joint; 6: a weld.
template <class T>
Constraint<T> loop_constraint(const Model<T>& model, int frame_1, int frame_2, int rows);

// The joints on the path from frame 2 to frame 1.
struct ConstraintChain {
  struct Link {
    int joint;
    bool backward;     // traversed from the body to its parent
    int first, count;  // columns of the chain
  };
  std::vector<Link> links;
  std::vector<int> dofs;  // index in v of each column
  int backward = 0;       // number of backward links; they come first
  int first_row = 0, rows = 0;
};

namespace detail {

// Throws ArgumentError unless the constraint fits a model of n joints.
void check_constraint(int rows, int body_1, int body_2, int njoints, const std::string& model);

}  // namespace detail

// Results and working memory for a list of constraints on a model; m rows in total.  Placements and gains may change
// between calls; bodies and rows may not.  ArgumentError if a body does not exist, both frames are on one body, or
// rows is neither 3 nor 6.
template <class T>
struct ConstraintData {
  ConstraintData(const Model<T>& model, std::vector<Constraint<T>> list);

  TreeShape shape;
  std::vector<Constraint<T>> constraints;
  // Set true if J has full row rank.  The search for dependent rows is then skipped, which shortens recordings.
  bool independent = false;

  // Results.
  MatrixX<T> J;                                  // (m x nv)
  VectorX<T> error, velocity, bias;              // (m) e; J v; gamma
  VectorX<T> ddq, lambda;                        // (nv), (m)
  VectorX<T> residual;                           // (m) J ddq + gamma + kd J v + kp e: zero up to rounding
  VectorX<T> v_plus, impulse;                    // (nv), (m)
  MatrixX<T> ddq_dq, ddq_dv, ddq_dtau;           // (nv x nv); ddq_dtau symmetric
  MatrixX<T> lambda_dq, lambda_dv, lambda_dtau;  // (m x nv)
  MatrixX<T> v_plus_dq, v_plus_dv;               // (nv x nv)
  MatrixX<T> impulse_dq, impulse_dv;             // (m x nv)

  // Working memory.
  std::vector<ConstraintChain> chains;
  std::vector<std::vector<Motion<T>>> columns;  // of each chain, in the axes of frame 1
  Semidefinite<T> delassus;                     // J M^-1 J^T
  MatrixX<T> K, Z;                              // (nv x m) M^-1 J^T; K times the inverse of J M^-1 J^T
  MatrixX<T> G_inverse;                         // (m x m)
  MatrixX<T> P;                                 // (nv x nv) derivatives of the torque at fixed ddq and lambda
  MatrixX<T> A_dq, A_dv;                        // (m x nv) derivatives of J a + gamma + kd J v + kp e
  VectorX<T> step, rhs, along;                  // (nv), (m), (nv)
};

// Computes e, J v, gamma and J at a state: c.error, c.velocity, c.bias, c.J.
template <class T>
void constraint_kinematics(const Model<T>& model, Data<T>& data, ConstraintData<T>& c, const VectorRef<T>& q,
                           const VectorRef<T>& v);

// Returns c.ddq; also writes c.lambda, c.residual and the results of constraint_kinematics.  Overwrites data.Minv
// and data.nle.
template <class T>
const VectorX<T>& constrained_dynamics(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                       const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& tau,
                                       const DynamicsTerms<T>& acting = {});

// Also computes c.ddq_dq, ddq_dv, ddq_dtau, lambda_dq, lambda_dv, lambda_dtau by implicit differentiation.  The
// derivatives include the turning of lambda with frame 1 and the change of its lever arms.
//   dependent rows   (also contradictory ones) ddq_* are exact; lambda_* are exact up to forces that no joint feels
//   rank changes     (a flat parallelogram) no derivative exists
// Overwrites data.dtau_dq, data.dtau_dv and data.M.
template <class T>
void constrained_dynamics_derivatives(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                      const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& tau,
                                      const DynamicsTerms<T>& acting = {});

// The same with effects (effects.h).  tau is the commanded torque; torques.driven is the torque at the joints.  An
// impact depends on the armature only: pass effects.acting().
template <class T>
const VectorX<T>& constrained_dynamics(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                       EffectTorques<T>& torques, const Effects<T>& effects,
                                       const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& tau);
template <class T>
void constrained_dynamics_derivatives(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                      EffectTorques<T>& torques, const Effects<T>& effects,
                                      const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& tau);

// Computes the velocities after an impact with coefficient `restitution` (0: the constraint sticks; 1: elastic).
// Returns c.v_plus; also writes c.impulse (N s, N m s).
template <class T>
const VectorX<T>& impulse_dynamics(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                   const VectorRef<T>& q, const VectorRef<T>& v,
                                   const std::type_identity_t<T>& restitution,
                                   const DynamicsTerms<T>& acting = {});

// Also computes c.v_plus_dq, v_plus_dv, impulse_dq, impulse_dv; v is the velocity before.  Overwrites c.ddq_dtau.
template <class T>
void impulse_dynamics_derivatives(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                  const VectorRef<T>& q, const VectorRef<T>& v,
                                  const std::type_identity_t<T>& restitution,
                                  const DynamicsTerms<T>& acting = {});

}  // namespace dyntape::dynamics
