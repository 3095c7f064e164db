// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/joint_values.h>

#include <algorithm>
#include <cmath>

#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using io::Section;

// "; expected 'q', or the joint in 'free' as well"
std::string or_free(const std::vector<std::string>& open, const std::string& expected) {
  return "; expected " + expected + (open.empty() ? "" : ", or the joint in 'free' as well");
}

// Whether all keys of the block are joints, by name or number; else one of them may be what a missing joint is called.
bool names_only(const Section& block, const std::vector<std::string>& joints) {
  const std::vector<std::string> keys = block.keys();
  return std::all_of(keys.begin(), keys.end(), [&](const std::string& key) {
    return key.starts_with('[') || key.starts_with('(') || contains(joints, key);
  });
}

Eigen::VectorXd read_block(Section& block, const std::vector<std::string>& joints, const JointValues& of) {
  Eigen::VectorXd values = Eigen::VectorXd::Zero(Eigen::Index(joints.size()));
  const bool tells_all = names_only(block, joints);
  std::string missing;
  int count = 0;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const std::string& name = joints[i];
    const std::string index = "[" + std::to_string(i) + "]", place = "(" + std::to_string(i) + ",0)";
    const std::string entry = block.has(index) ? index : block.has(place) ? place : name;
    double& value = values[Eigen::Index(i)];
    if (contains(of.open, name)) {
      value = block.get_or(entry, 0.0, of.range);
    } else if (block.has(entry) || !tells_all) {
      value = block.get<double>(entry, of.range);
    } else {
      missing += (count++ > 0 ? "', '" : "'") + name;
    }
  }
  if (count > 0)
    block.problem("", "'" + block.path() + "' leaves joint" + (count > 1 ? "s " : " ") + missing +
                          "' without a value" + or_free(of.open, "one for every joint"));
  return values;
}

Eigen::VectorXd read_values(Section& section, const std::string& key, const std::vector<std::string>& joints,
                            const JointValues& of, bool has_others) {
  const auto n = static_cast<Eigen::Index>(joints.size());
  std::vector<Section> blocks = section.children(key);
  if (blocks.empty()) {
    const auto is_open = [&](const std::string& name) { return contains(of.open, name); };
    const auto closed = std::find_if_not(joints.begin(), joints.end(), is_open);
    if (closed == joints.end() && n > 0) return Eigen::VectorXd::Zero(n);
    if (!of.fallback && !of.open.empty())
      section.problem(key, "'" + section.path() + "' leaves joint '" + *closed + "' without a value" +
                               or_free(of.open, "'" + key + "'"));
    else if (!of.fallback)
      section.get<std::string>(key);  // notes that it is missing
    return Eigen::VectorXd::Constant(n, of.fallback.value_or(0));
  }
  if (blocks.size() > 1) section.problem(key, "'" + key + "' is given twice");
  Section& block = blocks.front();
  if (const std::string text = block.value(); !text.empty())
    return numbers_in(section, key, text, n, of.range,
                      "the robot has " + std::to_string(n) + (n == 1 ? " joint" : " joints") +
                          (has_others ? " of one degree of freedom" : ""),
                      true);
  return read_block(block, joints, of);
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

std::string other_unit(const dynamics::Joint<double>& joint, double value, double lower, double upper) {
  struct Unit {
    const char *name, *of;
    double factor, least;
  };
  const bool slides = joint.type == dynamics::JointType::kPrismatic;
  const Unit unit = slides ? Unit{"millimetres", " m", 1e-3, 10}
                           : Unit{"degrees", " rad", std::acos(-1.0) / 180, 2 * std::acos(-1.0)};
  const double meant = unit.factor * value;
  const bool fits = dynamics::traits(joint.type).on_a_line && lower <= meant && meant <= upper;
  if (!fits || std::abs(value) < unit.least) return "";
  return std::string("; in ") + unit.name + "? " + io::with_digits(value, 6) + " " + unit.name + " are " +
         io::with_digits(meant, 6) + unit.of;
}

Eigen::VectorXd configuration_of(const dynamics::Model<double>& model, const Eigen::VectorXd& joint_values) {
  const Eigen::VectorXd neutral = dynamics::neutral(model);
  return dynamics::integrate<double>(model, neutral, joint_values);
}

Eigen::VectorXd read_joint_values(Section& section, const std::string& key,
                                  const dynamics::Model<double>* model, const JointValues& of) {
  if (!model) {
    const std::string text = of.fallback ? io::shortest(*of.fallback) : "";
    section.defer(key, "a number per joint", of.fallback ? text.c_str() : nullptr);
    return {};
  }
  const auto follows = [&](const std::string& name) {
    return std::any_of(of.followers.begin(), of.followers.end(),
                       [&](const auto& rule) { return rule.joint == name; });
  };
  std::vector<std::string> names = single_joint_names(*model);
  const bool has_others = int(names.size()) < model->njoints();
  std::erase_if(names, follows);
  refuse_followers(section, key, of.followers);
  const Eigen::VectorXd values = read_values(section, key, names, of, has_others);
  Eigen::VectorXd spread = Eigen::VectorXd::Zero(model->nv);
  Eigen::Index k = 0;
  for (const auto& joint : model->joints) {
    if (dynamics::is_single(joint.type) && !follows(joint.name)) spread[joint.idx_v] = values[k++];
  }
  return spread;
}

}  // namespace dyntape
