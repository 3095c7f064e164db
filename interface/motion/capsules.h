// SPDX-License-Identifier: BSD-3-Clause
//
// Collision avoidance between capsules and spheres on the robot and in the world.
//
//   const Capsule hand = sphere("hand", "panda_hand", {0, 0, 0.05}, 0.09);                // on a frame of the robot
//   const Capsule forearm = capsule("forearm", "panda_link5", {0, 0, -0.26}, {0, 0, 0}, 0.07);
//   const Capsule post = capsule("post", kWorld, {0.5, 0, 0}, {0.5, 0, 0.6}, 0.05);         // fixed in the world
//   p.add(keep_clear(scene, hand, post));                      // along the whole path
//   p.add(keep_clear(scene, hand, forearm, 0.02));             // at least 2 cm
//   const double gap = clearance(scene.model, q, hand, post);  // m; negative: they overlap
//
// A capsule is the set of points within its radius of a segment; a sphere has a segment of length zero.  Units: m.
//
// With d the distance of the segments and R = r_a + r_b + least the required distance, a pair has the row
//   gap = (d^2 / R - R) / 2 >= 0
// Near contact the row equals the clearance (m) to first order.  It needs no square root: at coinciding centres it
// is -R / 2 and smooth.  Smoothness:
//
// - two spheres: smooth everywhere
// - with a capsule: continuous derivatives; the curvature jumps where the nearest point reaches an end
// - two parallel capsules: derivatives jump too, since the nearest point jumps
//
// Capsules at an angle below 1e-7 count as parallel; the distance is then too large by at most 5e-8 of their length.
//
// Source: C. Ericson, Real-Time Collision Detection, 2005, section 5.1.9, without branches.
//
// Errors.  ArgumentError: an unknown frame, a radius <= 0, a negative `least`, numbers that are not finite, two
// capsules without a joint between them.
#pragma once

#include <string>

#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

// The frame of capsules that do not move.
inline constexpr const char* kWorld = "";

struct Capsule {
  std::string name, frame;   // of the robot's model, or kWorld
  Eigen::Vector3d from, to;  // ends of the segment, in the frame
  double radius;

  bool is_ball() const { return from == to; }
};

Capsule sphere(std::string name, std::string frame, const Eigen::Vector3d& center, double radius);
Capsule capsule(std::string name, std::string frame, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                double radius);

// The path inequality "hand clear of post": (1) gap >= 0.
Term keep_clear(const RobotScene& scene, const Capsule& a, const Capsule& b, double least = 0);

// The clearance d - r_a - r_b (m) at a configuration (nq); negative: overlap.
double clearance(const dynamics::Model<double>& model, const Eigen::VectorXd& q, const Capsule& a,
                 const Capsule& b);

}  // namespace dyntape
