// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/contact/detail/constraints.hxx>

namespace dyntape::dynamics {
namespace detail {

// (L.11): derivatives of J a + gamma + kd J v + kp e at fixed v and a.
template <class T>
void differentiate_acceleration(ConstraintData<T>& c, std::size_t i, const VectorRef<T>& v,
                                const VectorRef<T>& a) {
  const ConstraintChain& chain = c.chains[i];
  const Constraint<T>& constraint = c.constraints[i];
  const std::vector<Motion<T>>& columns = c.columns[i];
  const T kp(constraint.kp), kd(constraint.kd);
  const Motion<T> V_1 = chain_motion<T>(chain, columns, v).first;
  const Vector3<T> e = c.error.template segment<3>(chain.first_row);
  Matrix3<T> E = Matrix3<T>::Identity();
  if (chain.rows == 6) {
    E = inverse_right_jacobian(Vector3<T>(c.error.template segment<3>(chain.first_row + 3)));
  }
  Motion<T> V, A;  // of the body that the chain has reached
  for (const auto& link : chain.links) {
    const Motion<T> m = link_motion(chain, columns, link, v);
    const Motion<T> V_next = V + m, A_next = A + link_motion(chain, columns, link, a) + cross(V, m);
    const Motion<T>& V_2 = link.backward ? V_next : V;  // of what does not move with the column
    const Motion<T>& A_2 = link.backward ? A_next : A;
    const Motion<T> rest = V_1 - V_2, both = V + V_next - V_1;
    for (int k = link.first; k < link.first + link.count; ++k) {
      const Motion<T>& s = columns[k];
      const Motion<T> dV = cross(V_2, s), dA = cross(A_2, s) + cross(dV, rest), dA_dv = cross(both, s);
      Vector3<T> q_linear = dA.linear + dV.angular.cross(V_1.linear) + V_1.angular.cross(dV.linear);
      Vector3<T> q_angular = dA.angular;
      Vector3<T> v_linear = dA_dv.linear + s.angular.cross(V_1.linear) + V_1.angular.cross(s.linear);
      Vector3<T> v_angular = dA_dv.angular;
      if (constraint.kd != 0) {
        q_linear += dV.linear * kd;
        q_angular += dV.angular * kd;
        v_linear += s.linear * kd;
        v_angular += s.angular * kd;
      }
      if (constraint.kp != 0) {
        q_linear += (s.linear + e.cross(s.angular)) * kp;
        q_angular += (E * s.angular) * kp;
      }
      set_rows<T>(c.A_dq.col(chain.dofs[k]), chain, q_linear, q_angular);
      set_rows<T>(c.A_dv.col(chain.dofs[k]), chain, v_linear, v_angular);
    }
    V = V_next;
    A = A_next;
  }
}

// (L.10): derivatives of J v at fixed v.
template <class T>
void differentiate_velocity(ConstraintData<T>& c, std::size_t i, const VectorRef<T>& v) {
  const ConstraintChain& chain = c.chains[i];
  Motion<T> V;
  for (const auto& link : chain.links) {
    const Motion<T> V_next = V + link_motion(chain, c.columns[i], link, v);
    for (int k = link.first; k < link.first + link.count; ++k) {
      const Motion<T> dV = cross(link.backward ? V_next : V, c.columns[i][k]);
      set_rows<T>(c.A_dq.col(chain.dofs[k]), chain, dV.linear, dV.angular);
    }
    V = V_next;
  }
}

// (L.12): P -= d(J^T f)/dq, f constant in the axes of frame 1.  A joint turns, in these axes, the columns of
// the joints between it and frame 2.
template <class T>
void subtract_turning_forces(const ConstraintData<T>& c, const VectorX<T>& f, MatrixX<T>& P) {
  for (std::size_t i = 0; i < c.chains.size(); ++i) {
    const ConstraintChain& chain = c.chains[i];
    Force<T> on_1;
    on_1.linear = f.template segment<3>(chain.first_row);
    if (chain.rows == 6) on_1.angular = f.template segment<3>(chain.first_row + 3);
    for (const auto& link : chain.links) {
      const int turned = link.backward ? link.first + link.count : link.first;
      for (int r = link.first; r < link.first + link.count; ++r) {
        const Force<T> turning = cross(c.columns[i][r], on_1);
        for (int k = 0; k < turned; ++k) {
          P(chain.dofs[k], chain.dofs[r]) -= dot(c.columns[i][k], turning);
        }
      }
    }
  }
}

// (L.13): the inverse of the matrix of the constrained motion, in blocks: Y (to `response`), Z, (J M^-1 J^T)^+.
template <class T>
void invert_constrained_motion(const Data<T>& data, ConstraintData<T>& c, MatrixX<T>& response) {
  c.G_inverse.setIdentity();
  for (long r = 0; r < c.G_inverse.cols(); ++r) c.delassus.solve(c.G_inverse.col(r));
  c.Z.noalias() = c.K * c.G_inverse;
  response = data.Minv;
  for (long k = 0; k < response.cols(); ++k) {
    for (long r = 0; r < c.Z.cols(); ++r) {
      response.col(k).tail(response.rows() - k) -= c.Z.col(r).tail(response.rows() - k) * c.K(k, r);
    }
    for (long j = 0; j < k; ++j) response(j, k) = response(k, j);
  }
}

// (L.15): where rows contradict each other, their residual pushes no joint, J^T r = 0, also when joints move.
template <class T>
void turn_residual(ConstraintData<T>& c) {
  if (c.independent) return;      // nothing is left
  MatrixX<T>& turned = c.ddq_dq;  // until it is computed
  turned.setZero();
  subtract_turning_forces(c, c.residual, turned);
  c.A_dq.noalias() -= c.Z.transpose() * turned;
}

// dx = -(Y P + Z A), df = Z^T P - (J M^-1 J^T)^+ A.
template <class T>
void respond_to(const ConstraintData<T>& c, const MatrixX<T>& Y, const MatrixX<T>& P, const MatrixX<T>& A,
                MatrixX<T>& dx, MatrixX<T>& df) {
  dx.noalias() = Y * P;
  dx.noalias() += c.Z * A;
  dx = -dx;
  df.noalias() = c.Z.transpose() * P;
  df.noalias() -= c.G_inverse * A;
}

// After constrained_dynamics; `subtract` takes from data.dtau_dq and dtau_dv what others than `acting` add.
template <class T, class Subtract>
void differentiate_constrained(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                               const VectorRef<T>& q, const VectorRef<T>& v, const DynamicsTerms<T>& acting,
                               Subtract subtract) {
  c.A_dq.setZero();  // turn_residual() reaches rows of joints that no chain writes
  for (std::size_t i = 0; i < c.chains.size(); ++i) differentiate_acceleration<T>(c, i, v, c.ddq);
  id_derivatives<T>(model, data, q, v, c.ddq, acting);
  subtract();
  c.P = data.dtau_dq;
  subtract_turning_forces(c, c.lambda, c.P);
  invert_constrained_motion(data, c, c.ddq_dtau);
  c.lambda_dtau = -c.Z.transpose();
  turn_residual(c);
  respond_to(c, c.ddq_dtau, c.P, c.A_dq, c.ddq_dq, c.lambda_dq);
  respond_to(c, c.ddq_dtau, data.dtau_dv, c.A_dv, c.ddq_dv, c.lambda_dv);
}

}  // namespace detail

template <class T>
void constrained_dynamics_derivatives(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                      const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& tau,
                                      const DynamicsTerms<T>& acting) {
  constrained_dynamics(model, data, c, q, v, tau, acting);
  detail::differentiate_constrained(model, data, c, q, v, acting, [] {});
}

template <class T>
void constrained_dynamics_derivatives(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                      EffectTorques<T>& torques, const Effects<T>& effects,
                                      const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& tau) {
  constrained_dynamics(model, data, c, torques, effects, q, v, tau);
  detail::differentiate_constrained(model, data, c, q, v, effects.acting(), [&] {
    if (detail::adds_torques(effects)) detail::subtract_slopes(model, data, torques, effects, q, v);
  });
}

template <class T>
void impulse_dynamics_derivatives(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                  const VectorRef<T>& q, const VectorRef<T>& v,
                                  const std::type_identity_t<T>& restitution,
                                  const DynamicsTerms<T>& acting) {
  impulse_dynamics(model, data, c, q, v, restitution, acting);
  c.along = c.v_plus + v * restitution;
  c.A_dq.setZero();
  for (std::size_t i = 0; i < c.chains.size(); ++i) detail::differentiate_velocity<T>(c, i, c.along);
  DynamicsTerms<T> still = acting;
  still.gravity = false;
  still.external = nullptr;
  c.along = c.v_plus - v;
  c.step.setZero();
  id_derivatives<T>(model, data, q, c.step, c.along, still);
  c.P = data.dtau_dq;
  detail::subtract_turning_forces(c, c.impulse, c.P);
  detail::invert_constrained_motion(data, c, c.ddq_dtau);
  detail::respond_to(c, c.ddq_dtau, c.P, c.A_dq, c.v_plus_dq, c.impulse_dq);
  const T bounce = T(1) + restitution;
  c.impulse_dv.noalias() = c.G_inverse * c.J;
  c.impulse_dv *= -bounce;
  c.v_plus_dv.noalias() = c.K * c.impulse_dv;
  for (int k = 0; k < model.nv; ++k) c.v_plus_dv(k, k) += T(1);
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_CONSTRAINT_DERIVATIVES(T, ...)                                                  \
  DYNTAPE_COMPILE(impulse_dynamics_derivatives, T, __VA_ARGS__)                                             \
  namespace dyntape::dynamics {                                                                             \
  __VA_ARGS__ template void constrained_dynamics_derivatives(const Model<T>&, Data<T>&, ConstraintData<T>&, \
                                                             const VectorRef<T>&, const VectorRef<T>&,      \
                                                             const VectorRef<T>&, const DynamicsTerms<T>&); \
  __VA_ARGS__ template void constrained_dynamics_derivatives(const Model<T>&, Data<T>&, ConstraintData<T>&, \
                                                             EffectTorques<T>&, const Effects<T>&,          \
                                                             const VectorRef<T>&, const VectorRef<T>&,      \
                                                             const VectorRef<T>&);                          \
  }

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_CONSTRAINT_DERIVATIVES)
