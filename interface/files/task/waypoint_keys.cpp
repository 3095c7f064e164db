// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/task/waypoint_keys.h>

#include <algorithm>
#include <cmath>

#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/task/place_keys.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/motion/robot_configuration.h>

namespace dyntape {

using io::Section;

namespace {

const io::Range kOnTheWay{
    .low = 0, .high = 1, .low_open = true, .high_open = true, .text = "above 0 and below 1"};

// Of one instant: two configurations, a configuration and a place, or two places of one frame.
bool say_the_same(const TaskWaypoint& a, const TaskWaypoint& b) {
  if (std::abs(a.at - b.at) > 1e-9) return false;
  if (!a.target || !b.target) return true;
  const bool both =
      (a.target->position && b.target->position) || (a.target->orientation && b.target->orientation);
  return a.target->frame == b.target->frame && both;
}

}  // namespace

std::vector<TaskWaypoint> read_waypoints(Section& file, const dynamics::Model<double>* model) {
  if (!file.about("where the motion passes on its way").has("waypoints")) return {};
  Section list = file.child("waypoints");
  std::vector<TaskWaypoint> waypoints;
  if (!list.about("one of them; its name behind the word").has("waypoint")) return {};
  std::vector<Section> blocks = list.children("waypoint");
  if (blocks.empty()) blocks.push_back(list.child("waypoint"));
  for (Section& block : blocks) {
    TaskWaypoint w;
    w.name = block.value();
    if (w.name.empty()) w.name = std::to_string(waypoints.size() + 1);
    w.at = block.about("when, as a share of the duration").get<double>("at", kOnTheWay);
    const bool has_frame = block.has("frame");
    w.target = read_frame_target(block, model);
    block.about("positions of the joints, in place of frame [rad or m]");
    if (!model) {
      block.defer("q", "numbers by joint", "");
    } else if (!has_frame || block.has("q")) {
      w.q = read_joint_values(block, "q", model, std::nullopt);
      if (has_frame)
        block.problem("q", "'" + block.path() + "' has both 'frame' and 'q', expected one of them");
    }
    for (const TaskWaypoint& other : waypoints) {
      if (model && other.name == w.name)
        block.problem("", "'" + w.name + "' names two of 'waypoints', expected one");
      if (model && say_the_same(w, other))
        block.problem("at", "'" + w.name + "' says where the motion passes at " + io::shortest(w.at) +
                                ", as '" + other.name +
                                "' does at that instant; expected one of them, or another 'at'");
    }
    waypoints.push_back(std::move(w));
  }
  std::stable_sort(waypoints.begin(), waypoints.end(),
                   [](const TaskWaypoint& a, const TaskWaypoint& b) { return a.at < b.at; });
  return waypoints;
}

Term term_of(const TaskWaypoint& waypoint, const RobotScene& scene) {
  const std::string name = "waypoint " + waypoint.name;
  if (waypoint.target)
    return at_fraction(waypoint.at, path_equality(name, frame_error(scene, *waypoint.target)));
  const StageFunction off = configuration_error(scene, configuration_of(scene.model, waypoint.q));
  return at_fraction(waypoint.at, path_equality(name, entries_of(off, single_dofs(scene.model))));
}

}  // namespace dyntape
