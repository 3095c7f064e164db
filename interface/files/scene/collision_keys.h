// SPDX-License-Identifier: BSD-3-Clause
//
// The key `shapes collision` of a contact: its links touch the ground with the <collision> shapes of the robot's
// file.
//
//   effects     { contacts { contact { shapes collision  stiffness 1e5  dissipation 0.5  friction 0.7 } } }
//   constraints { contacts { contact { shapes collision  frames "foot"  friction 0.7 } } }
//
//   if (const auto spheres = read_collision_shapes(block, robot)) ...     // none: the key is absent, or the robot
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/dynamics/urdf/collisions.h>
#include <dyntape/interface/files/info/section.h>

namespace dyntape {

// The robot with the valid joint and link names, and its file.
struct KeyedRobot {
  const dynamics::Model<double>* model = nullptr;  // null: no robot, keys are known but not read
  std::string urdf;
  std::vector<std::string>* left_out =
      nullptr;  // of Scene and Task; <collision> is read where it is asked for
  const dynamics::UrdfCollisions* collisions = nullptr;  // of a robot without a file (scene_of_robot.h)
};

// The links, at least one of them, that `frames` names; none without a model.
std::vector<std::string> read_frames(io::Section& block, const std::string& meaning,
                                     const dynamics::Model<double>* model);

// The spheres of the links in `frames`, or of all links if absent.  Problems are noted in the block.  Spheres of
// links fixed to the world are skipped.
std::optional<std::vector<dynamics::CollisionSphere>> read_collision_shapes(io::Section& block,
                                                                            const KeyedRobot& robot);

}  // namespace dyntape
