// SPDX-License-Identifier: BSD-3-Clause
//
// A robot's dynamics as functions from numbers to numbers: by name, in any scalar, recorded.
//
//   Model<double> arm = load_urdf("arm.urdf");
//   Function f = record_robot_function(arm, RobotFunction("id-derivatives"));
//   std::vector<double> y = evaluate(f, state);          // state: (q, v, a), y: dtau_dq | dtau_dv | dtau_da
//
// Which functions there are is in robot_function.h.  A state is q (nq), then v, then a or tau, then mu (nv each), as far
// as the function takes them; units as in dynamics/model/model.h.  A result is one block after the other, matrices row
// by row, tensors page (i, j, k) with k running first.  Derivatives with respect to q are tangent: a column for each
// increment q (+) d in the moving frame of the joint (free-flyer: linear, then angular).
//
// A derivative can be had in ways that know nothing of each other:
//   analytic        the derivative recursion of dynamics/ is recorded
//   factored        of forward dynamics: the factors of M in the place of articulated inertias
//   differentiated  the value of q (+) d is recorded with d and q as inputs, its Jacobian derived graph to
//                   graph at d = 0, where the exponential map folds away
//   shortest        whichever takes the fewest operations, counted; large robots are not differentiated, which
//                   would always take more
#pragma once

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/interface/robot/robot_function.h>

namespace dyntape {

enum class RobotSource { kAnalytic, kDifferentiated, kShortest };  // factored: as a candidate of kShortest

// The plain double code: the reference that the others are held against.
Eigen::VectorXd evaluate_analytic(const dynamics::Model<double>& model, const RobotFunction& function,
                                  const Eigen::Ref<const Eigen::VectorXd>& state);

// Variables: the state.  `source` matters for derivatives only.  NumericalError for a function that solves for
// accelerations of a robot without inertia about a joint: its text would hold infinities.
Function record_robot_function(const dynamics::Model<double>& model, const RobotFunction& function,
                               RobotSource source = RobotSource::kShortest);

// Dynamics with effects (dynamics/effects/effects.h), for optimal control: (q, v, tau) -> ddq and (q, v, a) -> tau.
// What is not chosen leaves no node.
Function record_forward_dynamics(const dynamics::Model<double>& model,
                                 const dynamics::Effects<double>& effects);
Function record_inverse_dynamics(const dynamics::Model<double>& model,
                                 const dynamics::Effects<double>& effects);

}  // namespace dyntape
