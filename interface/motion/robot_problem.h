// SPDX-License-Identifier: BSD-3-Clause
//
// A robot as an optimal control problem: state (q, v), controls at the actuated joints.
//
//   RobotScene scene{load_urdf("cart_pole.urdf"), {}, {"slider"}};
//   Problem p = robot_problem(scene, {.duration = 2.0, .form = DynamicsForm::kForward});
//   limit_positions(p, scene);
//   p.add(squared_controls(1.0));
//
// forward   x' = (N(q) v, FD(q, v, B u)), FD by the articulated-body algorithm.
// inverse   accelerations a are variables: x' = (N(q) v, a) and s (ID(q, v, a) - B u) = 0 at every point,
//           ID by the recursive Newton-Euler algorithm, rows scaled by s = 1/effort limit where the robot has
//           one.  Shorter functions, more variables, mostly faster.
// N(q) v is v itself for joints on a line, and the rate of quaternions and of (cos, sin) for others, a floating base
// among them: robot_configuration.h, which also has starts, goals and guesses for them.
//
// B u puts control k on the actuated joint k; the others get no torque.  With unit kFraction, u is the
// fraction of the joint's effort limit.  Behind them come the thrusters, in newtons whatever the unit, then the forces of
// held contacts.
//
// Held contacts.  The origin of each frame stays where it is at the start, held by a force of three components, controls
// f.<frame>.x|y|z (N, world axes) that act on the robot at that point.  Two terms a contact:
//   <frame> holds   d2p/dt2 + 20 dp/dt + 100 (p - place) = 0 at every point; the last part where the place is given.
//                   Accelerations and not velocities, because these tell the forces: demanded of velocities, collocation
//                   knows forces only by what they do to neighbouring points.  Errors decay as (1 + 10 t) exp(-10 t) (J.
//                   Baumgarte, 1972, as in dynamics/contact/constraints.h), so that none add up.
// Of a robot that moves in a plane, rows along axes that no joint moves the frame along are left out, and such forces are zero.
// With `corners` the frame is a foot that also does not turn: `holds` has three more rows, of its angular acceleration, in
// the same way, and the force acts at the corners, f.<frame>.<corner>.x|y|z, each within its cone.  For a flat foot that is
// the cone of all wrenches that the floor can give it (S. Caron, Q. Pham and Y. Nakamura, ICRA 2015); with four corners
// forces are not unique, so a cost has to tell them apart (squared_controls).
//   <frame> cone    d - (fx^2 + fy^2) / d >= 0 with d = friction fz + 0.001 and fz >= 0, forces over the robot's weight: the
//                   friction cone of a floor with z upwards, its tip a thousandth of the weight below no force, so that the term
//                   has a slope there too.  friction^2 fz^2 - fx^2 - fy^2 has none: where feet lost their load, solves took 100
//                   to 300 iterations in place of 25.
// A schedule of contacts.  With `has_schedule` a contact has a parameter "<frame> load", 1 on the floor and 0 in the air, as those of
// centroidal_problem.h; as a function of time it is a schedule, which walk() sets (gait.h).  The structure of the program never changes:
//   <frame> holds   load (d2p/dt2 + 20 dp/dt) + (1 - load) f / weight = 0       it stands, anywhere, or there is no force
// With `barrier` above 0 the cone is a cost that keeps away from the cone's sides, a relaxed logarithm of friction fz - |(fx, fy)| over
// the robot's weight (penalties.h), and forces have no bounds.  |(fx, fy)| is rounded below a hundredth of the weight.
//
// Rigid contacts of the scene (RobotScene::constraints) open and close where the solver finds it best: no schedule, no phases.
// implicit_contacts.h has their controls f.<contact>.n|t1|t2 and their terms.
//
// The motion has to start at rest there.  A goal is to give no more than contacts leave free: with four feet held, the pose
// of the trunk, not the joints as well.
//
// Only the chosen effects are recorded (dynamics/effects/effects.h).  States are named q.<joint>, v.<joint>,
// or q.<joint>[0], ... where a joint has several entries; accelerations a.<joint>, controls u.<joint>, f.<thruster>,
// f.<frame>.x, y, z.
//
// Errors: ArgumentError for a driven joint that is unknown or named twice, for fractions of an effort limit that does not
// exist, for a thruster or contact of an unknown or fixed frame, without an axis, a range or a
// friction above zero, for two contacts of one frame, for a foot of less than three corners, for a scene with loops, hard limits or
// rigid contacts that rebound; NumericalError in the forward form for a
// joint without inertia.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

enum class DynamicsForm { kForward, kInverse };
enum class ControlUnit { kPhysical, kFraction };  // N m or N; fraction of the effort limit

// A force along an axis that is fixed in a frame, at the frame's origin: a rotor, a jet.
//   Thruster rotor{.name = "front", .frame = "rotor_1", .upper = 3, .moment = 0.016};
struct Thruster {
  std::string name, frame;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();                    // in the frame's axes, of any length
  double lower = 0, upper = std::numeric_limits<double>::infinity();  // N
  double moment =
      0;  // N m along the axis that come with each newton: a rotor's drag, by its sense of rotation
};

// A point that a force holds in its place, of a floor with z upwards.
struct HeldContact {
  std::string frame;
  double friction = 0.7;                      // coefficient
  std::optional<Eigen::Vector3d> place = {};  // m, world: where it is at the start
  std::vector<Eigen::Vector3d> corners =
      {};  // m, in the frame's axes, of a foot that does not turn either; empty: a point
  std::optional<Eigen::Matrix3d> axes = {};  // of a foot: from its axes to the world's at the start
  bool has_schedule = false;                 // whether it holds only while its parameter "<frame> load" is 1
  double barrier = 0, width = 0.05;          // mu and delta of what keeps forces within cones; 0: a limit
};
// Of moved_axes() (robot_terms.h) those that it holds: a point does not hold turns.
std::vector<int> held_axes(const dynamics::Model<double>& model, const HeldContact& contact);
// "FL_FOOT", or of a foot "sole.0", "sole.1", ...: where its forces act.
std::vector<std::string> force_points(const HeldContact& contact);

struct RobotProblemOptions {
  double duration = 1;
  DynamicsForm form = DynamicsForm::kForward;
  ControlUnit unit = ControlUnit::kPhysical;
  std::vector<Thruster> thrusters = {};
  std::vector<HeldContact> contacts = {};
};

Problem robot_problem(const RobotScene& scene, const RobotProblemOptions& options);

// (N) What forces of contacts are compared with: of the whole robot.
double weight_of(const RobotScene& scene);

// The cone of a held contact (above) whose force is in the controls from `first` on; `weight` (N): of the robot.
Term friction_cone(const std::string& robot, const HeldContact& contact, Eigen::Index first, double weight);

// Torques (nv) that hold the robot still at q, passive effects included.
Eigen::VectorXd holding_torque(const RobotScene& scene, const Eigen::VectorXd& q);

// Controls (n_u) that hold the robot still at q, or come nearest to that: of several the smallest.
Eigen::VectorXd holding_controls(const RobotScene& scene, const RobotProblemOptions& options,
                                 const Eigen::VectorXd& q);

// Bounds from the robot's limits; a velocity or effort limit of zero is none.  Positions of joints on a line only.
double rated(double limit);
void limit_positions(Problem& problem, const RobotScene& scene);
void limit_velocities(Problem& problem, const RobotScene& scene);
void limit_efforts(Problem& problem, const RobotScene& scene, ControlUnit unit);

// (driven joints) What the controls do at each: torque (N m or N), and its power, torque times velocity (W).  The work that motors
// put in or take out, as a cost: soft(path_equality("work", joint_power(scene, unit)), SmoothAbsolute{...}), penalties.h.
StageFunction joint_torque(const RobotScene& scene, ControlUnit unit);
StageFunction joint_power(const RobotScene& scene, ControlUnit unit);

// Costs, integrated over time.
Term squared_controls(double weight);  // weight |u|^2
Term squared_fractions(const RobotScene& scene, double weight,
                       ControlUnit unit);                           // weight |u / limit|^2, of joints
Term squared_accelerations(const Problem& problem, double weight);  // weight |v'|^2
// sum w_q d^2 + sum w_v (v - v_ref)^2, d (nv) the configuration_error() by q_ref (nq); weights (nv)
Term joint_tracking(const RobotScene& scene, const Eigen::VectorXd& w_q, const Eigen::VectorXd& q_ref,
                    const Eigen::VectorXd& w_v, const Eigen::VectorXd& v_ref);

}  // namespace dyntape
