// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/scene/left_out.h>

#include <algorithm>
#include <cmath>

namespace dyntape {

namespace {

using dynamics::Joint;
using dynamics::JointLimits;

constexpr const char* kLeftOut = ": of the robot's file this leaves out ";

// "damping of 'knee'", "damping of 12 joints"; "" of none.
template <class Has>
std::string of_joints(const dynamics::Model<double>& model, const std::string& what, const Has& has) {
  std::vector<std::string> names;
  for (const Joint<double>& joint : model.joints) {
    if (has(joint)) names.push_back(joint.name);
  }
  if (names.empty()) return "";
  return what + " of " +
         (names.size() == 1 ? "'" + names[0] + "'" : std::to_string(names.size()) + " joints");
}

void append(std::vector<std::string>& items, const std::string& item, const std::string& remedy = "") {
  if (!item.empty()) items.push_back(item + (remedy.empty() ? "" : " (" + remedy + ")"));
}

void append_damping_and_friction(std::vector<std::string>& items, const RobotScene& scene) {
  const bool damps = bool(scene.effects.damping), rubs = bool(scene.effects.friction);
  append(items,
         of_joints(scene.model, "damping",
                   [&](const Joint<double>& j) { return j.damping != 0 && (!damps || !is_single(j.type)); }),
         damps ? "" : "'effects { joint_damping robot }' has it act");
  append(items,
         of_joints(scene.model, "friction",
                   [&](const Joint<double>& j) { return j.friction != 0 && (!rubs || !is_single(j.type)); }),
         rubs ? "" : "'effects { joint_friction { torque robot  smoothing 0.01 } }' has it act");
}

void append_limits(std::vector<std::string>& items, const RobotScene& scene, LimitsOfFile limits) {
  const bool holds_all = limits == LimitsOfFile::kHeld;
  const bool stops = holds_all || scene.effects.limits || !scene.constraints.rigid.stops.empty();
  const bool saturates = holds_all || scene.effects.saturation;
  append(items,
         of_joints(scene.model, "position limits",
                   [&](const Joint<double>& j) {
                     return !stops && is_single(j.type) &&
                            (std::isfinite(j.limits.lower) || std::isfinite(j.limits.upper));
                   }),
         "'constraints { limits }' or 'effects { joint_limits }' holds them");
  append(items,
         of_joints(scene.model, "effort limits",
                   [&](const Joint<double>& j) {
                     return (!saturates || !is_single(j.type)) && std::isfinite(j.limits.effort);
                   }),
         saturates ? "" : "'effects { torque_saturation robot }' has them act");
  append(items, of_joints(scene.model, "velocity limits", [&](const Joint<double>& j) {
           return (!holds_all || !is_single(j.type)) && std::isfinite(j.limits.velocity);
         }));
}

}  // namespace

void note_left_out(std::vector<std::string>& notes, const std::string& urdf,
                   const std::vector<std::string>& elements, const RobotScene& scene, LimitsOfFile limits) {
  const auto is_such = [](const std::string& note) { return note.find(kLeftOut) != note.npos; };
  notes.erase(std::remove_if(notes.begin(), notes.end(), is_such), notes.end());
  std::vector<std::string> items;
  append_damping_and_friction(items, scene);
  append_limits(items, scene, limits);
  for (const std::string& element : elements)
    append(
        items, element,
        element.starts_with("<collision> of")
            ? "'contacts { contact { shapes collision ... } }' in 'effects' or 'constraints' has them touch"
            : "");
  if (items.empty()) return;
  std::string note = urdf + kLeftOut;
  for (std::size_t i = 0; i < items.size(); ++i)
    note += (i == 0 ? "" : i + 1 == items.size() ? " and " : ", ") + items[i];
  notes.push_back(std::move(note));
}

}  // namespace dyntape
