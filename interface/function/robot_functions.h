// SPDX-License-Identifier: BSD-3-Clause
//
// A robot's dynamics as recorded functions.
//
//   Model<double> arm = load_urdf("arm.urdf");
//   Function f = record_robot_function(arm, RobotFunction::kIdDerivatives);
//   std::vector<double> y = evaluate(f, state);          // state: (q, v, a), y: dtau_dq | dtau_dv | dtau_da
//
//   function         state        result, matrices row by row                     formulas
//   rnea             (q, v, a)    tau (nv)                                          dynamics/algorithms.h
//   aba              (q, v, tau)  ddq (nv)
//   crba             (q)          M (nv x nv)
//   id-derivatives   (q, v, a)    dtau_dq | dtau_dv | dtau_da, (nv x nv) each
//   fd-derivatives   (q, v, tau)  ddq_dq | ddq_dv | ddq_dtau, (nv x nv) each
//
// q (nq); v, a, tau (nv); units as in dynamics/model.h.  Derivatives with respect to q are tangent: a column
// for each increment q (+) d in the moving frame of the joint (free-flyer: linear, then angular).
//
// A derivative can be had in two ways that know nothing of each other:
//   analytic        the derivative recursion of dynamics/ is recorded
//   differentiated  the value of q (+) d is recorded with d and q as inputs, its Jacobian derived graph to
//                   graph at d = 0, where the exponential map folds away
//   shortest        whichever of the two takes fewer operations; large robots: analytic, which always does
#pragma once

#include <string>
#include <vector>

#include <dyntape/autodiff/eigen.h>
#include <dyntape/autodiff/function.h>
#include <dyntape/dynamics/effects.h>
#include <dyntape/dynamics/model.h>

namespace dyntape {

enum class RobotFunction { kRnea, kAba, kCrba, kIdDerivatives, kFdDerivatives };
enum class RobotSource { kAnalytic, kDifferentiated, kShortest };

inline constexpr RobotFunction kRobotFunctions[] = {RobotFunction::kRnea, RobotFunction::kAba,
                                                    RobotFunction::kCrba, RobotFunction::kIdDerivatives,
                                                    RobotFunction::kFdDerivatives};

// "rnea", "aba", "crba", "id-derivatives", "fd-derivatives"; the reverse throws ArgumentError with the
// choices.
const char* to_string(RobotFunction function);
RobotFunction robot_function_from(const std::string& word);

bool is_derivative(RobotFunction function);
// Whether the function solves for accelerations: it then needs an inertia about every joint.
bool is_forward(RobotFunction function);

// Names and number of the entries of a state and of a result: q0, q1, ..., tau0; dtau_dq_0_1 is row 0,
// column 1.
std::vector<std::string> input_names(const dynamics::Model<double>& model, RobotFunction function);
std::vector<std::string> output_names(const dynamics::Model<double>& model, RobotFunction function);

// The plain double code: the reference that the others are held against.
Eigen::VectorXd evaluate_analytic(const dynamics::Model<double>& model, RobotFunction function,
                                  const Eigen::Ref<const Eigen::VectorXd>& state);

// Variables: the state.  `source` matters for derivatives only.
Function record_robot_function(const dynamics::Model<double>& model, RobotFunction function,
                               RobotSource source = RobotSource::kShortest);

// Dynamics with effects (dynamics/effects.h), for optimal control: (q, v, tau) -> ddq and (q, v, a) -> tau.
// What is not chosen leaves no node.
Function record_forward_dynamics(const dynamics::Model<double>& model,
                                 const dynamics::Effects<double>& effects);
Function record_inverse_dynamics(const dynamics::Model<double>& model,
                                 const dynamics::Effects<double>& effects);

// The same effects with constants of the recording scalar, for recordings of one's own.
dynamics::Effects<AD> recorded_effects(const dynamics::Effects<double>& effects);

}  // namespace dyntape
