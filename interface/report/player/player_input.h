// SPDX-License-Identifier: BSD-3-Clause
//
// The input of a page that plays a motion (player.h).  World frame, z upwards.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/dynamics/model/model.h>
#include <dyntape/dynamics/urdf/visuals.h>

namespace dyntape {

// The contact force on the robot at a point, world frame.
struct PlayerContact {
  Eigen::Vector3d point;  // m
  Eigen::Vector3d force;  // N
};

// A quantity that is displayed during the motion, one number per sample.
struct PlayerValue {
  std::string name, unit;
  Eigen::VectorXd values;  // (samples)
};

// The plane normal . x = offset; the robot is on the side normal . x > offset.
struct PlayerPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // any nonzero length
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
  std::vector<dynamics::Visual> surroundings = {};        // objects fixed to the world (body -1)
  Eigen::VectorXd t = {};                                 // (samples) s, at least one, not decreasing
  Eigen::MatrixXd q = {};                                 // (nq x samples)
  std::vector<std::vector<PlayerContact>> contacts = {};  // empty, or one list per sample
  std::vector<std::string> traces = {};                   // frames whose paths are drawn
  std::vector<PlayerValue> values = {};
  std::optional<PlayerPlane> plane = {};  // without plane and terrain: a grid below the robot
  std::optional<PlayerHeights> heights = {};
};

}  // namespace dyntape
