// SPDX-License-Identifier: BSD-3-Clause
//
// A robot's dynamics for recordings of one's own, with derivatives that are the analytic ones.
//
//   const auto id = inverse_dynamics_callee(arm);               // (q, v, a) -> tau
//   Function f = record("effort", 3 * n, [&](const VectorXad& x) { return call(id, x).cwiseAbs2().eval(); });
//   derive(f, Order::kSecond)
//
// Recording dynamics::rnea() gives the same values; but then the derivatives are those of the recorded value, and
// take two to four times as many operations (first and second order of a 7-joint arm: 24 300 against 7 400).
// What is printed is one straight line: value, Jacobian and Hessian share what they have in common.
//
// Joints of one coordinate only (revolute, prismatic, helical) but where it says else: ArgumentError for others, where a
// derivative by q is tangent and the chain rule needs more than the callee has.  Make one callee and use it for every call.
#pragma once

#include <memory>
#include <vector>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape {

// (q, v, a) -> tau, dynamics::rnea; gravity and armature are those of the model.
std::shared_ptr<const Callee> inverse_dynamics_callee(const dynamics::Model<double>& model);
// (q, v, tau) -> ddq, dynamics::aba.
std::shared_ptr<const Callee> forward_dynamics_callee(const dynamics::Model<double>& model);
// (q, v, tau) -> (ddq, lambda), dynamics::constrained_dynamics: closed loops, rigid contacts; second derivatives are
// those of constrained_hessian.h.  Spherical joints and free-flyers are allowed here: q is (nq), second derivatives are then
// those of the recorded value.
//   independent   the caller's word that rows are; without it the callee gives ddq alone, as forces of dependent rows are
//                 not unique
std::shared_ptr<const Callee> constrained_dynamics_callee(
    const dynamics::Model<double>& model, const std::vector<dynamics::Constraint<double>>& constraints,
    bool independent = false);
// (q, v) -> (v_plus, impulse), dynamics::impulse_dynamics, likewise.
std::shared_ptr<const Callee> impulse_dynamics_callee(
    const dynamics::Model<double>& model, const std::vector<dynamics::Constraint<double>>& constraints,
    double restitution, bool independent = false);

// Whether the joints allow them, and are so many (three) that they pay: with fewer the derivatives of the recorded
// value are as short.
bool is_worth_callees(const dynamics::Model<double>& model);

// A function of the table that is going to be derived: rnea and aba through their callee where it
// pays, anything else as record_robot_function() records it.
Function record_differentiable(const dynamics::Model<double>& model, const RobotFunction& function);

}  // namespace dyntape
