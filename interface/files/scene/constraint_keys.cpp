// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/scene/constraint_keys.h>

#include <algorithm>

#include <dyntape/interface/files/lists.h>

namespace dyntape {

namespace {

using io::Section;
using RobotModel = dynamics::Model<double>;

// Indices of the frames that `frames` names; what it names wrongly is noted.
std::vector<int> frames_named(Section& block, const std::string& meaning, const RobotModel* model) {
  std::vector<int> indices;
  for (const std::string& name : read_frames(block, meaning, model)) {
    for (std::size_t i = 0; i < model->frames.size(); ++i) {
      if (model->frames[i].name == name) indices.push_back(int(i));
    }
  }
  return indices;
}

// Every block `key` of a list that is given, and at least one.
template <class Read>
void read_list(Section& parent, const std::string& list, const std::string& key, const std::string& meaning,
               const Read& read) {
  if (!parent.about(meaning).has(list)) return;
  Section block = parent.child(list);
  if (!block.about("one loop").has(key))
    return block.problem(key, "'" + list + "' needs at least one '" + key + "'");
  for (Section& item : block.each(key)) read(item);
}

void read_loop(Section& block, const RobotModel* model, SceneConstraints& constraints) {
  const std::vector<int> frames = frames_named(block, "the two links whose origins coincide", model);
  const int rows =
      block.about("point: the origins coincide (a ball joint); frame: the links are welded together")
          .choice_or<int>("type", "point", {{"point", 3}, {"frame", 6}});
  block.about(
      "stiffness of the correction of drift (Baumgarte): the error e obeys e'' + damping e' + stiffness e = "
      "0 [1/s^2]");
  const double kp = block.get_or("stiffness", 100.0, io::not_negative());
  const double kd =
      block.about("damping of that correction [1/s]").get_or("damping", 20.0, io::not_negative());
  if (!model || frames.empty()) return;
  if (frames.size() != 2) {
    return block.problem("frames", "'frames' names " + std::to_string(frames.size()) +
                                       (frames.size() == 1 ? " link" : " links") + ", expected two");
  }
  const auto &a = model->frames[std::size_t(frames[0])], &b = model->frames[std::size_t(frames[1])];
  if (a.body == b.body) {
    return block.problem("frames", "'" + a.name + "' and '" + b.name +
                                       "' are fixed to the same body; a loop needs joints between them");
  }
  const std::string name = a.name + " to " + b.name, reversed = b.name + " to " + a.name;
  for (const std::string& other : constraints.loop_names) {
    if (other == name || other == reversed)
      return block.problem("frames", "the links '" + a.name + "' and '" + b.name + "' have a loop already");
  }
  constraints.loops.push_back(dynamics::loop_constraint(*model, frames[0], frames[1], rows));
  constraints.loops.back().kp = kp;
  constraints.loops.back().kd = kd;
  constraints.loop_names.push_back(name);
}

// The link that a contact's plane is fixed to; the plane is then told in the axes of that link's body.
void read_plane_of(Section& block, const RobotModel* model, dynamics::RigidContact& contact) {
  std::vector<std::string> names;
  if (model) {
    for (const auto& frame : model->frames) names.push_back(frame.name);
  }
  block.about("link to which the plane is fixed; normal and offset are in its axes; absent: the world");
  const std::vector<std::string> links = distinct_names(block, "plane_of", names);
  if (!model || !block.has("plane_of")) return;
  if (links.size() != 1)
    return block.problem("plane_of",
                         "'plane_of' names " + std::to_string(links.size()) + " links, expected one");
  const auto is_it = [&](const auto& frame) { return frame.name == links.front(); };
  const auto at = std::find_if(model->frames.begin(), model->frames.end(), is_it);
  if (at == model->frames.end()) return;  // which is noted
  if (at->body < 0)
    return block.problem("plane_of", "'" + at->name + "' is fixed to the world, expected a link that moves");
  contact.plane_body = at->body;
  contact.normal = at->X_BF.R * contact.normal.stableNormalized();
  contact.offset += contact.normal.dot(at->X_BF.p);
}

void check_other_body(Section& block, const dynamics::RigidContact& contact) {
  if (contact.body == contact.plane_body)
    block.problem("plane_of", "'" + contact.name +
                                  "' moves with its plane, so that they never meet; expected "
                                  "links of two bodies");
}

void read_contact(Section& block, const KeyedRobot& robot, dynamics::UnilateralConstraints& rigid) {
  dynamics::RigidContact contact;
  const auto spheres = read_collision_shapes(block, robot);
  std::vector<int> frames;
  if (!spheres) {
    frames = frames_named(block, "links that touch, at the origin of each", robot.model);
    block.about("radius of the sphere [m]; 0: a point");
    contact.radius = block.get_or("radius", 0.0, io::not_negative());
  }
  contact.friction = block.about("friction coefficient").get_or("friction", 0.0, io::not_negative());
  block.about("speed after an impact divided by the speed before");
  contact.restitution = block.get_or("restitution", 0.0, io::between(0, 1));
  block.about("of the plane, upwards, any length");
  contact.normal = read_vector3(block, "normal", contact.normal);
  contact.offset =
      block.about("distance of the plane from the origin, along the normal [m]").get_or("offset", 0.0);
  int number = 0;
  if (!(contact.normal.norm() > 0)) block.problem("normal", "'normal' is zero, expected a direction");
  read_plane_of(block, robot.model, contact);
  for (std::size_t k = 0; spheres && k < spheres->size(); ++k) {
    const dynamics::CollisionSphere& sphere = (*spheres)[k];
    const bool goes_on = k > 0 && (*spheres)[k - 1].link == sphere.link;
    number = goes_on ? number + 1 : 1;
    contact.name = sphere.link + "." + std::to_string(number);
    contact.body = sphere.body;
    contact.X_BF = {Eigen::Matrix3d::Identity(), sphere.center};
    contact.radius = sphere.radius;
    check_other_body(block, contact);
    rigid.contacts.push_back(contact);
  }
  for (const int frame : frames) {
    const auto& at = robot.model->frames[std::size_t(frame)];
    if (at.body < 0) {
      block.problem("frames", "'" + at.name + "' is fixed to the world; it touches nothing new");
      continue;
    }
    contact.name = at.name;
    contact.body = at.body;
    contact.X_BF = at.X_BF;
    check_other_body(block, contact);
    rigid.contacts.push_back(contact);
  }
}

void read_limits(Section& parent, const RobotModel* model, dynamics::UnilateralConstraints& rigid) {
  if (!parent.about("limits of positions in the robot's file as rigid stops").has("limits")) return;
  Section block = parent.child("limits");
  block.about("speed after an impact divided by the speed before");
  const double restitution = block.get_or("restitution", 0.0, io::between(0, 1));
  if (!model) return;
  rigid.stops = dynamics::hard_stops(*model, restitution);
  if (rigid.stops.empty()) parent.problem("limits", "the robot has no joint with a finite limit");
  for (const auto& joint : model->joints) {
    if (joint.limits.lower >= joint.limits.upper)
      parent.problem("limits", "joint '" + joint.name + "' has no room between its limits");
  }
}

}  // namespace

SceneConstraints read_constraints(Section& file, const KeyedRobot& robot) {
  const RobotModel* const model = robot.model;
  Section block = file.about("rigid constraints of the motion").child_or_empty("constraints");
  SceneConstraints constraints;
  read_list(block, "loops", "loop", "closed kinematic loops",
            [&](Section& loop) { read_loop(loop, model, constraints); });
  read_list(block, "contacts", "contact", "rigid contacts of spheres and points with planes",
            [&](Section& contact) { read_contact(contact, robot, constraints.rigid); });
  read_limits(block, model, constraints.rigid);
  return constraints;
}

}  // namespace dyntape
