// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape info: what a robot file says, as a tree and as a table.
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include <dyntape/interface/io/table.h>

#include "commands.h"

namespace dyntape::tools {
namespace {

using dynamics::Joint;
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

nlohmann::json to_json(const dynamics::UrdfRobot& robot) {
  const Model<double>& model = robot.model;
  nlohmann::json joints = nlohmann::json::array();
  for (int i = 0; i < model.njoints(); ++i) {
    const Joint<double>& joint = model.joints[i];
    joints.push_back({{"name", joint.name},
                      {"type", to_string(joint.type)},
                      {"parent", model.parent[i] < 0 ? "world" : model.joints[model.parent[i]].name},
                      {"idx_q", joint.idx_q},
                      {"nq", dynamics::nq(joint.type)},
                      {"idx_v", joint.idx_v},
                      {"nv", dynamics::nv(joint.type)},
                      {"axis", {joint.axis[0], joint.axis[1], joint.axis[2]}},
                      {"mass", model.inertias[i].mass},
                      {"lower", limit(joint.limits.lower)},
                      {"upper", limit(joint.limits.upper)},
                      {"velocity", limit(joint.limits.velocity)},
                      {"effort", limit(joint.limits.effort)}});
  }
  nlohmann::json frames = nlohmann::json::array();
  for (const auto& frame : model.frames) {
    frames.push_back(
        {{"name", frame.name}, {"joint", frame.body < 0 ? "world" : model.joints[frame.body].name}});
  }
  return {{"name", model.name}, {"nq", model.nq},   {"nv", model.nv},      {"mass", total_mass(model)},
          {"joints", joints},   {"frames", frames}, {"notes", robot.notes}};
}

std::string axis_text(const Joint<double>& joint) {
  if (joint.type == dynamics::JointType::kFreeFlyer) return "";
  const char* const names[] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) {
    if (std::abs(joint.axis[k]) == 1) return (joint.axis[k] < 0 ? "-" : "") + std::string(names[k]);
  }
  return significant(joint.axis[0], 3) + " " + significant(joint.axis[1], 3) + " " +
         significant(joint.axis[2], 3);
}

std::string range_text(const Joint<double>& joint) {
  const auto bound = [](double b) { return std::isfinite(b) ? significant(b, 4) : std::string("-"); };
  if (joint.type == dynamics::JointType::kFreeFlyer) return "";
  return bound(joint.limits.lower) + " .. " + bound(joint.limits.upper);
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

void print(const dynamics::UrdfRobot& robot) {
  const Model<double>& model = robot.model;
  std::cout << model.name << ": " << model.njoints() << " joints, nq " << model.nq << ", nv " << model.nv
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
                  std::to_string(joint.idx_q), std::to_string(joint.idx_v), range_text(joint),
                  bound(joint.limits.velocity), bound(joint.limits.effort),
                  significant(model.inertias[i].mass, 4)});
  }
  std::cout << table.text();
  if (!robot.notes.empty()) std::cout << "\n";
  for (const std::string& note : robot.notes) std::cout << "note: " << note << "\n";
}

}  // namespace

void add_info(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("info", "print the tree of a robot: joints, indices, limits, masses, notes");
  const auto options = std::make_shared<RobotOptions>();
  const auto json = std::make_shared<bool>(false);
  add_robot_options(*command, *options);
  command->add_flag("--json", *json,
                    "for programs: nq, nv, mass, joints (name, type, idx_q, idx_v, nv, ...), frames");
  command->callback([options, json] {
    const dynamics::UrdfRobot robot = load_robot(*options);
    if (*json) {
      std::cout << to_json(robot).dump(2) << "\n";
    } else {
      print(robot);
    }
  });
}

}  // namespace dyntape::tools
