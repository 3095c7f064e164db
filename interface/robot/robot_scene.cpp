// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/robot_scene.h>

#include <algorithm>

#include <dyntape/autodiff/error.h>

namespace dyntape {

namespace {

const dynamics::Joint<double>& driven_joint(const RobotScene& scene, const std::string& name) {
  const auto& joint = scene.model.joints[std::size_t(scene.model.joint_index(name))];
  if (!dynamics::is_single(joint.type)) {
    refuse(scene.model, "joint \"" + name + "\" is " + dynamics::to_string(joint.type) +
                            "; expected a driven joint to have one degree of freedom");
  }
  return joint;
}

}  // namespace

std::vector<int> actuated_dofs(const RobotScene& scene) {
  std::vector<int> dofs;
  if (scene.actuated.empty()) {
    for (const auto& joint : scene.model.joints) {
      if (dynamics::is_single(joint.type)) dofs.push_back(joint.idx_v);
    }
  }
  for (const std::string& name : scene.actuated) {
    const int dof = driven_joint(scene, name).idx_v;
    if (std::find(dofs.begin(), dofs.end(), dof) != dofs.end())
      refuse(scene.model, "joint \"" + name + "\" is named twice among the driven ones, expected once");
    dofs.push_back(dof);
  }
  return dofs;
}

void refuse(const dynamics::Model<double>& model, const std::string& what) {
  throw ArgumentError("robot \"" + model.name + "\": " + what);
}

bool floats(const dynamics::Model<double>& model) {
  return !model.joints.empty() && model.joints.front().type == dynamics::JointType::kFreeFlyer;
}

std::string unit_of_state(const dynamics::Model<double>& model, int index) {
  if (index < 0 || index >= model.nq + model.nv) return "";
  const bool is_velocity = index >= model.nq;
  const int entry = is_velocity ? index - model.nq : index;
  for (const auto& joint : model.joints) {
    const int first = is_velocity ? joint.idx_v : joint.idx_q;
    const int count = is_velocity ? dynamics::nv(joint.type) : dynamics::nq(joint.type);
    if (entry < first || entry >= first + count) continue;
    using dynamics::JointType;
    const int linear = joint.type == JointType::kPrismatic   ? 1
                       : joint.type == JointType::kPlanar    ? 2
                       : joint.type == JointType::kFreeFlyer ? 3
                                                             : 0;
    const bool slides = entry - first < linear;
    if (is_velocity) return slides ? " m/s" : " rad/s";
    return slides ? " m" : dynamics::traits(joint.type).has_angle ? " rad" : "";
  }
  return "";
}

std::vector<std::string> driven_names(const RobotScene& scene) {
  if (!scene.actuated.empty()) return scene.actuated;
  std::vector<std::string> names;
  for (const auto& joint : scene.model.joints) {
    if (dynamics::is_single(joint.type)) names.push_back(joint.name);
  }
  return names;
}

std::vector<std::string> entry_names(const dynamics::Model<double>& model, const std::string& block) {
  std::vector<std::string> names;
  for (const auto& joint : model.joints) {
    const bool is_q = block == "q";
    const int first = is_q ? joint.idx_q : joint.idx_v;
    const int count = is_q ? dynamics::nq(joint.type) : dynamics::nv(joint.type);
    for (int k = 0; k < count; ++k)
      names.push_back(count == 1 ? block + "." + joint.name : block + std::to_string(first + k));
  }
  return names;
}

}  // namespace dyntape
