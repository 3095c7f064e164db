// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape info: what a robot file says, as a tree and as a table.
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include <dyntape/dynamics/algorithms/mimic.h>
#include <dyntape/dynamics/urdf/check.h>
#include <dyntape/interface/files/scene/folded_notes.h>
#include <dyntape/interface/io/table.h>

#include "commands.h"

namespace dyntape::tools {
namespace {

using dynamics::Joint;
using dynamics::MimicModel;
using dynamics::MimicRule;
using dynamics::Model;
using io::significant;

double total_mass(const Model<double>& model) {
  double mass = 0;
  for (const auto& inertia : model.inertias) mass += inertia.mass;
  return mass;
}

nlohmann::json limit(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

// The rule that joint i follows, null for most.
const MimicRule* rule_of(const MimicModel<double>& robot, int i) {
  for (const MimicRule& rule : robot.rules) {
    if (rule.joint == robot.full.joints[i].name) return &rule;
  }
  return nullptr;
}

// A follower's entries are its leader's, and it has none of its own.
nlohmann::json to_json(const dynamics::UrdfRobot& file) {
  const MimicModel<double> robot(file.model, file.mimics);
  const Model<double>& model = robot.full;
  nlohmann::json joints = nlohmann::json::array();
  for (int i = 0; i < model.njoints(); ++i) {
    const Joint<double>& joint = model.joints[i];
    const MimicRule* rule = rule_of(robot, i);
    joints.push_back({{"name", joint.name},
                      {"type", to_string(joint.type)},
                      {"parent", model.parent[i] < 0 ? "world" : model.joints[model.parent[i]].name},
                      {"idx_q", robot.q_entries[joint.idx_q].index},
                      {"nq", rule ? 0 : dynamics::nq(joint.type)},
                      {"idx_v", robot.v_entries[joint.idx_v].index},
                      {"nv", rule ? 0 : dynamics::nv(joint.type)},
                      {"axis", {joint.axis[0], joint.axis[1], joint.axis[2]}},
                      {"mass", model.inertias[i].mass},
                      {"lower", limit(joint.limits.lower)},
                      {"upper", limit(joint.limits.upper)},
                      {"velocity", limit(joint.limits.velocity)},
                      {"effort", limit(joint.limits.effort)}});
    if (rule) {
      joints.back()["mimic"] = {
          {"joint", rule->leader}, {"multiplier", rule->multiplier}, {"offset", rule->offset}};
    }
  }
  nlohmann::json frames = nlohmann::json::array();
  for (const auto& frame : model.frames) {
    frames.push_back(
        {{"name", frame.name}, {"joint", frame.body < 0 ? "world" : model.joints[frame.body].name}});
  }
  return {{"name", model.name}, {"nq", robot.nq},   {"nv", robot.nv},     {"mass", total_mass(model)},
          {"joints", joints},   {"frames", frames}, {"notes", file.notes}};
}

std::string axis_text(const Joint<double>& joint) {
  if (!dynamics::is_single(joint.type)) return "";
  const char* const names[] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) {
    if (std::abs(joint.axis[k]) == 1) return (joint.axis[k] < 0 ? "-" : "") + std::string(names[k]);
  }
  return significant(joint.axis[0], 3) + " " + significant(joint.axis[1], 3) + " " +
         significant(joint.axis[2], 3);
}

std::string range_text(const Joint<double>& joint) {
  const auto bound = [](double b) { return std::isfinite(b) ? significant(b, 4) : std::string("-"); };
  if (!dynamics::is_single(joint.type)) return "";
  return bound(joint.limits.lower) + " .. " + bound(joint.limits.upper);
}

// "finger_1", "-2 x finger_1 + 0.5".
std::string rule_text(const MimicRule& rule) {
  const std::string times = rule.multiplier == 1 ? "" : significant(rule.multiplier, 6) + " x ";
  const std::string sign = rule.offset < 0 ? " - " : " + ";
  return times + rule.leader + (rule.offset == 0 ? "" : sign + significant(std::abs(rule.offset), 6));
}

// Children of each joint; the last entry are the joints on the world.
std::vector<std::vector<int>> children_of(const Model<double>& model) {
  std::vector<std::vector<int>> children(static_cast<std::size_t>(model.njoints()) + 1);
  for (int i = 0; i < model.njoints(); ++i) {
    children[model.parent[i] < 0 ? children.size() - 1 : static_cast<std::size_t>(model.parent[i])].push_back(
        i);
  }
  return children;
}

// The tree as lines in the order of the joints: branches drawn before each name.
std::vector<std::string> tree_lines(const Model<double>& model) {
  const auto children = children_of(model);
  std::vector<std::string> prefix(static_cast<std::size_t>(model.njoints())), line(prefix.size());
  const auto draw = [&](const std::vector<int>& siblings, const std::string& before) {
    // A single child continues the line of its parent, so that a chain does not drift to the right.
    const bool fork = siblings.size() > 1;
    for (std::size_t k = 0; k < siblings.size(); ++k) {
      const bool last = k + 1 == siblings.size();
      const auto i = static_cast<std::size_t>(siblings[k]);
      line[i] = before + (fork ? (last ? "└─ " : "├─ ") : "") + model.joints[i].name;
      prefix[i] = before + (fork ? (last ? "   " : "│  ") : "");
    }
  };
  draw(children.back(), "");
  for (std::size_t i = 0; i < line.size(); ++i) draw(children[i], prefix[i]);  // parents precede children
  return line;
}

// Links by the joint that carries them: the names that tasks and scenes use.
void print_frames(const Model<double>& model) {
  std::vector<std::string> links(static_cast<std::size_t>(model.njoints()) + 1);  // the world's first
  for (const auto& frame : model.frames) {
    std::string& names = links[static_cast<std::size_t>(frame.body + 1)];
    names += (names.empty() ? "" : " ") + frame.name;
  }
  io::TextTable table({{"joint"}, {"links that it carries"}});
  for (int i = -1; i < model.njoints(); ++i) {
    const std::string& names = links[static_cast<std::size_t>(i + 1)];
    if (!names.empty()) table.append({i < 0 ? "(the world)" : model.joints[i].name, names});
  }
  std::cout << "\n" << table.text();
}

void print(const dynamics::UrdfRobot& file, bool verbose) {
  const MimicModel<double> robot(file.model, file.mimics);
  const Model<double>& model = robot.full;
  std::cout << model.name << ": " << model.njoints() << " joints, nq " << robot.nq << ", nv " << robot.nv
            << ", " << significant(total_mass(model), 6) << " kg, " << model.frames.size() << " frames\n\n";
  io::TextTable table({{"joint"},
                       {"type"},
                       {"axis"},
                       {"q", "", io::Align::kRight},
                       {"v", "", io::Align::kRight},
                       {"range"},
                       {"velocity", "", io::Align::kRight},
                       {"effort", "", io::Align::kRight},
                       {"mass", "kg", io::Align::kRight}});
  const std::vector<std::string> lines = tree_lines(model);
  for (int i = 0; i < model.njoints(); ++i) {
    const Joint<double>& joint = model.joints[i];
    const auto bound = [](double b) { return std::isfinite(b) ? significant(b, 4) : std::string("-"); };
    table.append({lines[static_cast<std::size_t>(i)], to_string(joint.type), axis_text(joint),
                  std::to_string(robot.q_entries[joint.idx_q].index),
                  std::to_string(robot.v_entries[joint.idx_v].index), range_text(joint),
                  bound(joint.limits.velocity), bound(joint.limits.effort),
                  significant(model.inertias[i].mass, 4)});
  }
  std::cout << table.text();
  print_frames(model);
  if (!robot.rules.empty()) std::cout << "\n";
  for (const MimicRule& rule : robot.rules)
    std::cout << "mimic: " << rule.joint << " = " << rule_text(rule) << "\n";
  if (!file.notes.empty() || !file.left_out.empty()) std::cout << "\n";
  for (const std::string& element : file.left_out) std::cout << "left out: " << element << "\n";
  std::vector<std::string> notes = file.notes;
  for (std::string& note : notes)
    if (note.ends_with(dynamics::kReadAsIndependent)) note += "; --mimic has it follow";
  for (const std::string& note : verbose ? notes : folded(notes)) std::cout << "note: " << note << "\n";
}

}  // namespace

void add_info(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("info", "print the tree of a robot: joints, indices, limits, masses, links, notes");
  const auto options = std::make_shared<RobotOptions>();
  const auto json = std::make_shared<bool>(false), verbose = std::make_shared<bool>(false);
  add_robot_options(*command, *options);
  command->add_flag("--verbose", *verbose, "print every note, also repeated ones");
  command->add_flag("--json", *json,
                    "print JSON: nq, nv, mass, joints (name, type, idx_q, idx_v, nv, ...), frames");
  command->callback([options, json, verbose] {
    const dynamics::UrdfRobot robot = load_robot(*options);
    if (*json) {
      print_json(to_json(robot));
    } else {
      print(robot, *verbose);
    }
  });
}

}  // namespace dyntape::tools
