// SPDX-License-Identifier: BSD-3-Clause
//
// The mechanisms of a scene: parts that no joint, mimic joint, loop, tendon or contact connects, so that they exchange no energy.
//
//   for (const Mechanism& part : mechanisms_of(scene)) ...      // part.name: the joint next to the world
//
// The ground does not connect mechanisms: it does not move.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

struct Mechanism {
  std::string name;
  std::vector<int> joints;  // ascending
};

// In the order of their first joints; at least one.
std::vector<Mechanism> mechanisms_of(const RobotScene& scene);

// (joints) index of each joint's mechanism.
std::vector<int> mechanism_of_joints(const std::vector<Mechanism>& mechanisms, int n_joints);

}  // namespace dyntape
