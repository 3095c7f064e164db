// SPDX-License-Identifier: BSD-3-Clause
//
// A regular gait: which foot stands when, and how those in the air are lifted.
//
//   const Gait trot{.period = 0.4, .duty = 0.5, .phases = {0, 0.5, 0.5, 0}};       // FL, FR, HL, HR
//   trot.stands(1, 0.1)                                                           // whether foot 1 stands at t = 0.1 s
//
// Each foot steps down at (n + phase) periods, stands for `duty` of a period and is in the air for the rest of it.  Times within
// rounding of a change belong to what follows.
//
// walk() makes a robot_problem() whose contacts have schedules that of a walking robot.
//
// Swing height, over the share s of the time in the air: 16 s^2 (1 - s)^2 of `lift`, at rest at both ends.
//
// Errors: ArgumentError for what is no gait of these contacts, for a contact without schedule or place.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/motion/robot_problem.h>

namespace dyntape {

struct Gait {
  double period = 0.4;         // s
  double duty = 0.5;           // 0 < duty <= 1
  std::vector<double> phases;  // of each foot, parts of a period by which it steps down later than 0
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  // m/s
  double lift = 0.05;                                  // m, of a foot in the air at most

  double steps(std::size_t foot, double t) const;  // since it first stepped down
  bool stands(std::size_t foot, double t) const;
  double height(std::size_t foot, double t) const;  // m, above where it stands

  // Why it is none of so many feet, in one sentence; empty: it is one.
  std::string fault(std::size_t feet) const;
};

// A walking robot, whose contacts have schedules: sets these by the gait, and draws feet in the air to their height above where
// their contacts' places are, by the squared distance.
void walk(Problem& problem, const RobotScene& scene, const std::vector<HeldContact>& contacts,
          const Gait& gait, double weight);

// weight |f - share|^2 of each force of a contact: of those that stand, the same part of the robot's weight.
Term squared_forces(const Problem& problem, const RobotScene& scene, const std::vector<HeldContact>& contacts,
                    double weight);

}  // namespace dyntape
