// SPDX-License-Identifier: BSD-3-Clause
//
// A robot as an optimal control problem: state (q, v), controls at the actuated joints.
//
//   RobotScene scene{load_urdf("cart_pole.urdf"), {}, {"slider"}};
//   Problem p = robot_problem(scene, {.duration = 2.0, .form = DynamicsForm::kForward});
//   limit_positions(p, scene);
//   p.add(squared_controls(1.0));
//
// forward   x' = (v, FD(q, v, B u)), FD by the articulated-body algorithm.
// inverse   accelerations a are variables: x' = (v, a) is linear and s (ID(q, v, a) - B u) = 0 at every
// point,
//           ID by the recursive Newton-Euler algorithm, rows scaled by s = 1/effort limit where the robot has
//           one.  Shorter functions, more variables, mostly faster.
// B u puts control k on the actuated joint k; the others get no torque.  With unit kFraction, u is the
// fraction of the joint's effort limit.
//
// Only the chosen effects are recorded (dynamics/effects/effects.h).  States are named q.<joint>, v.<joint>,
// accelerations a.<joint>, controls u.<joint>.
//
// Errors: ArgumentError for a robot whose configuration is no vector of joint values (floating base, (cos,
// sin) joints: read continuous joints as angles), for a driven joint that is unknown or named twice, for fractions of an effort limit that
// does not exist; NumericalError in the forward form for a joint without inertia.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <dyntape/interface/ocp/problem.h>
#include <dyntape/interface/scene/robot_scene.h>

namespace dyntape {

enum class DynamicsForm { kForward, kInverse };
enum class ControlUnit { kPhysical, kFraction };  // N m or N; fraction of the effort limit

struct RobotProblemOptions {
  double duration = 1;
  DynamicsForm form = DynamicsForm::kForward;
  ControlUnit unit = ControlUnit::kPhysical;
};

Problem robot_problem(const RobotScene& scene, const RobotProblemOptions& options);

// Torques (nv) that hold the robot still at q, passive effects included.
Eigen::VectorXd holding_torque(const RobotScene& scene, const Eigen::VectorXd& q);

// Bounds from the robot's limits; a velocity or effort limit of zero is none.
double rated(double limit);
void limit_positions(Problem& problem, const RobotScene& scene);
void limit_velocities(Problem& problem, const RobotScene& scene);
void limit_efforts(Problem& problem, const RobotScene& scene, ControlUnit unit);

// Costs, integrated over time.
Term squared_controls(double weight);                                              // weight |u|^2
Term squared_fractions(const RobotScene& scene, double weight, ControlUnit unit);  // weight |u / limit|^2
Term squared_accelerations(const Problem& problem, double weight);                 // weight |q''|^2
// sum w_q (q - q_ref)^2 + sum w_v (v - v_ref)^2, weights and references (nq) and (nv)
Term joint_tracking(Eigen::VectorXd w_q, Eigen::VectorXd q_ref, Eigen::VectorXd w_v, Eigen::VectorXd v_ref);

}  // namespace dyntape
