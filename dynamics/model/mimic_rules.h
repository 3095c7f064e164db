// SPDX-License-Identifier: BSD-3-Clause
//
// The rules of mimic joints, as in <mimic> elements of URDF files.
//
//   std::vector<MimicRule> rules = {{"finger_2", "finger_1", -1, 0}};     // q_2 = -q_1
//   if (auto fault = mimic_fault(joint_kinds(model), rules)) std::cerr << fault->sentence;
//
// Rules name joints, so they stay valid after operations on a model (model_operations.h).
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

// The properties of a joint that the rules depend on.
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

// Checks the rules: unknown joints, joints with two rules, cycles, joints of several degrees of freedom, numbers
// that are not finite; followers on a line of a continuous joint, whose angle is known only up to full turns; and
// continuous followers of a continuous joint with a multiplier that is not an integer, which would jump at a full
// turn of the leader.
struct MimicFault {
  std::string joint;     // joint of the rule
  std::string sentence;  // `joint "b" mimics "a", which is spherical; expected ...`
};
std::optional<MimicFault> mimic_fault(const std::vector<JointKind>& joints,
                                      const std::vector<MimicRule>& rules);

// Throws ArgumentError with the sentence of mimic_fault.
void check_mimic_rules(const std::string& model_name, const std::vector<JointKind>& joints,
                       const std::vector<MimicRule>& rules);

// The same rules, each with the first leader of its chain.
std::vector<MimicRule> resolved(const std::vector<MimicRule>& rules);

// The robot with joints fixed at zero, as lock_joints.  Followers of a fixed leader are fixed at the position for
// leader zero, and their rules are removed.  ArgumentError for a fixed follower whose leader is not fixed.
Model<double> lock_with_followers(const Model<double>& model, const std::vector<std::string>& names,
                                  std::vector<MimicRule>& rules);

}  // namespace dyntape::dynamics
