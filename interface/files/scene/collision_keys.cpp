// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/scene/collision_keys.h>

#include <algorithm>

#include <dyntape/interface/files/lists.h>

namespace dyntape {

namespace {

using dynamics::CollisionSphere;
using io::Section;

bool holds(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// In place of "<collision> of 8 links": those whose shapes touch nothing, as they are meshes.
void note_what_is_left(std::vector<std::string>& left_out, std::vector<std::string> meshes) {
  left_out.erase(std::remove_if(left_out.begin(), left_out.end(),
                                [](const std::string& kind) { return kind.starts_with("<collision>"); }),
                 left_out.end());
  std::sort(meshes.begin(), meshes.end());
  meshes.erase(std::unique(meshes.begin(), meshes.end()), meshes.end());
  if (meshes.empty()) return;
  left_out.push_back("<collision> meshes of " + (meshes.size() == 1
                                                     ? "link \"" + meshes[0] + "\""
                                                     : std::to_string(meshes.size()) + " links"));
}

}  // namespace

std::optional<std::vector<CollisionSphere>> read_collision_shapes(Section& block, const KeyedRobot& robot) {
  block.about("collision: spheres, corners of boxes and rims of cylinders of the robot's file");
  if (!block.has("shapes")) return std::nullopt;
  block.choice_or<int>("shapes", "collision", {{"collision", 0}});
  if (block.has("radius")) block.problem("radius", "'radius' is given beside 'shapes', which have their own");
  std::vector<CollisionSphere> spheres;
  if (!robot.model) return spheres;
  std::vector<std::string> links;
  for (const auto& frame : robot.model->frames) links.push_back(frame.name);
  block.about("links that touch; absent: all that have shapes");
  const std::vector<std::string> named = distinct_names(block, "frames", links);
  const dynamics::UrdfCollisions found = dynamics::read_collisions(robot.urdf, *robot.model);
  for (const std::string& note : found.notes) block.problem("shapes", note);
  for (const CollisionSphere& sphere : found.spheres) {
    if (sphere.body >= 0 && (named.empty() || holds(named, sphere.link))) spheres.push_back(sphere);
  }
  const char* const expected =
      "; expected a <sphere>, <box> or <cylinder> in a <collision> of a link that moves";
  for (const std::string& link : named) {
    const bool has =
        std::any_of(spheres.begin(), spheres.end(), [&](const auto& s) { return s.link == link; });
    if (holds(links, link) && !has)
      block.problem("frames", "'" + link + "' touches nothing" +
                                  (holds(found.meshes, link) ? ", its shape being a mesh" : "") + expected);
  }
  if (named.empty() && spheres.empty())
    block.problem("shapes", "nothing of the robot touches" + std::string(expected));
  if (robot.left_out) note_what_is_left(*robot.left_out, found.meshes);
  return spheres;
}

}  // namespace dyntape
