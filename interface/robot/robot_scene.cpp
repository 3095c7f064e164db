// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/robot_scene.h>

#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/mimic.h>

namespace dyntape {

namespace {

const dynamics::Joint<double>& driven_joint(const RobotScene& scene, const std::string& name) {
  const auto& joint = scene.model.joints[std::size_t(scene.model.joint_index(name))];
  if (!dynamics::is_single(joint.type)) {
    refuse(scene.model, "joint \"" + name + "\" is " + dynamics::to_string(joint.type) +
                            "; expected a driven joint to have one degree of freedom");
  }
  if (const dynamics::MimicRule* rule = rule_of(scene, name)) {
    refuse(scene.model, "joint \"" + name + "\" follows \"" + rule->leader +
                            "\", whose motor moves it; expected the driven joint \"" + rule->leader + "\"");
  }
  return joint;
}

}  // namespace

Ties ties_of(const RobotScene& scene) {
  if (scene.mimics.empty()) return {};
  const dynamics::MimicModel<double> model(scene.model, scene.mimics);
  return {model.q_entries, model.v_entries, model.q_owners, model.v_owners};
}

Eigen::MatrixXd Ties::columns(const Eigen::MatrixXd& J) const {
  if (empty()) return J;
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(J.rows(), Eigen::Index(v_owners.size()));
  for (std::size_t k = 0; k < v.size(); ++k) own.col(v[k].index) += v[k].factor * J.col(Eigen::Index(k));
  return own;
}

namespace {

// Bounds lower <= factor x + offset <= upper of followers as bounds of their leaders x.
void narrow(const std::vector<dynamics::FollowedEntry>& entries, const std::vector<int>& owners,
            Eigen::Ref<Eigen::VectorXd> lower, Eigen::Ref<Eigen::VectorXd> upper) {
  for (std::size_t k = 0; k < entries.size(); ++k) {
    const auto& [index, factor, offset, is] = entries[k];
    const int leader = owners[std::size_t(index)], own = int(k);
    if (leader == own || is != dynamics::FollowedEntry::Is::kNumber || factor == 0) continue;
    const double a = (lower[own] - offset) / factor, b = (upper[own] - offset) / factor;
    lower[leader] = std::max(lower[leader], std::min(a, b));
    upper[leader] = std::min(upper[leader], std::max(a, b));
  }
}

}  // namespace

void Ties::narrow_q(Eigen::Ref<Eigen::VectorXd> lower, Eigen::Ref<Eigen::VectorXd> upper) const {
  narrow(q, q_owners, lower, upper);
}

void Ties::narrow_v(Eigen::Ref<Eigen::VectorXd> lower, Eigen::Ref<Eigen::VectorXd> upper) const {
  narrow(v, v_owners, lower, upper);
}

const dynamics::MimicRule* rule_of(const RobotScene& scene, const std::string& joint) {
  const auto is_of = [&](const dynamics::MimicRule& rule) { return rule.joint == joint; };
  const auto rule = std::find_if(scene.mimics.begin(), scene.mimics.end(), is_of);
  return rule == scene.mimics.end() ? nullptr : &*rule;
}

std::vector<std::string> independent_joints(const RobotScene& scene) {
  std::vector<std::string> names;
  for (const auto& joint : scene.model.joints) {
    if (dynamics::is_single(joint.type) && !rule_of(scene, joint.name)) names.push_back(joint.name);
  }
  return names;
}

std::vector<int> actuated_dofs(const RobotScene& scene) {
  std::vector<int> dofs;
  for (const std::string& name : driven_names(scene)) {
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
  return scene.actuated.empty() ? independent_joints(scene) : scene.actuated;
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
