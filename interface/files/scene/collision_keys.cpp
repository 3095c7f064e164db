// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/scene/collision_keys.h>

#include <algorithm>

#include <dyntape/interface/files/lists.h>

namespace dyntape {

namespace {

using dynamics::CollisionSphere;
using io::Section;

std::vector<std::string> frame_names(const dynamics::Model<double>& model) {
  std::vector<std::string> names;
  for (const auto& frame : model.frames) names.push_back(frame.name);
  return names;
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

std::vector<std::string> read_frames(Section& block, const std::string& meaning,
                                     const dynamics::Model<double>* model) {
  block.about(meaning);
  if (!model) {
    block.defer("frames", "names of links");
    return {};
  }
  const std::vector<std::string> names = distinct_names(block, "frames", frame_names(*model));
  if (names.empty() && block.has("frames")) block.problem("frames", "'frames' names no link");
  if (names.empty()) block.get<std::string>("frames");  // notes that it is missing
  return names;
}

std::optional<std::vector<CollisionSphere>> read_collision_shapes(Section& block, const KeyedRobot& robot) {
  block.about(
      "collision: the spheres, box corners and cylinder rims of <collision> in the robot's file touch the "
      "ground");
  if (!block.has("shapes")) return std::nullopt;
  block.choice_or<int>("shapes", "collision", {{"collision", 0}});
  if (!robot.model) return std::nullopt;
  if (block.has("radius")) block.problem("radius", "'radius' is given beside 'shapes', which have their own");
  std::vector<CollisionSphere> spheres;
  const std::vector<std::string> links = frame_names(*robot.model);
  block.about("links whose shapes touch; absent: all links with shapes");
  const std::vector<std::string> named = distinct_names(block, "frames", links);
  const dynamics::UrdfCollisions found =
      robot.collisions ? *robot.collisions : dynamics::read_collisions(robot.urdf, *robot.model);
  for (const std::string& note : found.notes) block.problem("shapes", note);
  for (const CollisionSphere& sphere : found.spheres) {
    if (sphere.body >= 0 && (named.empty() || contains(named, sphere.link))) spheres.push_back(sphere);
  }
  const char* const expected =
      "; expected a <sphere>, <box> or <cylinder> in a <collision> of a link that moves";
  for (const std::string& link : named) {
    const bool has =
        std::any_of(spheres.begin(), spheres.end(), [&](const auto& s) { return s.link == link; });
    if (contains(links, link) && !has)
      block.problem("frames", "'" + link + "' touches nothing" +
                                  (contains(found.meshes, link) ? ", its shape being a mesh" : "") +
                                  expected);
  }
  if (named.empty() && spheres.empty())
    block.problem("shapes", "nothing of the robot touches" + std::string(expected));
  if (robot.left_out) note_what_is_left(*robot.left_out, found.meshes);
  return spheres;
}

}  // namespace dyntape
