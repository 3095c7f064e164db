// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/model_parameters.h>

#include <algorithm>
#include <map>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/autodiff/suggest.h>

namespace dyntape {
namespace {

using dynamics::Model;

// The body of a joint or of a link of that name.
int body_of(const Model<double>& model, const std::string& name, const std::string& whole) {
  for (int i = 0; i < model.njoints(); ++i) {
    if (model.joints[i].name == name) return i;
  }
  for (const dynamics::Frame<double>& frame : model.frames) {
    if (frame.name != name) continue;
    if (frame.body >= 0) return frame.body;
    throw ArgumentError("design: \"" + whole + "\": link \"" + name + "\" is fixed to the world");
  }
  std::vector<std::string> names = dynamics::detail::names_of(model.joints);
  for (const std::string& frame : dynamics::detail::names_of(model.frames)) names.push_back(frame);
  throw ArgumentError("design: \"" + whole + "\": model \"" + model.name + "\" has no joint or link \"" +
                      name + "\"" + suggestion(name, names));
}

}  // namespace

ModelParameters::ModelParameters(const Model<double>& model, const std::vector<std::string>& names)
    : model_(model), names_(names) {
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (std::find(names.begin(), names.begin() + static_cast<long>(k), names[k]) !=
        names.begin() + static_cast<long>(k))
      throw ArgumentError("design: \"" + names[k] + "\" is named twice");
    parts_.push_back(part_from(names[k]));
  }
}

ModelParameters::Part ModelParameters::part_from(const std::string& name) const {
  static const std::map<std::string, Part> kKinds = {{"mass", {Kind::kMass}},
                                                     {"comx", {Kind::kCom, 0, 0}},
                                                     {"comy", {Kind::kCom, 0, 1}},
                                                     {"comz", {Kind::kCom, 0, 2}},
                                                     {"Ixx", {Kind::kInertia, 0, 0, 0}},
                                                     {"Ixy", {Kind::kInertia, 0, 0, 1}},
                                                     {"Iyy", {Kind::kInertia, 0, 1, 1}},
                                                     {"Ixz", {Kind::kInertia, 0, 0, 2}},
                                                     {"Iyz", {Kind::kInertia, 0, 1, 2}},
                                                     {"Izz", {Kind::kInertia, 0, 2, 2}},
                                                     {"length", {Kind::kLength}},
                                                     {"armature", {Kind::kArmature}},
                                                     {"gravity", {Kind::kGravity}}};
  const std::size_t colon = name.find(':');
  const std::string what = name.substr(0, colon),
                    whose = colon == std::string::npos ? "" : name.substr(colon + 1);
  const auto found = kKinds.find(what);
  if (found == kKinds.end() || whose.empty()) {
    std::vector<std::string> kinds;
    for (const auto& [kind, part] : kKinds) kinds.push_back(kind);
    throw ArgumentError("design: \"" + name + "\" is not of the form mass:forearm_link or gravity:z" +
                        suggestion(what, kinds));
  }
  Part part = found->second;
  if (part.kind == Kind::kGravity) {
    if (whose != "x" && whose != "y" && whose != "z")
      throw ArgumentError("design: \"" + name + "\": expected gravity:x, gravity:y or gravity:z");
    part.row = whose[0] - 'x';
    return part;
  }
  const bool of_joint = part.kind == Kind::kLength || part.kind == Kind::kArmature;
  part.index = of_joint ? model_.joint_index(whose) : body_of(model_, whose, name);
  if (part.kind == Kind::kLength && model_.X_PJ[part.index].p.isZero(0))
    throw ArgumentError("design: \"" + name +
                        "\": the joint is at the origin of its parent, there is no length");
  if (part.kind == Kind::kArmature && !is_single(model_.joints[part.index].type))
    throw ArgumentError("design: \"" + name + "\": a " + to_string(model_.joints[part.index].type) +
                        " joint has no armature");
  return part;
}

std::vector<double> ModelParameters::nominal() const {
  std::vector<double> values;
  for (const Part& part : parts_) values.push_back(part.kind == Kind::kLength ? 1 : entry(model_, part));
  return values;
}

Function record_design(const Model<double>& model, const ModelParameters& design, std::size_t n_state,
                       const RobotProgram& program, DesignAs as, const char* file, int line) {
  const bool variables = as == DesignAs::kVariables;
  RecordOptions options;
  (variables ? options.variables : options.parameters) = design.nominal();
  (variables ? options.variable_names : options.parameter_names) = design.names();
  const std::size_t n_x = variables ? design.size() : n_state, n_p = variables ? n_state : design.size();
  return record(
      model.name + "_design", n_x, n_p,
      [&](const VectorXad& x, const VectorXad& p) {
        return program(design.apply<AD>(variables ? x : p), variables ? p : x);
      },
      options, file, line);
}

}  // namespace dyntape
