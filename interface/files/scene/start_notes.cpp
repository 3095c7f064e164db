// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/scene/start_notes.h>

#include <algorithm>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

// The first joint in full, then a count.
void note_limits(std::vector<std::string>& notes, const dynamics::Model<double>& model, const VectorXd& q) {
  constexpr double kGrazes = 1e-6;
  std::string note;
  int more = 0;
  for (const auto& joint : model.joints) {
    if (!dynamics::is_single(joint.type) || dynamics::nq(joint.type) != 1) continue;
    const double at = q[joint.idx_q], lower = joint.limits.lower, upper = joint.limits.upper;
    if (at >= lower - kGrazes && at <= upper + kGrazes) continue;
    if (!note.empty()) {
      ++more;
      continue;
    }
    const std::string unit = unit_of_state(model, joint.idx_q);
    note = "joint '" + joint.name + "' starts at " + io::with_digits(at, 6) + unit +
           ", beyond the limits of the robot's file, " + io::with_digits(lower, 6) + " to " +
           io::with_digits(upper, 6) + unit + other_unit(joint, at, lower, upper);
  }
  if (more > 0) note += "; so do " + std::to_string(more) + " more";
  if (!note.empty()) notes.push_back(std::move(note));
}

void note_contacts(std::vector<std::string>& notes, const RobotScene& robot, const VectorXd& q,
                   const VectorXd& v) {
  constexpr double kTimesTheWeight = 100, kFreeFall = 9.81;
  const dynamics::Model<double>& model = robot.model;
  dynamics::Data<double> data(model);
  dynamics::forward_kinematics<double>(model, data, q, v);
  double mass = 0, force = 0, deepest = 0;
  for (const auto& inertia : model.inertias) mass += inertia.mass;
  const dynamics::ContactBody<double>* of_deepest = nullptr;
  robot.effects.contacts.for_each_point([&](int body, const Vector3d& r, const auto& law) {
    if (body < 0) return;
    const dynamics::PointMotion<double> at = dynamics::point_motion<double>(data, body, r);
    force += law.force(at).linear.norm();
    const double depth = law.item.radius - law.all.ground.below(at.p).distance;
    if (depth > deepest) deepest = depth, of_deepest = &law.item;
  });
  const double weight = kFreeFall * mass;
  if (!of_deepest || !(force > kTimesTheWeight * weight)) return;
  notes.push_back("at the start the contacts push with " + io::with_digits(force, 3) + " N, " +
                  io::with_digits(force / weight, 3) + " times the robot's weight: a contact of radius " +
                  io::with_digits(of_deepest->radius, 3) + " m is " + io::with_digits(deepest, 3) +
                  " m below the ground");
}

}  // namespace

std::vector<std::string> notes_of_start(const Scene& scene) {
  std::vector<std::string> notes;
  if (!scene.q.allFinite() || !scene.v.allFinite()) return notes;
  const RobotScene& robot = scene.robot;
  if (robot.constraints.rigid.stops.empty())
    note_limits(notes, robot.model, scene.q);  // stops refuse such a start
  if (robot.effects.contacts) note_contacts(notes, robot, scene.q, scene.v);
  return notes;
}

std::vector<std::string> notes_of(const Scene& scene) {
  std::vector<std::string> notes = scene.notes;
  for (std::string& note : notes_of_start(scene)) notes.push_back(std::move(note));
  return notes;
}

}  // namespace dyntape
