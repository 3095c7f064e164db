// SPDX-License-Identifier: BSD-3-Clause
//
// What a page that plays a motion is made from; player.h says how.  World frame, z upwards.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/dynamics/model/model.h>
#include <dyntape/dynamics/urdf/visuals.h>

namespace dyntape {

// What the ground does to the robot at a point, world frame.
struct PlayerContact {
  Eigen::Vector3d point;  // m
  Eigen::Vector3d force;  // N
};

// Something besides the motion that is told while it plays, a number a sample.
struct PlayerValue {
  std::string name, unit;
  Eigen::VectorXd values;  // (samples)
};

// Points x with normal . x = offset; the robot is where normal . x is more.
struct PlayerPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // any length but zero
  double offset = 0;                                  // m, for a normal of unit length
};

// A height z = heights(i, j) above the point (corner.x + i step.x, corner.y + j step.y).
struct PlayerHeights {
  Eigen::Vector2d corner, step;  // m
  Eigen::MatrixXd heights;       // m, at least 2 x 2
};

struct PlayerInput {
  std::string title;
  dynamics::Model<double> model;
  dynamics::UrdfVisuals visuals = {};
  std::vector<dynamics::Visual> surroundings =
      {};                  // what is no part of the robot, fixed to the world (body -1)
  Eigen::VectorXd t = {};  // (samples) s, at least one, not decreasing
  Eigen::MatrixXd q = {};  // (nq x samples)
  std::vector<std::vector<PlayerContact>> contacts = {};  // empty, or a list a sample
  std::vector<std::string> traces = {};                   // frames whose paths are drawn
  std::vector<PlayerValue> values = {};
  std::optional<PlayerPlane> plane = {};  // without either: a grid below the robot
  std::optional<PlayerHeights> heights = {};
};

}  // namespace dyntape
