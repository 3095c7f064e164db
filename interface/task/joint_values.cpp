// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/task/joint_values.h>

#include <cmath>
#include <sstream>

#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using io::Section;

// "0 3.14", or one number for all n.
Eigen::VectorXd from_list(Section& section, const std::string& key, const std::string& text, Eigen::Index n,
                          const io::Range& range) {
  Eigen::VectorXd values = Eigen::VectorXd::Zero(n);
  std::istringstream words(text);
  Eigen::Index count = 0;
  for (std::string word; words >> word; ++count) {
    const std::optional<double> value = io::parse_double(word);
    if (!value) {
      section.problem(key, "'" + key + "' must hold numbers, got '" + word + "'");
    } else if (!std::isfinite(*value)) {
      section.problem(key, "'" + key + "' must be finite, got '" + word + "'");
    } else if (!(*value >= range.low && *value <= range.high)) {
      section.problem(key, "'" + key + "' must be " + range.text + ", got '" + word + "'");
    }
    if (count < n) values[count] = value.value_or(0);
  }
  if (count == 1) {
    values.setConstant(values[0]);
  } else if (count != n) {
    section.problem(key, "'" + key + "' has " + std::to_string(count) + " numbers, the robot has " +
                             std::to_string(n) + " joints");
  }
  return values;
}

}  // namespace

std::vector<std::string> joint_names(const dynamics::Model<double>& model) {
  std::vector<std::string> names;
  for (const auto& joint : model.joints) names.push_back(joint.name);
  return names;
}

Eigen::VectorXd read_joint_values(Section& section, const std::string& key,
                                  const dynamics::Model<double>& model, std::optional<double> fallback,
                                  const io::Range& range) {
  const auto n = static_cast<Eigen::Index>(model.njoints());
  std::vector<Section> blocks = section.children(key);
  if (blocks.empty()) {
    if (!fallback) section.get<std::string>(key);  // notes that it is missing
    return Eigen::VectorXd::Constant(n, fallback.value_or(0));
  }
  if (blocks.size() > 1) section.problem(key, "'" + key + "' is given twice");
  Section& block = blocks.front();
  if (const std::string text = block.value(); !text.empty()) return from_list(section, key, text, n, range);
  Eigen::VectorXd values(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::string& name = model.joints[static_cast<std::size_t>(i)].name;
    const std::string index = "[" + std::to_string(i) + "]", place = "(" + std::to_string(i) + ",0)";
    values[i] = block.get<double>(block.has(index) ? index : block.has(place) ? place : name, range);
  }
  return values;
}

}  // namespace dyntape
