// SPDX-License-Identifier: BSD-3-Clause
//
// What touches the ground in the study of contacts, and how it is moved: a block and a quadruped, compliant or rigid.
//
//   Mover mover(compliant_block(config), Integrator::kRungeKutta4);
//   const Moved end = mover.run(block_at(0.05), 1e-3, 500, BlockValues{.tilt = 0.35});
//   if (end.trouble.empty()) use(end.x, end.seconds);
//
// Slopes are level ground under gravity that is turned about y: along + x it goes down.
#pragma once

#include <optional>
#include <string>

#include <dyntape/interface/system/rigid/rigid_step.h>
#include <dyntape/interface/system/scene_system.h>

namespace dyntape::tools {

// The box of config/robots, and what is varied of its contacts at the four lower corners: f_n = k x (1 + d x').
struct BlockValues {
  double gravity = 9.81, tilt = 0;                        // m/s^2, rad
  double stiffness = 1e4, dissipation = 0, friction = 0;  // k of a corner (N/m), d (s/m), mu

  Eigen::VectorXd parameters() const;
};
inline constexpr double kMass = 2, kHalfHeight = 0.05, kSlip = 1e-2;  // kg, m, m/s: of the block
// Of a corner about y and the moment of inertia: the stiffest motion of a block on springs is to pitch.
double block_pitch_frequency(double stiffness);  // rad/s

struct ContactWorld {
  RobotScene scene;
  System system;
  int feet = 0;
};

// Of parameters BlockValues.
ContactWorld compliant_block(const std::string& config);
ContactWorld rigid_block(const std::string& config, const BlockValues& values, double restitution);
// Solo12 on springs in its joints, as config/scenes/quadruped_standing.info; (kFootStiffness x)^1.5.
ContactWorld quadruped(const std::string& config, bool is_rigid);
inline constexpr double kFootStiffness = 3e4;  // N/m^1.5
Eigen::VectorXd block_at(double height);       // (q, v) of its middle, level and at rest
Eigen::VectorXd quadruped_touching(const ContactWorld& world);
Eigen::VectorXd foot_depths(const ContactWorld& world,
                            const Eigen::VectorXd& x);  // m, below ground is positive
double weight(const ContactWorld& world);               // N

// Of the block in the world.
Eigen::Vector3d block_velocity(const Eigen::VectorXd& x);

struct Moved {
  std::string trouble;
  Eigen::VectorXd x;
  double seconds = 0;  // that it took
  double pushed = 0;   // N: sum of normal forces of rigid contacts over the last step
};

class Mover {
 public:
  Mover(const ContactWorld& world, Integrator integrator, double relative_tolerance = 1e-10);
  Moved run(Eigen::VectorXd x, double step, long steps, const Eigen::VectorXd& p = {});

 private:
  const ContactWorld& world_;
  Stepper stepper_;
  std::optional<RigidStepper> rigid_;
};

}  // namespace dyntape::tools
