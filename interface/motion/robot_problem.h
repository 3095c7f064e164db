// SPDX-License-Identifier: BSD-3-Clause
//
// Makes the optimal control problem of a robot: state (q, v), controls at the actuated joints.
//
//   RobotScene scene{load_urdf("cart_pole.urdf"), {}, {"slider"}};
//   Problem p = robot_problem(scene, {.duration = 2.0, .form = DynamicsForm::kForward});
//   limit_positions(p, scene);
//   p.add(squared_controls(1.0));
//
// forward   x' = (N(q) v, FD(q, v, B u)), FD by the articulated-body algorithm.
// inverse   accelerations a are variables: x' = (N(q) v, a) and s (ID(q, v, a) - B u) = 0 at every point, ID by the
// recursive Newton-Euler algorithm; rows are scaled by s = 1/effort limit, if any.  Shorter functions and more
// variables than forward; usually faster.
//
// N(q) v is v for joints on a line, and the rate of quaternions or (cos, sin) for others, also for a floating base
// (robot_configuration.h, which has starts, goals and guesses for these).
//
// Controls.  B u applies control k to the actuated joint k; the other joints have no torque.  With unit kFraction, u
// is the fraction of the joint's effort limit.  Then follow the thrusters, always in newtons, then the forces of
// held contacts.
//
// Held contacts.  The origin of each frame is held at its position by a force of three components, controls
// f.<frame>.x|y|z (N, world axes), which acts on the robot at this point.  Each contact adds two terms:
//   <frame> holds   d2p/dt2 + 20 dp/dt + 100 (p - place) = 0 at every point; the last summand if `place` is given.
//                   Accelerations determine the forces at each point; a constraint on velocities determines them only
//                   through neighbouring points.  Errors decay as (1 + 10 t) exp(-10 t) (J. Baumgarte, 1972, as in
//                   dynamics/contact/constraints.h).
//   <frame> cone    d - (fx^2 + fy^2) / d >= 0 with d = friction fz + 0.001 and fz >= 0, forces divided by the robot's
//                   weight: the friction cone of a floor with z upwards.  The tip of the cone is shifted down by a
//                   thousandth of the weight, so that the gradient is nonzero at zero force.  With the form
//                   friction^2 fz^2 - fx^2 - fy^2, solves in which feet lose their load took 100 to 300 iterations
//                   instead of 25.
// If the robot moves in a plane, rows along axes in which no joint moves the frame are omitted, and these forces are
// zero.
//
// With `corners`, the frame is a foot that does not turn: `holds` has three more rows, for the angular acceleration,
// and forces act at the corners, f.<frame>.<corner>.x|y|z, each in its cone.  For a flat foot this is the cone of
// all contact wrenches (S. Caron, Q. Pham and Y. Nakamura, ICRA 2015).  With four corners forces are not unique, so
// add a cost that selects them (squared_controls).
//
// Contact schedule.  With `has_schedule`, a contact has a parameter "<frame> load", 1 on the floor and 0 in the air,
// as in centroidal_problem.h.  As a function of time it is a schedule; walk() sets it (gait.h).  The structure of
// the program never changes:
//   <frame> holds   load (d2p/dt2 + 20 dp/dt) + (1 - load) f / weight = 0       at rest anywhere, or no force
// With `barrier` above 0, the cone is a cost instead of a constraint: a relaxed logarithm of friction fz - |(fx,
// fy)| over the robot's weight (penalties.h); forces have no bounds.  |(fx, fy)| is smoothed below a hundredth of
// the weight.
//
// Rigid contacts of the scene (RobotScene::constraints) open and close where the solver decides, without schedule or
// phases.  implicit_contacts.h has their controls f.<contact>.n|t1|t2 and their terms.
//
// The start must be at rest at the held contacts.  A goal must not fix more than the contacts leave free: with four
// feet held, the pose of the trunk, without the joints.
//
// Only the chosen effects are recorded (dynamics/effects/effects.h).  Names: states q.<joint>, v.<joint>, or
// q.<joint>[0], ... if a joint has several entries; accelerations a.<joint>; controls u.<joint>, f.<thruster>,
// f.<frame>.x, y, z.
//
// Errors.  NumericalError in the forward form if a joint moves no inertia.  ArgumentError for:
//
// - a driven joint that is unknown or named twice, or kFraction without an effort limit
// - a thruster of an unknown or fixed frame, or without axis or range
// - a contact of an unknown or fixed frame, or with friction <= 0; two contacts of one frame; a foot with fewer than
// three corners
// - a scene with loops, hard limits, or rigid contacts with restitution
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/io/choice.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

enum class DynamicsForm { kForward, kInverse };
enum class ControlUnit { kPhysical, kFraction };  // N m or N; fraction of the effort limit
inline io::Choice<DynamicsForm> dynamics_forms() {
  return {{"forward", DynamicsForm::kForward}, {"inverse", DynamicsForm::kInverse}};
}
inline io::Choice<ControlUnit> control_units() {
  return {{"physical", ControlUnit::kPhysical}, {"fraction", ControlUnit::kFraction}};
}

// A force along an axis that is fixed in a frame, at the frame's origin: a rotor, a jet.
//   Thruster rotor{.name = "front", .frame = "rotor_1", .upper = 3, .moment = 0.016};
struct Thruster {
  std::string name, frame;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // in the frame's axes; any nonzero length
  double lower = 0, upper = std::numeric_limits<double>::infinity();  // N
  double moment = 0;  // N m along the axis per newton; the sign is the rotor's sense of rotation
};

// A point, or a foot, that a contact force holds in place, on a floor with z upwards.
struct HeldContact {
  std::string frame;
  double friction = 0.7;                      // coefficient
  std::optional<Eigen::Vector3d> place = {};  // m, world: position at the start
  std::vector<Eigen::Vector3d> corners =
      {};  // m, in the frame's axes, of a foot that does not turn; empty: a point
  std::optional<Eigen::Matrix3d> axes = {};  // of a foot: its orientation in the world at the start
  bool has_schedule = false;         // true: the contact holds only while its parameter "<frame> load" is 1
  double barrier = 0, width = 0.05;  // mu and delta of the barrier on the cone; 0: a constraint
};
// The axes of moved_axes() (robot_terms.h) that the contact holds; a point does not hold rotations.
std::vector<int> held_axes(const dynamics::Model<double>& model, const HeldContact& contact);
// Names of the points at which the contact's forces act: "FL_FOOT", or for a foot "sole.0", "sole.1", ...
std::vector<std::string> force_points(const HeldContact& contact);

struct RobotProblemOptions {
  double duration = 1;
  DynamicsForm form = DynamicsForm::kForward;
  ControlUnit unit = ControlUnit::kPhysical;
  std::vector<Thruster> thrusters = {};
  std::vector<HeldContact> contacts = {};
};

Problem robot_problem(const RobotScene& scene, const RobotProblemOptions& options);

// (N) The weight of the whole robot, the reference for contact forces.
double weight_of(const RobotScene& scene);

// The friction cone (above) of a held contact whose forces are the controls from `first` on; `weight` (N): the
// robot's.
Term friction_cone(const std::string& robot, const HeldContact& contact, Eigen::Index first, double weight);

// Torques (nv) that hold the robot at rest at q, including passive effects.
Eigen::VectorXd holding_torque(const RobotScene& scene, const Eigen::VectorXd& q);

// Controls (n_u) that hold the robot at rest at q, in the least-squares sense; if there are several, those of least
// norm.
Eigen::VectorXd holding_controls(const RobotScene& scene, const RobotProblemOptions& options,
                                 const Eigen::VectorXd& q);

// Bounds from the robot's limits.  A velocity or effort limit of zero means no limit.  Positions: joints on a line
// only.
double rated(double limit);
void limit_positions(Problem& problem, const RobotScene& scene);
void limit_velocities(Problem& problem, const RobotScene& scene);
void limit_efforts(Problem& problem, const RobotScene& scene, ControlUnit unit);

// Torque of each driven joint (N m or N), and its power, torque times velocity (W).  The work of the motors as a
// cost: soft(path_equality("work", joint_power(scene, unit)), SmoothAbsolute{...}), penalties.h.
StageFunction joint_torque(const RobotScene& scene, ControlUnit unit);
StageFunction joint_power(const RobotScene& scene, ControlUnit unit);

// Costs, integrated over time.
Term squared_controls(double weight);  // weight |u|^2
Term squared_fractions(const RobotScene& scene, double weight,
                       ControlUnit unit);                           // weight |u / limit|^2, joints only
Term squared_accelerations(const Problem& problem, double weight);  // weight |v'|^2
// sum w_q d^2 + sum w_v (v - v_ref)^2, d (nv) the configuration_error() to q_ref (nq); weights (nv).
Term joint_tracking(const RobotScene& scene, const Eigen::VectorXd& w_q, const Eigen::VectorXd& q_ref,
                    const Eigen::VectorXd& w_v, const Eigen::VectorXd& v_ref);

}  // namespace dyntape
