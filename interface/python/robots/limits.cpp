// SPDX-License-Identifier: BSD-3-Clause
#include "limits.h"

#include <algorithm>
#include <cmath>

#include <dyntape/dynamics/model/mimic_rules.h>

namespace dyntape::python {
namespace {

// Narrows a leader's limits to those within which a follower, multiplier * leader + offset, keeps its own.
void narrow(dynamics::JointLimits& leader, const dynamics::MimicRule& rule,
            const dynamics::JointLimits& follower) {
  if (rule.multiplier == 0) return;
  const double a = (follower.lower - rule.offset) / rule.multiplier;
  const double b = (follower.upper - rule.offset) / rule.multiplier;
  leader.lower = std::max(leader.lower, std::min(a, b));
  leader.upper = std::min(leader.upper, std::max(a, b));
  leader.velocity = std::min(leader.velocity, follower.velocity / std::abs(rule.multiplier));
}

}  // namespace

dynamics::JointLimits limits_with_followers(const Robot& robot, const dynamics::Joint<double>& joint) {
  dynamics::JointLimits limits = joint.limits;
  for (const dynamics::MimicRule& rule : dynamics::resolved(robot.urdf.mimics)) {
    if (rule.leader != joint.name) continue;
    for (const auto& follower : robot.model().joints)
      if (follower.name == rule.joint) narrow(limits, rule, follower.limits);
  }
  return limits;
}

}  // namespace dyntape::python
