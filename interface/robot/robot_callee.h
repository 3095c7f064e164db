// SPDX-License-Identifier: BSD-3-Clause
//
// A robot's dynamics as callees, for use in other recordings, with analytic derivatives.  Use them if a recording
// with dynamics is differentiated.
//
//   const auto id = inverse_dynamics_callee(arm);               // (q, v, a) -> tau
//   Function f = record("effort", 3 * n, [&](const VectorXad& x) { return call(id, x).cwiseAbs2().eval(); });
//   derive(f, Order::kSecond)
//
// dynamics::rnea() in a recording gives the same values, but derivatives of the recorded value take two to four
// times as many operations (first and second order of a 7-joint arm: 24 300 against 7 400).  The generated code is
// straight-line; value, Jacobian and Hessian share common subexpressions.
//
// Joints must have one coordinate (revolute, prismatic, helical), unless stated otherwise; else ArgumentError.  For
// other joints derivatives with respect to q are tangent, and a callee has no information for the chain rule.  Make
// one callee and use it for all calls.
#pragma once

#include <memory>
#include <vector>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape {

// (q, v, a) -> tau, as dynamics::rnea, with the model's gravity and armature.
std::shared_ptr<const Callee> inverse_dynamics_callee(const dynamics::Model<double>& model);
// (q, v, tau) -> ddq, as dynamics::aba.
std::shared_ptr<const Callee> forward_dynamics_callee(const dynamics::Model<double>& model);
// (q, v, tau) -> (ddq, lambda), as dynamics::constrained_dynamics: closed loops, rigid contacts.  Second derivatives
// are those of constrained_hessian.h.  Spherical joints and free-flyers are allowed: q is (nq), and second
// derivatives are then those of the recorded value.
//   independent   true: the caller guarantees independent rows.  false: the callee returns ddq only, since forces of
//                 dependent rows are not unique
std::shared_ptr<const Callee> constrained_dynamics_callee(
    const dynamics::Model<double>& model, const std::vector<dynamics::Constraint<double>>& constraints,
    bool independent = false);
// (q, v) -> (v_plus, impulse), as dynamics::impulse_dynamics; likewise.
std::shared_ptr<const Callee> impulse_dynamics_callee(
    const dynamics::Model<double>& model, const std::vector<dynamics::Constraint<double>>& constraints,
    double restitution, bool independent = false);

// Returns true if the joints allow callees and the model has at least three.  With fewer joints, derivatives of the
// recorded value are as short.
bool is_worth_callees(const dynamics::Model<double>& model);

// Records a robot function that will be differentiated: rnea and aba as callees if is_worth_callees(), others as
// record_robot_function().
Function record_differentiable(const dynamics::Model<double>& model, const RobotFunction& function);

}  // namespace dyntape
