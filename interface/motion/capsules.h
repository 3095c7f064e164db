// SPDX-License-Identifier: BSD-3-Clause
//
// Balls and bars that keep clear of each other: of a robot and around it.
//
//   const Capsule hand = sphere("hand", "panda_hand", {0, 0, 0.05}, 0.09);                // on a frame of the robot
//   const Capsule forearm = capsule("forearm", "panda_link5", {0, 0, -0.26}, {0, 0, 0}, 0.07);
//   const Capsule post = capsule("post", kWorld, {0.5, 0, 0}, {0.5, 0, 0.6}, 0.05);         // stands in the world
//   p.add(keep_clear(scene, hand, post));                      // along the whole path
//   p.add(keep_clear(scene, hand, forearm, 0.02));             // 2 cm at least
//   const double gap = clearance(scene.model, q, hand, post);  // m; negative: they overlap
//
// A capsule is all that lies within its radius of a segment; a ball is one of length zero.  Units: m.
//
// The row of a pair whose segments are d apart and have to be R = r_a + r_b + least apart is
//   gap = (d^2 / R - R) / 2 >= 0
// which is the clearance (m) to first order near contact, and needs no root: where centres coincide it is -R / 2 and
// smooth.  Of two balls it is smooth everywhere.  With a bar its derivatives are continuous and its curvature jumps where the
// nearest point leaves an end; of two parallel bars derivatives jump as well, as the nearest point does.  Bars that are parallel
// but for an angle below 1e-7 count as parallel: the distance is then too large by 5e-8 of their length at most.
//
// Nearest points of two segments: C. Ericson, Real-Time Collision Detection, 2005, section 5.1.9, without branches.
//
// Errors: ArgumentError for a frame that is unknown, a radius that is not above zero, a least clearance below zero,
// numbers that are not finite, and two capsules between which no joint moves.
#pragma once

#include <string>

#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

// The frame of what does not move.
inline constexpr const char* kWorld = "";

struct Capsule {
  std::string name, frame;   // of the robot's model; kWorld
  Eigen::Vector3d from, to;  // ends of the segment, in the frame
  double radius;

  bool is_ball() const { return from == to; }
};

Capsule sphere(std::string name, std::string frame, const Eigen::Vector3d& center, double radius);
Capsule capsule(std::string name, std::string frame, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                double radius);

// The path inequality "hand clear of post": (1) gap >= 0.
Term keep_clear(const RobotScene& scene, const Capsule& a, const Capsule& b, double least = 0);

// d - r_a - r_b at a configuration (nq).
double clearance(const dynamics::Model<double>& model, const Eigen::VectorXd& q, const Capsule& a,
                 const Capsule& b);

}  // namespace dyntape
