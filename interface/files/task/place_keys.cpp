// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/task/place_keys.h>

#include <algorithm>
#include <sstream>

#include <dyntape/autodiff/suggest.h>
#include <dyntape/interface/files/lists.h>

namespace dyntape {

namespace {

using io::Section;
using RobotModel = dynamics::Model<double>;

// Empty where the robot has no link of this name, which is noted at the key, or at the block itself where that is "".
std::string known_frame(Section& block, const std::string& key, const std::string& name,
                        const RobotModel& model) {
  if (std::any_of(model.frames.begin(), model.frames.end(), [&](const auto& f) { return f.name == name; }))
    return name;
  block.problem(key, "'" + block.path() + (key.empty() ? "" : "." + key) + "' names '" + name +
                         "', which is no link of the robot" + dynamics::meant_frame(model, name));
  return "";
}

// The body that carries a frame; -1: the world.
int carrier_of(const RobotModel& model, const std::string& frame) {
  return frame == kWorld ? -1 : model.frames[std::size_t(model.frame_index(frame))].body;
}

// Every block `key` of a list; in the list of keys one.
std::vector<Section> items_of(Section& list, const std::string& key, const std::string& meaning) {
  return list.about(meaning).has(key) ? list.each(key) : std::vector<Section>{};
}

class CapsuleReader {
 public:
  // With `model` null the frames are not known; where they are not asked for, all stands in the world.
  CapsuleReader(Section& list, bool asks_frames, const RobotModel* model)
      : list_(list), asks_frames_(asks_frames), model_(model) {}

  std::vector<Capsule> read() {
    for (Section& block : items_of(list_, "sphere", "sphere <name> { ... }")) {
      Capsule capsule = begin(block, "sphere");
      capsule.from = read_vector3(block.about("centre [m]"), "center", std::nullopt, metres());
      capsule.to = capsule.from;
      end(block, capsule);
    }
    for (Section& block :
         items_of(list_, "capsule", "capsule <name> { ... }: all points within the radius of a line")) {
      Capsule capsule = begin(block, "capsule");
      capsule.from = read_vector3(block.about("one end of the axis [m]"), "from", std::nullopt, metres());
      capsule.to = read_vector3(block.about("other end of the axis [m]"), "to", std::nullopt, metres());
      end(block, capsule);
    }
    return std::move(capsules_);
  }
  std::vector<Section>& blocks() { return blocks_; }  // of the capsules, in their order

 private:
  Capsule begin(Section& block, const std::string& kind) {
    Capsule capsule{"", kWorld, {}, {}, 0};
    if (asks_frames_)
      capsule.frame =
          read_link(block.about("link with which the shape moves; coordinates are in the link's axes"),
                    "frame", model_);
    capsule.name = block.value();
    if (capsule.name.empty()) capsule.name = kind + " " + std::to_string(capsules_.size() + 1);
    return capsule;
  }

  void end(Section& block, Capsule& capsule) {
    capsule.radius = block.about("radius [m]").get<double>("radius", io::positive());
    for (const Capsule& other : capsules_) {
      if (other.name == capsule.name)
        block.problem("", "'" + capsule.name + "' names two of '" + list_.path() + "', expected one");
    }
    capsules_.push_back(std::move(capsule));
    blocks_.push_back(block);
  }

  Section& list_;
  bool asks_frames_;
  const RobotModel* model_;
  std::vector<Capsule> capsules_;
  std::vector<Section> blocks_;
};

const Capsule* capsule_named(Section& block, const std::string& name, const std::vector<Capsule>& bodies) {
  std::vector<std::string> valid;
  for (const Capsule& body : bodies) {
    if (body.name == name) return &body;
    valid.push_back(body.name);
  }
  block.problem("pair", "'pair' names '" + name + "', which is none of 'bodies'" + suggestion(name, valid));
  return nullptr;
}

// apart "hand forearm": bodies that keep clear of each other.
void read_apart(Section& block, double least, const RobotModel* model, Surroundings& around) {
  block.about("names of two bodies that must not touch each other; one line per pair");
  block.defer("pair", "two names", "");
  for (Section& pair : block.children("pair")) {
    std::istringstream words(pair.value());
    std::vector<std::string> names;
    for (std::string word; words >> word;) names.push_back(word);
    if (names.size() != 2) {
      block.problem("pair", "'pair' names " + std::to_string(names.size()) + " bodies, expected two");
      continue;
    }
    const Capsule *a = capsule_named(block, names[0], around.bodies),
                  *b = capsule_named(block, names[1], around.bodies);
    if (!a || !b || !model) continue;
    if (carrier_of(*model, a->frame) == carrier_of(*model, b->frame)) {
      block.problem("pair", "no joint moves '" + a->name + "' against '" + b->name + "'");
      continue;
    }
    around.apart.push_back({*a, *b, least});
  }
}

// A body that no joint moves runs into nothing; it may stand there for others to keep clear of.  `blocks`: of the bodies.
void refuse_idle(std::vector<Section>& blocks, const RobotModel& model, const Surroundings& around) {
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const Capsule& body = around.bodies[k];
    const auto has = [&](const Surroundings::Pair& pair) {
      return pair.a.name == body.name || pair.b.name == body.name;
    };
    if (body.frame == kWorld || carrier_of(model, body.frame) >= 0) continue;
    if (std::any_of(around.apart.begin(), around.apart.end(), has)) continue;
    blocks[k].problem("frame", "'" + body.frame + "', which carries '" + body.name +
                                   "', is fixed to the world; expected a link that moves, or '" + body.name +
                                   "' named in 'pair'");
  }
}

}  // namespace

std::string read_link(Section& block, const std::string& key, const RobotModel* model) {
  if (!model) {
    block.defer(key, "name of a link");
    return "";
  }
  const std::string name = block.get<std::string>(key);
  if (!name.empty()) return known_frame(block, key, name, *model);
  if (!block.has(key)) return "";  // which is missing
  block.problem(key, "'" + block.path() + "." + key + "' is empty, expected the name of a link");
  return "";
}

std::vector<Thruster> read_thrusters(Section& file, const RobotModel* model) {
  if (!file.about("thrusters: forces along axes of links, as additional controls").has("thrusters"))
    return {};
  Section list = file.child("thrusters");
  std::vector<Thruster> thrusters;
  for (Section& block : items_of(list, "thruster", "thruster <name> { ... }")) {
    Thruster thruster;
    thruster.name = block.value();
    thruster.frame = read_link(block.about("link at whose origin the thruster pushes"), "frame", model);
    if (thruster.name.empty()) thruster.name = thruster.frame;
    thruster.axis = read_vector3(block.about("direction in the link's axes, of any length"), "axis",
                                 Eigen::Vector3d::UnitZ());
    if (thruster.axis.isZero(0))
      block.problem("axis", "'thrusters.thruster.axis' is zero, expected a direction");
    thruster.lower = block.about("smallest force [N]").get_or("lower", 0.0);
    thruster.upper =
        block.about("largest force [N]").get_or("upper", thruster.upper, io::or_infinite(io::Range{}));
    block.about(
        "moment about the axis per force, e.g. the drag of a rotor with the sign of its rotation [m]");
    thruster.moment = block.get_or("moment", 0.0);
    if (!(thruster.lower <= thruster.upper))
      block.problem("upper", "'thrusters.thruster.upper' is below 'lower'; expected the most force");
    for (const Thruster& other : thrusters) {
      if (model && other.name == thruster.name)
        block.problem("", "'" + thruster.name + "' names two of 'thrusters', expected one");
    }
    if (model && !thruster.frame.empty() && carrier_of(*model, thruster.frame) < 0)
      block.problem("frame", "'" + thruster.frame + "' is fixed to the world and moves nothing");
    thrusters.push_back(std::move(thruster));
  }
  return thrusters;
}

// Corners of the rectangle across the z axis that lies between two opposite ones.
std::vector<Eigen::Vector3d> read_corners(Section& foot) {
  foot.about("a corner of the rectangle, in the link's axes [m]");
  const Eigen::Vector3d from = read_vector3(foot, "from", std::nullopt, metres());
  foot.about("the opposite corner, at the same z [m]");
  const Eigen::Vector3d to = read_vector3(foot, "to", std::nullopt, metres());
  if (foot.sound() && (from.z() != to.z() || from.x() == to.x() || from.y() == to.y()))
    foot.problem("to", "'" + foot.path() + "': 'from' and 'to' are to differ in x and y and agree in z");
  return {from, {to.x(), from.y(), from.z()}, to, {from.x(), to.y(), from.z()}};
}

std::vector<HeldContact> read_contacts(Section& file, const RobotModel* model, Cones cones) {
  Section block =
      file.about("contacts that the floor holds during the whole motion").child_or_empty("contacts");
  std::vector<std::string> moving;
  if (model) {
    for (const auto& frame : model->frames) {
      if (frame.body >= 0) moving.push_back(frame.name);
    }
  }
  std::vector<HeldContact> contacts;
  for (const std::string& name :
       distinct_names(block.about("links whose origins keep their initial positions"), "points", moving))
    contacts.push_back({.frame = name});
  block.about(
      "a flat foot, which does not rotate: the link's name, and the rectangle that stands on the floor");
  std::vector<Section> feet;
  if (block.has("foot")) feet = block.each("foot");
  for (Section& foot : feet) {
    HeldContact contact{.frame = foot.value()};
    if (contact.frame.empty())
      foot.problem("", "'" + foot.path() + "' needs the name of a link behind the word");
    if (model && !contact.frame.empty()) contact.frame = known_frame(foot, "", contact.frame, *model);
    contact.corners = read_corners(foot);
    contacts.push_back(std::move(contact));
  }
  const double friction =
      block.about("friction coefficient").get_or("friction", HeldContact().friction, coefficients());
  for (HeldContact& contact : contacts) contact.friction = friction;
  if (cones == Cones::kLimits) return contacts;
  const double barrier = block
                             .about(
                                 "weight of a logarithmic barrier that keeps forces within the friction "
                                 "cones; 0: a constraint instead")
                             .get_or("barrier", 0.0, io::not_negative());
  double width = HeldContact().width;
  block.about(
      "of the barrier: margin to the cone, as a fraction of the robot's weight, below which the logarithm "
      "becomes a parabola");
  if (barrier > 0 || !model) width = block.get_or("width", width, io::positive());
  for (HeldContact& contact : contacts) contact.barrier = barrier, contact.width = width;
  return contacts;
}

std::optional<double> read_floor(Section& file) {
  Section block = file.child_or_empty("contacts");
  block.about("height of the floor [m]; absent: 0, with a note for contacts at other heights");
  if (!block.has("floor")) return std::nullopt;
  return block.get<double>("floor", metres());
}

std::optional<FrameTarget> read_frame_target(Section& end, const RobotModel* model) {
  if (!end.about("pose of a link, in place of q: frame <link> { ... }").has("frame")) return std::nullopt;
  Section block = end.child("frame");
  FrameTarget target;
  target.frame = block.value();
  if (target.frame.empty())
    block.problem("", "'" + block.path() + "' needs the name of a link behind the word");
  if (model && !target.frame.empty()) target.frame = known_frame(block, "", target.frame, *model);
  if (block.about("position of its origin in the world [m]").has("position"))
    target.position = read_vector3(block, "position", std::nullopt, metres());
  if (block.about("orientation of its axes: roll, pitch and yaw as in URDF files [rad]").has("orientation")) {
    const Eigen::Vector3d angles = read_vector3(block, "orientation", std::nullopt);
    target.orientation = rotation_of(angles[0], angles[1], angles[2]);
  }
  if (!target.position && !target.orientation)
    block.problem("", "'" + block.path() + "' needs 'position', 'orientation' or both");
  if (model && !target.frame.empty() && carrier_of(*model, target.frame) < 0)
    block.problem("", "'" + target.frame + "' is fixed to the world and goes nowhere");
  return target;
}

Surroundings read_surroundings(Section& file, const RobotModel* model) {
  Surroundings around;
  if (file.about("obstacles in the world, which every body avoids").has("obstacles")) {
    Section block = file.child("obstacles");
    around.obstacles = CapsuleReader(block, false, model).read();
  }
  if (file.about("shapes of the robot that avoid the obstacles").has("bodies")) {
    Section block = file.child("bodies");
    CapsuleReader reader(block, true, model);
    around.bodies = reader.read();
    block.about("smallest allowed distance [m]");
    const double least = block.get_or("clearance", 0.0, some_metres());
    block.about("weight of a logarithmic barrier of the distance; 0: a constraint instead");
    around.barrier = block.get_or("barrier", around.barrier, io::not_negative());
    block.about("of the barrier: distance below which the logarithm becomes a parabola [m]");
    if (around.barrier > 0 || !model) around.width = block.get_or("width", around.width, io::positive());
    for (const Capsule& body : around.bodies) {
      if (!model || carrier_of(*model, body.frame) < 0) continue;  // what stands still runs into nothing
      for (const Capsule& obstacle : around.obstacles) around.apart.push_back({body, obstacle, least});
    }
    read_apart(block, least, model, around);
    if (model) refuse_idle(reader.blocks(), *model, around);
  }
  if (!model) return around;
  if (!around.obstacles.empty() && around.bodies.empty())
    file.problem("obstacles",
                 "'obstacles' have no effect without 'bodies'; expected shapes of the robot in 'bodies'");
  if (!around.bodies.empty() && around.apart.empty())
    file.problem("bodies", "'bodies' keep clear of nothing; expected 'obstacles', or 'pair' in the block");
  return around;
}

}  // namespace dyntape
