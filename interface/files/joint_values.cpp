// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/joint_values.h>

#include <algorithm>

#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using io::Section;

Eigen::VectorXd read_values(Section& section, const std::string& key, const std::vector<std::string>& joints,
                            std::optional<double> fallback, const io::Range& range, bool has_others,
                            const std::vector<std::string>& open) {
  const auto n = static_cast<Eigen::Index>(joints.size());
  std::vector<Section> blocks = section.children(key);
  const auto is_open = [&](const std::string& name) { return contains(open, name); };
  if (blocks.empty()) {
    const auto closed = std::find_if_not(joints.begin(), joints.end(), is_open);
    if (closed == joints.end() && n > 0) return Eigen::VectorXd::Zero(n);
    if (!fallback && !open.empty())
      section.problem(key, "'" + section.path() + "' leaves joint '" + *closed +
                               "' without a value; expected '" + key + "', or the joint in 'free' as well");
    else if (!fallback)
      section.get<std::string>(key);  // notes that it is missing
    return Eigen::VectorXd::Constant(n, fallback.value_or(0));
  }
  if (blocks.size() > 1) section.problem(key, "'" + key + "' is given twice");
  Section& block = blocks.front();
  if (const std::string text = block.value(); !text.empty())
    return numbers_in(section, key, text, n, range,
                      "the robot has " + std::to_string(n) + (n == 1 ? " joint" : " joints") +
                          (has_others ? " of one degree of freedom" : ""),
                      true);
  Eigen::VectorXd values(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::string& name = joints[static_cast<std::size_t>(i)];
    const std::string index = "[" + std::to_string(i) + "]", place = "(" + std::to_string(i) + ",0)";
    const std::string entry = block.has(index) ? index : block.has(place) ? place : name;
    values[i] = is_open(name) ? block.get_or(entry, 0.0, range) : block.get<double>(entry, range);
  }
  return values;
}

// Notes values by name of joints that follow others.
void refuse_followers(Section& section, const std::string& key,
                      const std::vector<dynamics::MimicRule>& followers) {
  for (Section& block : section.children(key)) {
    for (const dynamics::MimicRule& rule : followers) {
      if (block.has(rule.joint))
        block.problem(rule.joint, "joint '" + rule.joint + "' follows '" + rule.leader +
                                      "' and has no value of its own; expected one for '" + rule.leader +
                                      "'");
    }
  }
}

}  // namespace

std::vector<std::string> joint_names(const dynamics::Model<double>& model) {
  std::vector<std::string> names;
  for (const auto& joint : model.joints) names.push_back(joint.name);
  return names;
}

std::vector<std::string> single_joint_names(const dynamics::Model<double>& model) {
  std::vector<std::string> names;
  for (const auto& joint : model.joints) {
    if (dynamics::is_single(joint.type)) names.push_back(joint.name);
  }
  return names;
}

std::vector<int> single_dofs(const dynamics::Model<double>& model) {
  std::vector<int> dofs;
  for (const auto& joint : model.joints) {
    if (dynamics::is_single(joint.type)) dofs.push_back(joint.idx_v);
  }
  return dofs;
}

Eigen::VectorXd configuration_of(const dynamics::Model<double>& model, const Eigen::VectorXd& joint_values) {
  const Eigen::VectorXd neutral = dynamics::neutral(model);
  return dynamics::integrate<double>(model, neutral, joint_values);
}

Eigen::VectorXd read_joint_values(Section& section, const std::string& key,
                                  const dynamics::Model<double>* model, std::optional<double> fallback,
                                  const io::Range& range, const std::vector<std::string>& open,
                                  const std::vector<dynamics::MimicRule>& followers) {
  if (!model) {
    const std::string text = fallback ? io::shortest(*fallback) : "";
    section.defer(key, "a number per joint", fallback ? text.c_str() : nullptr);
    return {};
  }
  const auto follows = [&](const std::string& name) {
    return std::any_of(followers.begin(), followers.end(),
                       [&](const auto& rule) { return rule.joint == name; });
  };
  std::vector<std::string> names = single_joint_names(*model);
  const bool has_others = int(names.size()) < model->njoints();
  std::erase_if(names, follows);
  refuse_followers(section, key, followers);
  const Eigen::VectorXd values = read_values(section, key, names, fallback, range, has_others, open);
  Eigen::VectorXd spread = Eigen::VectorXd::Zero(model->nv);
  Eigen::Index k = 0;
  for (const auto& joint : model->joints) {
    if (dynamics::is_single(joint.type) && !follows(joint.name)) spread[joint.idx_v] = values[k++];
  }
  return spread;
}

}  // namespace dyntape
