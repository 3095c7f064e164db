// SPDX-License-Identifier: BSD-3-Clause
//
// A regular gait: the contact schedule of each foot, and the height of feet in the air.
//
//   const Gait trot{.period = 0.4, .duty = 0.5, .phases = {0, 0.5, 0.5, 0}};       // FL, FR, HL, HR
//   trot.stands(1, 0.1)                                                           // whether foot 1 stands at t = 0.1 s
//
// Each foot touches down at (n + phase) periods, is on the floor for `duty` of a period, and in the air for the
// rest.  A time within rounding of a change belongs to the next state.
//
// walk() turns a robot_problem() whose contacts have schedules into a walking robot's problem.
//
// Swing height, over the fraction s of the time in the air: 16 s^2 (1 - s)^2 of `lift`, at rest at both ends.
//
// Errors.  ArgumentError: a gait that does not fit the contacts, a contact without schedule or place.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/motion/robot_problem.h>

namespace dyntape {

struct Gait {
  double period = 0.4;         // s
  double duty = 0.5;           // 0 < duty <= 1
  std::vector<double> phases;  // of each foot, delay of its touch-down as a fraction of the period
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  // m/s
  double lift = 0.05;                                  // m, largest height of a foot in the air

  double steps(std::size_t foot, double t) const;  // number of steps since the first touch-down
  bool stands(std::size_t foot, double t) const;
  double height(std::size_t foot, double t) const;  // m, above its place on the floor

  // Returns why the gait does not fit this number of feet; "" if it does.
  std::string fault(std::size_t feet) const;
};

// Sets the contact schedules of a walking robot, and adds a cost on the squared height error of feet in the air,
// above their contacts' places.
void walk(Problem& problem, const RobotScene& scene, const std::vector<HeldContact>& contacts,
          const Gait& gait, double weight);

// weight |f - share|^2 for each contact force; the feet on the floor share the robot's weight equally.
Term squared_forces(const Problem& problem, const RobotScene& scene, const std::vector<HeldContact>& contacts,
                    double weight);

}  // namespace dyntape
