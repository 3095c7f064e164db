// SPDX-License-Identifier: BSD-3-Clause
//
// Optimal control of a legged robot's centroidal dynamics: the contact forces steer the centre of mass and the
// angular momentum.  Use it for fast planning with given footholds; robot_problem.h has the dynamics of the whole
// robot.
//
//   const CentroidalBody dog = centroidal_body(scene, q, {{.frame = "FL_FOOT"}, {.frame = "FR_FOOT"}, ...});
//   Problem p = centroidal_problem(dog, {.duration = 0.5, .is_level = true, .zero_angular_momentum = true,
//                                        .ends_at_rest = true});
//   p.start << dog.com, velocity, angular_momentum;                    // (9) measured: centroidal_state(scene, q, v)
//   RecedingHorizon mpc(p, {.mesh = {.intervals = 20}});               // receding_horizon.h
//
// States, world axes: c.x|y|z, the centre of mass (m); v.x|y|z, its velocity (m/s); k.x|y|z, the angular momentum
// about it (kg m^2/s).  Controls f.<foot>.x|y|z: the force of the floor on each foot (N).
//
//   c' = v        v' = g + sum f_i / m        k' = sum (p_i - c) x f_i
//
// These equations are exact for any motion of the legs, since legs act only through forces.  The orientation of the
// trunk is not part of the model, nor is the reach of the legs.
//
// Terms.  Each foot has 0 <= fz <= most_force and the friction cone (robot_problem.h).  Integrated costs: `com` |c -
// target|^2, `velocity` |v|^2, `angular` |k|^2, and `force` |f - share|^2 of each foot.  The share of the weight is
// equal for all feet on the floor.  Options add constraints:
//   is_level                 constant height:       vz' + 20 vz + 100 (cz - target z) = 0 at every point
//   zero_angular_momentum    no angular momentum:   k' + 10 k = 0 at every point
//   ends_at_rest             at the end v = 0, v' = 0, k = 0, k' = 0, without the rows that the two above decide.
//                            The feet can then hold the final pose, so the centre of mass is above the support.
// The first two constrain rates, not values, since rates determine the forces, as for held contacts; errors decay.
// Feet do not pull, so a level robot that moves upwards at more than g / 20 has no plan.
//
// With all three options, a plan exists exactly if the robot can balance a push without a step.  For feet at one
// height, h below c, and a robot above the middle of its feet, at distance d from the edge of the support polygon,
// the largest velocity towards the edge is
//   v / (omega d) = tanh(omega T) sqrt(r (2 - r)),   omega = sqrt(g / h),   r = min(1, friction h / d)
// (for r < 1 up to terms of exp(-2 omega T)).  For long horizons and enough friction this means that the capture
// point c + v / omega is within the polygon.
//
// Parameters, changed in place (parameters.h):
//
// - "com" (3): the target (m)
// - "<foot> place" (3, m, world): the position of each foot
// - "<foot> load" (1): the factor of its force: 1 on the floor, 0 in the air
//
// As functions of time these are a contact schedule; walk() sets a regular one.  The force of a foot in the air has
// no effect, so no bounds collapse.  The mesh sees a change of load at its next point.
//
// Errors.  ArgumentError: a robot without mass or without feet, two feet of one name, unknown or fixed frames, a
// friction or most_force <= 0, negative weights, places that are not finite.
//
// Source: T. Koolen et al., Capturability-based analysis and control of legged locomotion, part 1, International
// Journal of Robotics Research 31(9), 2012.
#pragma once

#include <dyntape/interface/motion/gait.h>

namespace dyntape {

struct CentroidalBody {
  struct Foot {
    std::string name;
    Eigen::Vector3d place;  // m, world
    double friction;        // coefficient
  };
  std::string name;
  double mass = 0;                                    // kg
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  // m/s^2
  Eigen::Vector3d com = Eigen::Vector3d::Zero();      // m
  std::vector<Foot> feet;

  double weight() const { return mass * gravity.norm(); }  // N
};

// The body of a robot at q.  Feet are at their frames' positions, or at their given places.
CentroidalBody centroidal_body(const RobotScene& scene, const Eigen::VectorXd& q,
                               const std::vector<HeldContact>& contacts);

// (9) c, v, k of a robot at (q, v).
Eigen::VectorXd centroidal_state(const RobotScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v);

struct CentroidalOptions {
  double duration = 0.5;                                        // s
  double most_force = std::numeric_limits<double>::infinity();  // N, upper limit of fz per foot
  bool is_level = false, zero_angular_momentum = false, ends_at_rest = false;
  struct Weights {
    double com = 10, velocity = 1, angular = 1, force = 1e-3;
  } weights = {};
};

// The start is at rest at body.com, which is also the target.
Problem centroidal_problem(const CentroidalBody& body, const CentroidalOptions& options);

// Sets target, places and loads as functions of time.  The body moves from body.com at the gait's velocity.  Each
// foot is below its attachment point at half of its stance.  A trot of feet FL, FR, HL, HR has phases {0, 0.5, 0.5,
// 0}.
void walk(Problem& problem, const CentroidalBody& body, const Gait& gait);

}  // namespace dyntape
