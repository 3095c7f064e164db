// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/player/scene.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include <dyntape/dynamics/algebra/lie.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/report/player/shapes.h>

namespace dyntape {

using nlohmann::ordered_json;

namespace {

// Few digits, for the page's size.
double shown(double value, int digits = 6) {
  const double few = *io::parse_double(io::with_digits(value, digits));
  return few == 0 ? 0.0 : few;  // no -0
}

template <class Numbers>
ordered_json short_numbers(const Numbers& values) {
  ordered_json list = ordered_json::array();
  for (double value : values) list.push_back(shown(value));
  return list;
}

void append_short(ordered_json& list, const Eigen::Ref<const Eigen::VectorXd>& values, int digits = 6) {
  for (double value : values) list.push_back(shown(value, digits));
}

// Each body's quaternion on the side of the one before it.
ordered_json poses_json(const std::vector<Placements>& X_WB, int digits) {
  ordered_json all = ordered_json::array();
  std::vector<Eigen::Vector4d> last(X_WB.front().size(), Eigen::Vector4d::Zero());
  for (const Placements& bodies : X_WB) {
    ordered_json frame = ordered_json::array();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      Eigen::Vector4d q = dynamics::quaternion(bodies[i].R);
      if (q.dot(last[i]) < 0) q = -q;
      last[i] = q;
      append_short(frame, bodies[i].p, digits);
      append_short(frame, q);
    }
    all.push_back(std::move(frame));
  }
  return all;
}

ordered_json mesh_json(const dynamics::Mesh& mesh) {
  ordered_json vertices = ordered_json::array(), triangles = ordered_json::array();
  for (const Eigen::Vector3f& v : mesh.vertices) append_short(vertices, v.cast<double>());
  for (const auto& triangle : mesh.triangles) {
    for (int vertex : triangle) triangles.push_back(vertex);
  }
  return {{"vertices", std::move(vertices)}, {"triangles", std::move(triangles)}};
}

// Shapes, and each mesh that they share once.
void add_shapes(const std::vector<dynamics::Visual>& shapes, ordered_json& scene) {
  constexpr const char* kKinds[] = {"box", "cylinder", "sphere", "mesh"};
  const Eigen::Vector4d plain(0.72, 0.74, 0.77, 1);
  ordered_json list = ordered_json::array(), meshes = ordered_json::array();
  std::vector<const dynamics::Mesh*> known;
  for (const dynamics::Visual& shape : shapes) {
    ordered_json entry = {{"kind", kKinds[int(shape.shape)]},
                          {"body", shape.body},
                          {"p", short_numbers(Eigen::Vector3d(shape.X_BV.p))},
                          {"q", short_numbers(Eigen::Vector4d(dynamics::quaternion(shape.X_BV.R)))},
                          {"scale", short_numbers(shape.scale)},
                          {"color", short_numbers(shape.color.value_or(plain))}};
    if (shape.mesh) {
      const auto found = std::find(known.begin(), known.end(), shape.mesh.get());
      entry["mesh"] = found - known.begin();
      if (found == known.end()) {
        known.push_back(shape.mesh.get());
        meshes.push_back(mesh_json(*shape.mesh));
      }
    }
    list.push_back(std::move(entry));
  }
  scene["shapes"] = std::move(list);
  scene["meshes"] = std::move(meshes);
}

ordered_json contacts_json(const std::vector<std::vector<PlayerContact>>& frames, int digits) {
  ordered_json all = ordered_json::array();
  for (const auto& contacts : frames) {
    ordered_json frame = ordered_json::array();
    for (const PlayerContact& contact : contacts) {
      append_short(frame, contact.point, digits);
      append_short(frame, contact.force);
    }
    all.push_back(std::move(frame));
  }
  return all;
}

ordered_json traces_json(const PlayerInput& input, const PlayerFrames& frames, int digits) {
  ordered_json all = ordered_json::array();
  for (std::size_t i = 0; i < input.traces.size(); ++i) {
    ordered_json points = ordered_json::array();
    for (const Eigen::Vector3d& p : frames.traces[i]) append_short(points, p, digits);
    all.push_back({{"name", input.traces[i]}, {"points", std::move(points)}});
  }
  return all;
}

ordered_json values_json(const PlayerInput& input, const PlayerFrames& frames) {
  ordered_json all = ordered_json::array();
  for (std::size_t i = 0; i < input.values.size(); ++i) {
    const PlayerValue& value = input.values[i];
    all.push_back({{"name", value.name}, {"unit", value.unit}, {"y", short_numbers(frames.values[i])}});
  }
  return all;
}

void add_terrain(const PlayerInput& input, ordered_json& scene) {
  if (input.plane) {
    const Eigen::Vector3d normal = input.plane->normal.stableNormalized();
    scene["plane"] = {{"normal", short_numbers(normal)}, {"offset", shown(input.plane->offset)}};
  }
  if (!input.heights) return;
  const PlayerHeights& h = *input.heights;
  ordered_json z = ordered_json::array();
  for (Eigen::Index i = 0; i < h.heights.rows(); ++i) append_short(z, h.heights.row(i).transpose());
  scene["heights"] = {{"corner", short_numbers(h.corner)},
                      {"step", short_numbers(h.step)},
                      {"rows", h.heights.rows()},
                      {"columns", h.heights.cols()},
                      {"z", std::move(z)}};
}

double largest_force(const PlayerInput& input) {
  double largest = 0;
  for (const auto& contacts : input.contacts) {
    for (const PlayerContact& contact : contacts) largest = std::max(largest, contact.force.norm());
  }
  return largest;
}

// Where the robot is: over the motion, and in its first frame.
struct Room {
  Eigen::AlignedBox3d motion, first;
};

Room room_of(const std::vector<dynamics::Visual>& shapes, const PlayerFrames& frames) {
  std::vector<Eigen::AlignedBox3d> own;
  for (const dynamics::Visual& shape : shapes) own.push_back(own_box(shape));
  Room room;
  for (const Placements& X_WB : frames.X_WB) {
    for (std::size_t i = 0; i < shapes.size(); ++i) room.motion.extend(world_box(shapes[i], own[i], X_WB));
    if (room.first.isEmpty()) room.first = room.motion;
  }
  return room;
}

// Of positions: as many more as the robot is smaller than its distance from the origin.
int digits_of(const Room& room) {
  const double size = std::max(room.first.diagonal().norm(), 1e-3);
  const double reach =
      std::max(room.motion.min().cwiseAbs().maxCoeff(), room.motion.max().cwiseAbs().maxCoeff());
  return 6 + std::clamp(int(std::ceil(std::log10(std::max(reach / size, 1.0)))), 0, 10);
}

// The largest force is as long as half the robot.
void add_room(const PlayerInput& input, const Room& room, ordered_json& scene) {
  const double radius = std::max(room.motion.diagonal().norm() / 2, 1e-3);
  const double size = std::max(room.first.diagonal().norm(), 1e-3), force = largest_force(input);
  const double lowest = room.motion.min().z();
  ordered_json center = ordered_json::array();
  append_short(center, Eigen::Vector3d(room.motion.center()), digits_of(room));
  scene["center"] = std::move(center);
  scene["radius"] = shown(radius);
  scene["ground"] = shown(lowest < -0.1 * size ? lowest : 0);
  scene["size"] = shown(size);
  scene["arrow"] = shown(force > 0 ? 0.5 * size / force : 0);
}

// JSON in an HTML script: what HTML reads as its own is written as JSON's escapes.
std::string safe_in_html(const std::string& json) {
  std::string safe;
  for (char c : json) {
    if (c == '<' || c == '>' || c == '&') {
      safe += c == '<' ? "\\u003c" : c == '>' ? "\\u003e" : "\\u0026";
    } else {
      safe += c;
    }
  }
  return safe;
}

}  // namespace

std::string scene_json(const PlayerInput& input, const PlayerFrames& frames) {
  std::vector<dynamics::Visual> shapes = player_shapes(input.model, input.visuals, frames.X_WB.front());
  shapes.insert(shapes.end(), input.surroundings.begin(), input.surroundings.end());
  const Room room = room_of(shapes, frames);
  const int digits = digits_of(room);
  ordered_json times = ordered_json::array();
  append_short(times, Eigen::Map<const Eigen::VectorXd>(frames.t.data(), Eigen::Index(frames.t.size())), 15);
  ordered_json scene = {
      {"title", input.title},  {"robot", input.model.name},       {"notes", input.visuals.notes},
      {"t", std::move(times)}, {"bodies", input.model.njoints()}, {"poses", poses_json(frames.X_WB, digits)}};
  add_shapes(shapes, scene);
  scene["contacts"] = contacts_json(frames.contacts, digits);
  scene["traces"] = traces_json(input, frames, digits);
  scene["values"] = values_json(input, frames);
  add_terrain(input, scene);
  add_room(input, room, scene);
  return safe_in_html(scene.dump(-1, ' ', true, ordered_json::error_handler_t::replace));
}

}  // namespace dyntape
