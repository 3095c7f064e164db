// SPDX-License-Identifier: BSD-3-Clause
//
// Records a function of a robot's dynamics, chosen by name, or evaluates it in plain double.
//
//   Model<double> arm = load_urdf("arm.urdf");
//   Function f = record_robot_function(arm, RobotFunction("id-derivatives"));
//   std::vector<double> y = evaluate(f, state);          // state: (q, v, a), y: dtau_dq | dtau_dv | dtau_da
//
// `dyntape eval --help` lists the functions.  The state is q (nq), v, a or tau, and the weights mu of a Hessian (nv
// each), as far as the function needs them; units: model.h.  A result is a sequence of blocks: matrices row-major,
// tensors (i, j, k) with k fastest.  Derivatives with respect to q are tangent: one column per increment q (+) d in
// the joint's moving frame (free-flyer: linear, then angular).
//
// Independent ways to a derivative:
//   analytic        records the derivative recursion of dynamics/
//   factored        forward dynamics only: uses the factors of M instead of articulated inertias
//   differentiated  records the function at q (+) d with inputs d and q, and differentiates the graph at d = 0, where
//                   the exponential map is the identity and adds no operations
//   shortest        the way with the fewest operations; skips `differentiated` for large robots, where it always has
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
};  // kShortest also tries `factored`, which has no value here

// The plain double code, the reference for all routes.
Eigen::VectorXd evaluate_analytic(const dynamics::Model<double>& model, const RobotFunction& function,
                                  const Eigen::Ref<const Eigen::VectorXd>& state);

// Variables: the state.  `source` applies to derivatives only.  NumericalError for functions that solve for
// accelerations if a joint moves no inertia, since the recording would contain infinities.
Function record_robot_function(const dynamics::Model<double>& model, const RobotFunction& function,
                               RobotSource source = RobotSource::kShortest);

// Dynamics with effects (dynamics/effects/effects.h), for optimal control: (q, v, tau) -> ddq and (q, v, a) -> tau.
// An effect that is not chosen adds no node.
Function record_forward_dynamics(const dynamics::Model<double>& model,
                                 const dynamics::Effects<double>& effects);
Function record_inverse_dynamics(const dynamics::Model<double>& model,
                                 const dynamics::Effects<double>& effects);

}  // namespace dyntape
