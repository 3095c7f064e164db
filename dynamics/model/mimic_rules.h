// SPDX-License-Identifier: BSD-3-Clause
//
// Which joint follows which: what a URDF file's <mimic> says.
//
//   std::vector<MimicRule> rules = {{"finger_2", "finger_1", -1, 0}};     // q_2 = -q_1
//   if (auto fault = mimic_fault(joint_kinds(model), rules)) std::cerr << fault->sentence;
//
// Rules name joints, so that they outlive operations on a model (model_operations.h).
#pragma once

#include <compare>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/dynamics/model/model.h>

namespace dyntape::dynamics {

struct MimicRule {
  std::string joint, leader;
  double multiplier = 1, offset = 0;  // rad/rad, m/rad, ...; rad or m

  auto operator<=>(const MimicRule&) const = default;
};

// What rules need to know of a joint.
struct JointKind {
  std::string name;
  JointType type;
};

template <class T>
std::vector<JointKind> joint_kinds(const Model<T>& model) {
  std::vector<JointKind> kinds;
  for (const Joint<T>& joint : model.joints) kinds.push_back({joint.name, joint.type});
  return kinds;
}

// What is wrong with the rules: unknown joints, joints with two rules, circles, joints of several degrees of freedom,
// numbers that are not finite; followers on a line of a joint that turns, whose angle is known but for turns, and turning
// followers of such a one by a multiplier that is not whole, which a turn of the leader would make jump.
struct MimicFault {
  std::string joint;     // whose rule it is
  std::string sentence;  // `joint "b" mimics "a", which is spherical; expected ...`
};
std::optional<MimicFault> mimic_fault(const std::vector<JointKind>& joints,
                                      const std::vector<MimicRule>& rules);

// ArgumentError with the sentence of mimic_fault.
void check_mimic_rules(const std::string& model_name, const std::vector<JointKind>& joints,
                       const std::vector<MimicRule>& rules);

// The same rules, each with the first leader of its chain: a joint that follows nobody.
std::vector<MimicRule> resolved(const std::vector<MimicRule>& rules);

// The robot with joints held at zero, as lock_joints; what follows a held leader is held where the leader at
// zero has it, and its rule goes.  ArgumentError for a follower whose leader is not held.
Model<double> lock_with_followers(const Model<double>& model, const std::vector<std::string>& names,
                                  std::vector<MimicRule>& rules);

}  // namespace dyntape::dynamics
