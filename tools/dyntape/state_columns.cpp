// SPDX-License-Identifier: BSD-3-Clause
#include "state_columns.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/suggest.h>
#include <dyntape/dynamics/algorithms/mimic.h>

#include "commands.h"

namespace dyntape::tools {
namespace {

using dynamics::JointType;

// "a", "b" and "c"; a long list ends with how many more there are.
std::string quoted_list(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kShown); ++i)
    text += (i == 0 ? "\"" : i + 1 == names.size() ? " and \"" : ", \"") + names[i] + "\"";
  return names.size() > kShown ? text + " and " + std::to_string(names.size() - kShown) + " more" : text;
}

// The names of one block's entries by joint, "" where an entry has none: of joints of several entries, and followers.
std::vector<std::string> names_by_joint(const dynamics::MimicModel<double>& robot, const RobotBlock& block) {
  std::vector<std::string> names(static_cast<std::size_t>(block.size()));
  const bool is_q = block.name == "q";
  for (const auto& joint : robot.full.joints) {
    const auto idx = static_cast<std::size_t>(is_q ? joint.idx_q : joint.idx_v);
    const int full = static_cast<int>(idx);
    const int entry = (is_q ? robot.q_entries : robot.v_entries)[idx].index;
    const bool is_own = (is_q ? robot.q_owners : robot.v_owners)[static_cast<std::size_t>(entry)] == full;
    if (dynamics::nv(joint.type) != 1 || !is_own) continue;
    for (int k = 0; k < (is_q ? dynamics::nq(joint.type) : 1); ++k)
      names[static_cast<std::size_t>(entry + k)] = block.name + "." + joint.name;
  }
  return names;
}

std::string expected_columns(const std::vector<std::string>& numbered,
                             const std::vector<std::string>& named) {
  std::string text = "; expected " + numbered.front() + " to " + numbered.back() + " (" +
                     std::to_string(numbered.size()) + " columns)";
  const auto first =
      std::find_if(named.begin(), named.end(), [](const std::string& name) { return !name.empty(); });
  return first == named.end() ? text : text + ", or " + *first + " and so on";
}

}  // namespace

void add_column_options(CLI::App& command, ColumnOptions& options) {
  command.add_flag("--pass-over", options.pass_over, "ignore columns that are not inputs");
  command.add_flag("--fill-zero", options.fill_zero,
                   "inputs without a column are zero, e.g. torques of joints without a motor");
}

StateColumns::StateColumns(const io::CsvTable& table, const dynamics::UrdfRobot& robot,
                           const std::vector<RobotBlock>& inputs, const std::string& file,
                           const ColumnOptions& options)
    : file_(file) {
  const dynamics::MimicModel<double> model(robot.model, robot.mimics);
  for (const auto& joint : robot.model.joints) {
    const int begin = model.q_entries[static_cast<std::size_t>(joint.idx_q)].index;
    if (model.q_owners[static_cast<std::size_t>(begin)] != joint.idx_q) continue;
    if (joint.type == JointType::kContinuous) directions_.push_back({joint.name, begin, 2});
    if (joint.type == JointType::kPlanar) directions_.push_back({joint.name, begin + 2, 2});
    if (joint.type == JointType::kSpherical) directions_.push_back({joint.name, begin, 4});
    if (joint.type == JointType::kFreeFlyer) directions_.push_back({joint.name, begin + 3, 4});
  }
  std::vector<std::string> numbered, named;
  for (const RobotBlock& block : inputs) {
    for (const std::string& name : tools::numbered(block.name, block.size())) numbered.push_back(name);
    for (const std::string& name : names_by_joint(model, block)) named.push_back(name);
  }
  const std::string head = file + ":1: ", expected = expected_columns(numbered, named);
  std::unordered_set<std::string> known(numbered.begin(), numbered.end());
  // Messages name missing columns as the file does.
  const bool is_by_joint =
      std::any_of(named.begin(), named.end(), [&](const std::string& name) { return table.has(name); });
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < numbered.size(); ++i) {
    const bool has_number = table.has(numbered[i]), has_name = !named[i].empty() && table.has(named[i]);
    if (has_number && has_name)
      throw FileError(head + "columns " + quoted_list({numbered[i], named[i]}) +
                      " are the same input; expected one of them");
    const bool is_second = i > 0 && !named[i].empty() && named[i] == named[i - 1];
    const bool is_pair = is_second || (i + 1 < named.size() && !named[i].empty() && named[i] == named[i + 1]);
    Source source;
    if (has_number) source.column = table.index(numbered[i]);
    if (has_name) source.column = table.index(named[i]);
    if (has_name && is_pair) source.meaning = is_second ? Meaning::kSine : Meaning::kCosine;
    if (has_name) known.insert(named[i]);
    if (source.column < 0) missing.push_back(is_by_joint && !named[i].empty() ? named[i] : numbered[i]);
    sources_.push_back(source);
  }
  std::vector<std::string> others;
  for (const std::string& name : table.names()) {
    if (!known.count(name)) others.push_back(name);
  }
  if (missing.size() == numbered.size() || (!missing.empty() && !options.fill_zero)) {
    const bool is_partly = missing.size() < numbered.size();
    throw FileError(head + (missing.size() == 1 ? "no column " : "no columns ") + quoted_list(missing) +
                    expected + ", got " + std::to_string(table.cols()) +
                    (is_partly ? "; --fill-zero takes zeros for them" : ""));
  }
  if (!others.empty() && !options.pass_over) {
    throw FileError(head + (others.size() == 1 ? "column " : "columns ") + quoted_list(others) +
                    (others.size() == 1 ? " is not an input" : " are not inputs") + expected +
                    "; --pass-over reads the file without");
  }
}

void StateColumns::read(const io::CsvTable& table, int row, std::vector<double>& state) const {
  state.resize(sources_.size());
  for (std::size_t k = 0; k < sources_.size(); ++k) {
    const Source& source = sources_[k];
    const double value = source.column < 0 ? 0 : table(row, source.column);
    state[k] = source.meaning == Meaning::kCosine ? std::cos(value)
               : source.meaning == Meaning::kSine ? std::sin(value)
                                                  : value;
  }
  check_directions(row, state);
}

void StateColumns::check_directions(int row, const std::vector<double>& state) const {
  for (const Direction& d : directions_) {
    const auto begin = state.begin() + d.begin, end = begin + d.size;
    if (std::any_of(begin, end, [](double x) { return x != 0; })) continue;
    throw FileError(file_ + ": row " + std::to_string(row + 1) + ": the " +
                    (d.size == 2 ? "pair (cos, sin)" : "quaternion") + " of joint \"" + d.joint + "\", q" +
                    std::to_string(d.begin) + " to q" + std::to_string(d.begin + d.size - 1) +
                    ", is zero; expected any length but zero");
  }
}

}  // namespace dyntape::tools
