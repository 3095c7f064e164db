// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/model/mimic_rules.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/suggest.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/model/model_operations.h>

namespace dyntape::dynamics {
namespace {

const MimicRule* rule_of(const std::vector<MimicRule>& rules, const std::string& joint) {
  const auto found =
      std::find_if(rules.begin(), rules.end(), [&](const MimicRule& rule) { return rule.joint == joint; });
  return found == rules.end() ? nullptr : &*found;
}

const JointKind* joint_of(const std::vector<JointKind>& joints, const std::string& name) {
  const auto found =
      std::find_if(joints.begin(), joints.end(), [&](const JointKind& joint) { return joint.name == name; });
  return found == joints.end() ? nullptr : &*found;
}

MimicRule followed_to_its_end(const std::vector<MimicRule>& rules, MimicRule rule) {
  while (const MimicRule* above = rule_of(rules, rule.leader)) {
    rule.leader = above->leader;
    rule.offset += rule.multiplier * above->offset;
    rule.multiplier *= above->multiplier;
  }
  return rule;
}

// What is wrong with one rule, without its subject; nothing if empty.
std::string fault_of(const std::vector<JointKind>& joints, const std::vector<MimicRule>& rules,
                     const MimicRule& rule) {
  const std::string mimics = " mimics \"" + rule.leader + "\"";
  const std::string expected = "; expected a revolute, continuous, prismatic or helical joint";
  const auto suggested = [&](const std::string& name) { return suggestion(name, detail::names_of(joints)); };
  const auto turns = [](const JointKind* joint) { return joint->type == JointType::kContinuous; };
  const JointKind *joint = joint_of(joints, rule.joint), *leader = joint_of(joints, rule.leader);
  if (!joint) return mimics + ", but no joint that moves has its own name" + suggested(rule.joint);
  if (rule.joint == rule.leader) return " mimics itself; expected another joint";
  if (!leader) return mimics + ", and no joint that moves has that name" + suggested(rule.leader);
  if (nv(joint->type) != 1) return mimics + " but is " + to_string(joint->type) + expected;
  if (nv(leader->type) != 1) return mimics + ", which is " + to_string(leader->type) + expected;
  if (!std::isfinite(rule.multiplier) || !std::isfinite(rule.offset))
    return mimics + " with a multiplier or an offset that is not a finite number";
  if (rule_of(rules, rule.joint) != &rule) return " has two rules to mimic another; expected one";
  size_t steps = 0;
  for (const MimicRule* next = &rule; next; next = rule_of(rules, next->leader))
    if (++steps > rules.size()) return mimics + ", which in the end follows itself; expected no circle";
  // What it follows in the end.
  const MimicRule chain = followed_to_its_end(rules, rule);
  const JointKind* first = joint_of(joints, chain.leader);
  if (!first || !turns(first)) return "";
  const std::string end = first == leader ? "" : ", and so in the end \"" + first->name + "\"";
  if (!turns(joint))
    return mimics + end + ", which is continuous, its angle known but for whole turns; expected a " +
           "revolute, prismatic or helical joint, or a follower that is continuous too";
  constexpr double kMostTurns = 1e4;  // each is a product
  if (std::abs(chain.multiplier) > kMostTurns)
    return mimics + end + ", which is continuous, by " + std::to_string(chain.multiplier) +
           "; expected at most 10000, as every turn is a product";
  if (chain.multiplier != std::round(chain.multiplier))
    return mimics + end + ", which is continuous, by a multiplier that is not whole (" +
           std::to_string(chain.multiplier) +
           "), and would jump where that ends a turn; expected 1, -1, 2, ...";
  return "";
}

}  // namespace

std::optional<MimicFault> mimic_fault(const std::vector<JointKind>& joints,
                                      const std::vector<MimicRule>& rules) {
  for (const MimicRule& rule : rules) {
    const std::string fault = fault_of(joints, rules, rule);
    if (!fault.empty()) return MimicFault{rule.joint, "joint \"" + rule.joint + "\"" + fault};
  }
  return {};
}

void check_mimic_rules(const std::string& model_name, const std::vector<JointKind>& joints,
                       const std::vector<MimicRule>& rules) {
  if (const auto fault = mimic_fault(joints, rules)) {
    throw ArgumentError("model \"" + model_name + "\": " + fault->sentence);
  }
}

std::vector<MimicRule> resolved(const std::vector<MimicRule>& rules) {
  std::vector<MimicRule> result = rules;
  for (MimicRule& rule : result) rule = followed_to_its_end(rules, rule);
  return result;
}

Model<double> lock_with_followers(const Model<double>& model, const std::vector<std::string>& names,
                                  std::vector<MimicRule>& rules) {
  check_mimic_rules(model.name, joint_kinds(model), rules);
  const auto is_named = [&](const std::string& joint) {
    return std::find(names.begin(), names.end(), joint) != names.end();
  };
  std::vector<std::string> held = names;
  std::vector<MimicRule> left;
  Eigen::VectorXd q = neutral(model);
  for (const MimicRule& rule : resolved(rules)) {
    if (!is_named(rule.leader)) {
      if (is_named(rule.joint))
        throw ArgumentError("joint \"" + rule.joint + "\" follows \"" + rule.leader +
                            "\" and cannot be held by itself; hold \"" + rule.leader + "\"");
      left.push_back(rule);
      continue;
    }
    const Joint<double>& joint = model.joints[model.joint_index(rule.joint)];
    if (joint.type == JointType::kContinuous) {
      q[joint.idx_q] = std::cos(rule.offset);
      q[joint.idx_q + 1] = std::sin(rule.offset);
    } else {
      q[joint.idx_q] = rule.offset;
    }
    if (!is_named(rule.joint)) held.push_back(rule.joint);
  }
  rules = left;
  return lock_joints(model, held, q);
}

}  // namespace dyntape::dynamics
