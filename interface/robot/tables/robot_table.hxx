// SPDX-License-Identifier: BSD-3-Clause
//
// The table of all robot functions.  To add a function, add a row (robot_rows.h explains rows); eval, generate,
// bench, recordings, packs and the tests follow.  Internal; included once per scalar, by robot_instantiate.h.
#pragma once

#include <dyntape/interface/robot/robot_rows.h>

namespace dyntape::detail {

namespace robot_table {

using namespace dynamics;
using enum Extent;

template <class T>
using Rows = std::vector<RobotRow<T>>;

template <class T, class W = RobotWorkspace<T>, class S = RobotState<T>, class Out = RobotWriter<T>>
Rows<T> dynamics_rows() {
  return {
      {.name = "rnea",
       .what = "inverse dynamics",
       .inputs = "q v a",
       .outputs = {{"tau", kNv}},
       .run = [](W& w, const S& s) { rnea<T>(w.model, w.data, s.q, s.v, s.w); },
       .write = [](const W& w, Out& y) { y(w.data.tau); }},
      {.name = "aba",
       .what = "forward dynamics",
       .inputs = "q v tau",
       .outputs = {{"ddq", kNvMoved}},
       .needs = kInertia,
       .run = [](W& w, const S& s) { aba<T>(w.model, w.data, s.q, s.v, s.w); },
       .write = [](const W& w, Out& y) { y(w.data.ddq); }},
      {.name = "crba",
       .what = "mass matrix",
       .inputs = "q",
       .outputs = {{"M", kNv, kNv}},
       .run = [](W& w, const S& s) { crba<T>(w.model, w.data, s.q); },
       .write = [](const W& w, Out& y) { y(w.data.M); }},
      {.name = "id-derivatives",
       .what = "derivatives of inverse dynamics",
       .inputs = "q v a",
       .outputs = {{"dtau_dq", kNv, kNv}, {"dtau_dv", kNv, kNv}, {"dtau_da", kNv, kNv}},
       .of = "rnea",
       .by = "q v a",
       .run = [](W& w, const S& s) { id_derivatives<T>(w.model, w.data, s.q, s.v, s.w); },
       .write = [](const W& w, Out& y) { y(w.data.dtau_dq), y(w.data.dtau_dv), y(w.data.M); }},
      {.name = "fd-derivatives",
       .what = "derivatives of forward dynamics",
       .inputs = "q v tau",
       .outputs = {{"ddq_dq", kNvMoved, kNv}, {"ddq_dv", kNvMoved, kNv}, {"ddq_dtau", kNvMoved, kNvMoved}},
       .of = "aba",
       .by = "q v tau",
       .needs = kInertia,
       .run = [](W& w, const S& s) { fd_derivatives<T>(w.model, w.data, s.q, s.v, s.w); },
       .write = [](const W& w, Out& y) { y(w.data.ddq_dq), y(w.data.ddq_dv), y(w.data.Minv); }},
      {.name = "minverse",
       .what = "inverse of the mass matrix",
       .inputs = "q",
       .outputs = {{"Minv", kNvMoved, kNvMoved}},
       .needs = kInertia,
       .run = [](W& w, const S& s) { minverse<T>(w.model, w.data, s.q); },
       .write = [](const W& w, Out& y) { y(w.data.Minv); }},
      {.name = "nonlinear-effects",
       .what = "torques at rest of the joints' accelerations",
       .inputs = "q v",
       .outputs = {{"nle", kNv}},
       .run = [](W& w, const S& s) { nonlinear_effects<T>(w.model, w.data, s.q, s.v); },
       .write = [](const W& w, Out& y) { y(w.data.nle); }},
      {.name = "gravity",
       .what = "torques against gravity",
       .inputs = "q",
       .outputs = {{"g", kNv}},
       .run = [](W& w, const S& s) { generalized_gravity<T>(w.model, w.data, s.q); },
       .write = [](const W& w, Out& y) { y(w.data.g); }}};
}

template <class T, class W = RobotWorkspace<T>, class S = RobotState<T>, class Out = RobotWriter<T>>
Rows<T> energy_rows() {
  return {
      {.name = "energy",
       .what = "kinetic and potential energy",
       .inputs = "q v",
       .outputs = {{"kinetic_energy"}, {"potential_energy"}},
       .run =
           [](W& w, const S& s) {
             kinetic_energy<T>(w.model, w.data, s.q, s.v);
             potential_energy<T>(w.model, w.data, s.q);
           },
       .write = [](const W& w, Out& y) { y(w.data.kinetic_energy), y(w.data.potential_energy); }},
      {.name = "energy-gradients",
       .what = "gradients of both energies",
       .inputs = "q v",
       .outputs = {{"dT_dq", kOne, kNv}, {"dT_dv", kOne, kNv}, {"dU_dq", kOne, kNv}, {"dU_dv", kOne, kNv}},
       .of = "energy",
       .by = "q v",
       .run =
           [](W& w, const S& s) {
             kinetic_energy_gradients<T>(w.model, w.data, w.energy(), s.q, s.v);
             generalized_gravity<T>(w.model, w.data, s.q);
           },
       .write = [](const W& w,
                   Out& y) { y(w.energy().dT_dq), y(w.energy().dT_dv), y(w.data.g), y(w.energy().zero); }},
      {.name = "gravity-derivatives",
       .what = "derivatives of the torques against gravity",
       .inputs = "q",
       .outputs = {{"dg_dq", kNv, kNv}},
       .of = "gravity",
       .by = "q",
       .run = [](W& w, const S& s) { gravity_derivatives<T>(w.model, w.data, w.energy(), s.q); },
       .write = [](const W& w, Out& y) { y(w.energy().dg_dq); }},
      {.name = "nonlinear-effects-derivatives",
       .what = "derivatives of the nonlinear effects",
       .inputs = "q v",
       .outputs = {{"dnle_dq", kNv, kNv}, {"dnle_dv", kNv, kNv}},
       .of = "nonlinear-effects",
       .by = "q v",
       .run = [](W& w,
                 const S& s) { nonlinear_effects_derivatives<T>(w.model, w.data, w.energy(), s.q, s.v); },
       .write = [](const W& w, Out& y) { y(w.data.dtau_dq), y(w.data.dtau_dv); }}};
}

template <class T, class W = RobotWorkspace<T>, class S = RobotState<T>, class Out = RobotWriter<T>>
Rows<T> second_order_rows() {
  return {
      {.name = "id-second-derivatives",
       .what = "second derivatives of inverse dynamics, symmetric",
       .inputs = "q v a",
       .outputs = {{"d2tau_dqdq", kNv, kNv, kNv},
                   {"d2tau_dqdv", kNv, kNv, kNv},
                   {"d2tau_dvdv", kNv, kNv, kNv},
                   {"d2tau_dadq", kNv, kNv, kNv}},
       .run = [](W& w, const S& s) { id_second_order<T>(w.model, w.data, w.second_order(), s.q, s.v, s.w); },
       .write =
           [](const W& w, Out& y) {
             const SecondOrder<T>& d = w.second_order();
             y(d.d2tau_dqdq), y(d.d2tau_dqdv), y(d.d2tau_dvdv), y(d.d2tau_dadq);
           }},
      {.name = "fd-second-derivatives",
       .what = "second derivatives of forward dynamics, symmetric",
       .inputs = "q v tau",
       .outputs = {{"d2ddq_dqdq", kNvMoved, kNv, kNv},
                   {"d2ddq_dqdv", kNvMoved, kNv, kNv},
                   {"d2ddq_dvdv", kNvMoved, kNv, kNv},
                   {"d2ddq_dtaudq", kNvMoved, kNvMoved, kNv}},
       .needs = kInertia,
       .run =
           [](W& w, const S& s) {
             fd_second_order<T>(w.model, w.data, w.forward_second_order(), s.q, s.v, s.w);
           },
       .write =
           [](const W& w, Out& y) {
             const ForwardSecondOrder<T>& d = w.forward_second_order();
             y(d.d2ddq_dqdq), y(d.d2ddq_dqdv), y(d.d2ddq_dvdv), y(d.d2ddq_dtaudq);
           }},
      {.name = "id-hessian",
       .what = "Hessian of mu^T tau over (q, v, a)",
       .inputs = "q v a mu",
       .outputs = {{"H", k3Nv, k3Nv}},
       .run = [](W& w, const S& s) { id_hessian<T>(w.model, w.data, w.hessian(), s.q, s.v, s.w, s.mu); },
       .write = [](const W& w, Out& y) { y(w.hessian().d2tau); }},
      {.name = "fd-hessian",
       .what = "Hessian of mu^T ddq over (q, v, tau)",
       .inputs = "q v tau mu",
       .outputs = {{"H", k3NvMoved, k3NvMoved}},
       .needs = kInertia,
       .run = [](W& w, const S& s) { fd_hessian<T>(w.model, w.data, w.hessian(), s.q, s.v, s.w, s.mu); },
       .write = [](const W& w, Out& y) { y(w.hessian().d2ddq); }}};
}

template <class T, class W = RobotWorkspace<T>, class S = RobotState<T>, class Out = RobotWriter<T>>
Rows<T> frame_rows() {
  return {{.name = "frame-placement",
           .what = "orientation and position of a frame in the world",
           .inputs = "q",
           .outputs = {{"R", k3, k3}, {"p", k3}},
           .needs = kFrame,
           .run = [](W& w, const S& s) { forward_kinematics<T>(w.model, w.data, s.q); },
           .write =
               [](const W& w, Out& y) {
                 const Placement<T> X = frame_placement(w.model, w.data, w.frame);
                 y(X.R), y(X.p);
               }},
          {.name = "frame-velocity",
           .what = "velocity of a frame",
           .inputs = "q v",
           .outputs = {{"V", k6}},
           .needs = kFrame,
           .run = [](W& w, const S& s) { forward_kinematics<T>(w.model, w.data, s.q, s.v); },
           .write = [](const W& w, Out& y) { y(frame_velocity(w.model, w.data, w.frame, w.in)); }},
          {.name = "frame-acceleration",
           .what = "spatial and classical acceleration of a frame",
           .inputs = "q v a",
           .outputs = {{"A", k6}, {"C", k6}},
           .needs = kFrame,
           .run = [](W& w, const S& s) { forward_kinematics<T>(w.model, w.data, s.q, s.v, s.w); },
           .write =
               [](const W& w, Out& y) {
                 y(frame_acceleration(w.model, w.data, w.frame, w.in));
                 y(frame_classical_acceleration(w.model, w.data, w.frame, w.in));
               }},
          {.name = "frame-jacobian",
           .what = "Jacobian of a frame",
           .inputs = "q",
           .outputs = {{"J", k6, kNv}},
           .needs = kFrame,
           .run = [](W& w, const S& s) { frame_jacobian<T>(w.model, w.data, s.q, w.frame, w.in); },
           .write = [](const W& w, Out& y) { y(w.data.J); }},
          {.name = "frame-jacobian-rate",
           .what = "rate of the Jacobian of a frame",
           .inputs = "q v",
           .outputs = {{"J_dot", k6, kNv}},
           .needs = kFrame,
           .run =
               [](W& w, const S& s) {
                 forward_kinematics<T>(w.model, w.data, s.q, s.v);
                 frame_jacobian_rate(w.model, w.data, w.kinematics(), w.frame, w.in);
               },
           .write = [](const W& w, Out& y) { y(w.kinematics().J_dot); }}};
}

template <class T, class W = RobotWorkspace<T>, class S = RobotState<T>, class Out = RobotWriter<T>>
Rows<T> frame_derivative_rows() {
  return {{.name = "frame-velocity-derivatives",
           .what = "derivatives of the velocity of a frame",
           .inputs = "q v",
           .outputs = {{"dV_dq", k6, kNv}, {"dV_dv", k6, kNv}},
           .of = "frame-velocity",
           .by = "q v",
           .needs = kFrame,
           .run =
               [](W& w, const S& s) {
                 forward_kinematics<T>(w.model, w.data, s.q, s.v);
                 frame_velocity_derivatives(w.model, w.data, w.kinematics(), w.frame, w.in);
               },
           .write = [](const W& w, Out& y) { y(w.kinematics().dV_dq), y(w.kinematics().J); }},
          {.name = "frame-acceleration-derivatives",
           .what = "derivatives of both accelerations of a frame",
           .inputs = "q v a",
           .outputs = {{"dA_dq", k6, kNv},
                       {"dA_dv", k6, kNv},
                       {"dA_da", k6, kNv},
                       {"dC_dq", k6, kNv},
                       {"dC_dv", k6, kNv},
                       {"dC_da", k6, kNv}},
           .of = "frame-acceleration",
           .by = "q v a",
           .needs = kFrame,
           .run =
               [](W& w, const S& s) {
                 forward_kinematics<T>(w.model, w.data, s.q, s.v, s.w);
                 frame_acceleration_derivatives(w.model, w.data, w.kinematics(), w.frame, w.in);
               },
           .write =
               [](const W& w, Out& y) {
                 const KinematicDerivatives<T>& d = w.kinematics();
                 y(d.dA_dq), y(d.dA_dv), y(d.J), y(d.dC_dq), y(d.dC_dv), y(d.J);
               }},
          {.name = "frame-hessian",
           .what = "derivative of the Jacobian of a frame",
           .inputs = "q",
           .outputs = {{"H", k6, kNv, kNv}},
           .of = "frame-jacobian",
           .by = "q",
           .needs = kFrame,
           .run =
               [](W& w, const S& s) {
                 forward_kinematics<T>(w.model, w.data, s.q);
                 frame_hessian(w.model, w.data, w.kinematic_hessian(), w.frame, w.in);
               },
           .write =
               [](const W& w, Out& y) {
                 const int n = w.model.nv;
                 for (int i = 0; i < 6; ++i) {
                   for (int j = 0; j < n * n; ++j) y(w.kinematic_hessian().H(i, n * (j % n) + j / n));
                 }
               }},
          // Of all six directions; the damping acts only where the frame can hardly move in one of them.
          {.name = "operational-space",
           .what = "mobility, inertia, bias wrench of a frame, and the consistent inverse of its Jacobian",
           .inputs = "q v",
           .outputs = {{"Lambda_inverse", k6, k6}, {"Lambda", k6, k6}, {"mu", k6}, {"J_bar", kNvMoved, k6}},
           .needs = kInertia | kFrame,
           .run =
               [](W& w, const S& s) {
                 const OperationalOptions options{.damping = 1e-3};
                 operational_space<T>(w.model, w.data, w.operational_space(), s.q, s.v, w.frame, w.in,
                                      options);
                 operational_bias<T>(w.model, w.data, w.operational_space(), s.q, s.v);
               },
           .write =
               [](const W& w, Out& y) {
                 const OperationalSpace<T>& o = w.operational_space();
                 y(o.Lambda_inverse), y(o.Lambda), y(o.mu), y(o.J_bar);
               }}};
}

template <class T, class W = RobotWorkspace<T>, class S = RobotState<T>, class Out = RobotWriter<T>>
Rows<T> whole_robot_rows() {
  return {
      {.name = "com",
       .what = "centre of mass in the world",
       .inputs = "q",
       .outputs = {{"com", k3}},
       .run = [](W& w, const S& s) { center_of_mass<T>(w.model, w.data, w.centroidal(), s.q); },
       .write = [](const W& w, Out& y) { y(w.centroidal().com); }},
      {.name = "com-jacobian",
       .what = "Jacobian of the centre of mass",
       .inputs = "q",
       .outputs = {{"J", k3, kNv}},
       .of = "com",
       .by = "q",
       .run = [](W& w, const S& s) { com_jacobian<T>(w.model, w.data, w.centroidal(), s.q); },
       .write = [](const W& w, Out& y) { y(w.centroidal().J); }},
      {.name = "centroidal-momentum",
       .what = "momentum about the centre of mass",
       .inputs = "q v",
       .outputs = {{"h", k6}},
       .run = [](W& w, const S& s) { centroidal_momentum<T>(w.model, w.data, w.centroidal(), s.q, s.v); },
       .write = [](const W& w, Out& y) { y(w.centroidal().h); }},
      {.name = "centroidal-momentum-rate",
       .what = "rate of the momentum about the centre of mass",
       .inputs = "q v a",
       .outputs = {{"h_dot", k6}},
       .run = [](W& w,
                 const S& s) { centroidal_momentum_rate<T>(w.model, w.data, w.centroidal(), s.q, s.v, s.w); },
       .write = [](const W& w, Out& y) { y(w.centroidal().h_dot); }},
      {.name = "centroidal-matrix",
       .what = "centroidal momentum matrix",
       .inputs = "q",
       .outputs = {{"A", k6, kNv}},
       .run = [](W& w, const S& s) { centroidal_matrix<T>(w.model, w.data, w.centroidal(), s.q); },
       .write = [](const W& w, Out& y) { y(w.centroidal().A); }},
      {.name = "centroidal-matrix-rate",
       .what = "rate of the centroidal momentum matrix",
       .inputs = "q v",
       .outputs = {{"A_dot", k6, kNv}},
       .run = [](W& w, const S& s) { centroidal_matrix_rate<T>(w.model, w.data, w.centroidal(), s.q, s.v); },
       .write = [](const W& w, Out& y) { y(w.centroidal().A_dot); }},
      {.name = "centroidal-derivatives",
       .what = "derivatives of the rate of the momentum about the centre of mass",
       .inputs = "q v a",
       .outputs = {{"dh_dot_dq", k6, kNv}, {"dh_dot_dv", k6, kNv}, {"dh_dot_da", k6, kNv}},
       .of = "centroidal-momentum-rate",
       .by = "q v a",
       .run = [](W& w,
                 const S& s) { centroidal_derivatives<T>(w.model, w.data, w.centroidal(), s.q, s.v, s.w); },
       .write =
           [](const W& w, Out& y) {
             const Centroidal<T>& c = w.centroidal();
             y(c.dh_dot_dq), y(c.dh_dot_dv), y(c.A);
           }}};
}

template <class T, class W = RobotWorkspace<T>, class S = RobotState<T>, class Out = RobotWriter<T>>
Rows<T> contact_rows() {
  return {
      {.name = "constrained-dynamics",
       .what = "forward dynamics with contacts, and their forces",
       .inputs = "q v tau",
       .outputs = {{"ddq", kNvMoved}, {"lambda", kContactRows}},
       .needs = kInertia | kContacts,
       .run = [](W& w,
                 const S& s) { constrained_dynamics<T>(w.model, w.data, w.constraints(), s.q, s.v, s.w); },
       .write = [](const W& w, Out& y) { y(w.constraints().ddq), y(w.constraints().lambda); }},
      {.name = "constrained-derivatives",
       .what = "derivatives of forward dynamics with contacts",
       .inputs = "q v tau",
       .outputs = {{"ddq_dq", kNvMoved, kNv},
                   {"ddq_dv", kNvMoved, kNv},
                   {"ddq_dtau", kNvMoved, kNvMoved},
                   {"lambda_dq", kContactRows, kNv},
                   {"lambda_dv", kContactRows, kNv},
                   {"lambda_dtau", kContactRows, kNvMoved}},
       .of = "constrained-dynamics",
       .by = "q v tau",
       .needs = kInertia | kContacts,
       .run =
           [](W& w, const S& s) {
             constrained_dynamics_derivatives<T>(w.model, w.data, w.constraints(), s.q, s.v, s.w);
           },
       .write =
           [](const W& w, Out& y) {
             const ConstraintData<T>& c = w.constraints();
             y(c.ddq_dq), y(c.ddq_dv), y(c.ddq_dtau), y(c.lambda_dq), y(c.lambda_dv), y(c.lambda_dtau);
           }},
      {.name = "constrained-hessian",
       .what = "Hessian of mu^T ddq with contacts over (q, v, tau)",
       .inputs = "q v tau mu",
       .outputs = {{"H", k3NvMoved, k3NvMoved}},
       .needs = kInertia | kContacts,
       .run =
           [](W& w, const S& s) {
             constrained_hessian<T>(w.model, w.data, w.constraints(), w.constrained_hessian(), s.q, s.v, s.w,
                                    s.mu, VectorX<T>());
           },
       .write = [](const W& w, Out& y) { y(w.constrained_hessian().H); }},
      {.name = "impulse-dynamics",
       .what = "velocities after an impact that sticks, and its impulses",
       .inputs = "q v",
       .outputs = {{"v_plus", kNvMoved}, {"impulse", kContactRows}},
       .needs = kInertia | kContacts,
       .run = [](W& w, const S& s) { impulse_dynamics<T>(w.model, w.data, w.constraints(), s.q, s.v, T(0)); },
       .write = [](const W& w, Out& y) { y(w.constraints().v_plus), y(w.constraints().impulse); }},
      {.name = "impulse-derivatives",
       .what = "derivatives of an impact that sticks",
       .inputs = "q v",
       .outputs = {{"v_plus_dq", kNvMoved, kNv},
                   {"v_plus_dv", kNvMoved, kNv},
                   {"impulse_dq", kContactRows, kNv},
                   {"impulse_dv", kContactRows, kNv}},
       .of = "impulse-dynamics",
       .by = "q v",
       .needs = kInertia | kContacts,
       .run =
           [](W& w, const S& s) {
             impulse_dynamics_derivatives<T>(w.model, w.data, w.constraints(), s.q, s.v, T(0));
           },
       .write =
           [](const W& w, Out& y) {
             const ConstraintData<T>& c = w.constraints();
             y(c.v_plus_dq), y(c.v_plus_dv), y(c.impulse_dq), y(c.impulse_dv);
           }}};
}

template <class T, class W = RobotWorkspace<T>, class S = RobotState<T>, class Out = RobotWriter<T>>
Rows<T> identification_rows() {
  return {
      {.name = "torque-regressor",
       .what = "torques as a linear function of the inertial parameters",
       .inputs = "q v a",
       .outputs = {{"Y", kNv, k10Bodies}},
       .run = [](W& w, const S& s) { torque_regressor<T>(w.model, w.data, w.regressor(), s.q, s.v, s.w); },
       .write = [](const W& w, Out& y) { y(w.regressor().Y); }},
      {.name = "energy-regressors",
       .what = "energies as linear functions of the inertial parameters",
       .inputs = "q v",
       .outputs = {{"kinetic", kOne, k10Bodies}, {"potential", kOne, k10Bodies}},
       .run =
           [](W& w, const S& s) {
             kinetic_energy_regressor<T>(w.model, w.data, w.regressor(), s.q, s.v);
             potential_energy_regressor<T>(w.model, w.data, w.regressor(), s.q);
           },
       .write = [](const W& w, Out& y) { y(w.regressor().kinetic), y(w.regressor().potential); }}};
}

}  // namespace robot_table

template <class T>
const std::vector<RobotRow<T>>& robot_rows() {
  using namespace robot_table;
  static const Rows<T> rows = [] {
    Rows<T> all;
    for (const Rows<T>& part :
         {dynamics_rows<T>(), energy_rows<T>(), second_order_rows<T>(), frame_rows<T>(),
          frame_derivative_rows<T>(), whole_robot_rows<T>(), contact_rows<T>(), identification_rows<T>()})
      all.insert(all.end(), part.begin(), part.end());
    return all;
  }();
  return rows;
}

}  // namespace dyntape::detail
