// SPDX-License-Identifier: BSD-3-Clause
//
// Records a robot's dynamics, by the function's name, and evaluates them in plain double.
//
//   Model<double> arm = load_urdf("arm.urdf");
//   Function f = record_robot_function(arm, RobotFunction("id-derivatives"));
//   std::vector<double> y = evaluate(f, state);          // state: (q, v, a), y: dtau_dq | dtau_dv | dtau_da
//
// robot_function.h lists the functions.  A state is q (nq), then v, then a or tau, then mu (nv each), as far as the
// function needs them; units as in dynamics/model/model.h.  A result is a sequence of blocks: matrices row-major,
// tensors (i, j, k) with k fastest.  Derivatives with respect to q are tangent: one column per increment q (+) d in
// the joint's moving frame (free-flyer: linear, then angular).
//
// Independent ways to a derivative:
//   analytic        records the derivative recursion of dynamics/
//   factored        forward dynamics only: with the factors of M instead of articulated inertias
//   differentiated  records the value of q (+) d with inputs d and q, and differentiates the graph at d = 0, where the
//                   exponential map vanishes
//   shortest        the one with the fewest operations; large robots are not differentiated, which would always take
//                   more
#pragma once

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/interface/robot/robot_function.h>

namespace dyntape {

enum class RobotSource {
  kAnalytic,
  kDifferentiated,
  kShortest
};  // factored: only as a candidate of kShortest

// The plain double code, the reference for all routes.
Eigen::VectorXd evaluate_analytic(const dynamics::Model<double>& model, const RobotFunction& function,
                                  const Eigen::Ref<const Eigen::VectorXd>& state);

// Variables: the state.  `source` applies to derivatives only.  NumericalError for functions that solve for
// accelerations if a joint moves no inertia, since the text would contain infinities.
Function record_robot_function(const dynamics::Model<double>& model, const RobotFunction& function,
                               RobotSource source = RobotSource::kShortest);

// Dynamics with effects (dynamics/effects/effects.h), for optimal control: (q, v, tau) -> ddq and (q, v, a) -> tau.
// An effect that is not chosen adds no node.
Function record_forward_dynamics(const dynamics::Model<double>& model,
                                 const dynamics::Effects<double>& effects);
Function record_inverse_dynamics(const dynamics::Model<double>& model,
                                 const dynamics::Effects<double>& effects);

}  // namespace dyntape
