// SPDX-License-Identifier: BSD-3-Clause
//
// The mechanisms of a scene: parts that no joint, loop, tendon or contact of their own connects, so that no energy goes from one to another.
//
//   for (const Mechanism& part : mechanisms_of(scene)) ...      // part.name: of the joint next to the world
//
// A ground that they stand on does not connect them: it does not move.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

struct Mechanism {
  std::string name;
  std::vector<int> joints;  // ascending
};

// In the order of their first joints; one at least.
std::vector<Mechanism> mechanisms_of(const RobotScene& scene);

// (joints) the place of each joint's mechanism among them.
std::vector<int> mechanism_of_joints(const std::vector<Mechanism>& mechanisms, int n_joints);

}  // namespace dyntape
