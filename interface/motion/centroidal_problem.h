// SPDX-License-Identifier: BSD-3-Clause
//
// A robot on its feet as one mass: where the centre of mass goes and how the robot turns as a whole, by the forces of its feet
// alone.
//
//   const CentroidalBody dog = centroidal_body(scene, q, {{.frame = "FL_FOOT"}, {.frame = "FR_FOOT"}, ...});
//   Problem p = centroidal_problem(dog, {.duration = 0.5, .is_level = true, .zero_angular_momentum = true, .ends_at_rest = true});
//   p.start << dog.com, velocity, angular_momentum;                    // (9) as measured: centroidal_state(scene, q, v)
//   RecedingHorizon mpc(p, {.mesh = {.intervals = 20}});               // receding_horizon.h
//
// States, world axes: c.x|y|z, the centre of mass (m); v.x|y|z, its velocity (m/s), the linear momentum by the mass; k.x|y|z, the
// angular momentum about it (kg m^2/s).  Controls f.<foot>.x|y|z: the force of the floor on each foot (N).
//
//   c' = v        v' = g + sum f_i / m        k' = sum (p_i - c) x f_i
//
// which is exact whatever the legs do: legs are what makes the forces.  How the trunk is turned is left out, since nothing asked
// here depends on it; nor are the legs' lengths known.
//
// Terms.  Each foot: 0 <= fz <= most_force and the friction cone (robot_problem.h).  Costs, integrated: `com` |c - target|^2,
// `velocity` |v|^2, `angular` |k|^2, and `force` |f - share|^2 of each foot, its share of the weight being the same for all that
// stand.  Options demand more:
//   is_level       the height stays the target's:   vz' + 20 vz + 100 (cz - target z) = 0 at every point
//   zero_angular_momentum    no angular momentum:             k' + 10 k = 0 at every point
//                  Both of rates and not of values: these tell the forces, as for held contacts; errors decay.  Feet do not pull,
//                  so a level robot that moves upwards at more than g / 20 has no plan.
//   ends_at_rest   at the end v = 0, v' = 0, k = 0, k' = 0, less what the two above decide: a stand that the feet can hold, so
//                  that the centre of mass is above the support.
//
// With all three a plan exists if and only if the push can be stood without a step.  For feet at one height h below c and a robot
// that stands above their middle, d from the edge of their polygon, that is up to a velocity v towards the edge of
//   v / (omega d) = tanh(omega T) sqrt(r (2 - r)),   omega = sqrt(g / h),   r = min(1, friction h / d)
// (for r < 1 up to terms of exp(-2 omega T)): for long horizons and enough friction the capture point c + v / omega lies within
// the polygon (T. Koolen et al., Capturability-based analysis and control of legged locomotion, part 1, International Journal of
// Robotics Research 31(9), 2012).
//
// Parameters, in place (parameters.h): "com" (3) the target (m); of each foot "<foot> place" (3, m, world) and "<foot> load" (1),
// by which its force counts: 1 on the floor, 0 in the air.  As functions of time they are a schedule of contacts; walk() sets a
// regular one.  A foot in the air has a force that does nothing, so that no bound collapses.  A mesh sees a change of load at its
// next point.
//
// Errors: ArgumentError for a robot without mass, no foot, two of one name, unknown or fixed frames, a friction or most_force
// that is not above zero, weights below zero, places that are no numbers.
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

// Of a robot at q; feet stand where its frames are, or where they are said to be held.
CentroidalBody centroidal_body(const RobotScene& scene, const Eigen::VectorXd& q,
                               const std::vector<HeldContact>& contacts);

// (9) c, v, k of a robot at (q, v).
Eigen::VectorXd centroidal_state(const RobotScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v);

struct CentroidalOptions {
  double duration = 0.5;                                        // s
  double most_force = std::numeric_limits<double>::infinity();  // N, of a foot, upwards
  bool is_level = false, zero_angular_momentum = false, ends_at_rest = false;
  struct Weights {
    double com = 10, velocity = 1, angular = 1, force = 1e-3;
  } weights = {};
};

// It starts at rest at body.com, which is the target as well.
Problem centroidal_problem(const CentroidalBody& body, const CentroidalOptions& options);

// Sets target, places and loads as functions of time: the body goes on from body.com at the gait's velocity, each foot stands
// under where it is attached when half of its stance is over.  A trot of feet FL, FR, HL, HR: phases {0, 0.5, 0.5, 0}.
void walk(Problem& problem, const CentroidalBody& body, const Gait& gait);

}  // namespace dyntape
