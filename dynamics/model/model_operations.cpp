// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/model/model_operations.h>

#include <set>
#include <string>
#include <unordered_map>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/model/joints.h>

namespace dyntape::dynamics {
namespace {

void check_unit(const std::string& joint, const char* what, double norm) {
  if (!(std::abs(norm - 1) <= 1e-6))
    throw ArgumentError("lock_joints: q of joint \"" + joint + "\" holds a " + what + " of length " +
                        std::to_string(norm) + ", expected 1");
}

// Moving side of the joint in its fixed side; q holds the joint's own entries.
Placement<double> placement_at(const Joint<double>& joint, const Eigen::VectorXd& q) {
  if (!q.allFinite())
    throw ArgumentError("lock_joints: q of joint \"" + joint.name + "\" is not finite, expected a number");
  const auto check_quaternion = [&](int at) {
    check_unit(joint.name, "quaternion", q.segment<4>(at).stableNorm());
  };
  const auto check_pair = [&](int at) {
    check_unit(joint.name, "(cos, sin)", q.segment<2>(at).stableNorm());
  };
  if (joint.type == JointType::kContinuous) check_pair(0);
  if (joint.type == JointType::kPlanar) check_pair(2);
  if (joint.type == JointType::kSpherical) check_quaternion(0);
  if (joint.type == JointType::kFreeFlyer) check_quaternion(3);
  Joint<double> alone = joint;
  alone.idx_q = 0;
  return joint_placement<double>(alone, Axis::from(joint.axis), {}, q);
}

// Where an old body went: placed by X in the body of a new model (-1: the world).
struct NewPlace {
  int body = -1;
  Placement<double> X;
};

void carry_frames(const Model<double>& from, const std::vector<NewPlace>& places, Model<double>& to) {
  for (const Frame<double>& frame : from.frames) {
    if (frame.body < 0) {
      to.frames.push_back(frame);
      continue;
    }
    const NewPlace& place = places[frame.body];
    to.frames.push_back({frame.name, place.body, place.X * frame.X_BF});
  }
}

std::set<int> indices_of(const Model<double>& model, const std::vector<std::string>& names) {
  std::unordered_map<std::string, int> places;
  for (int i = 0; i < model.njoints(); ++i) places.emplace(model.joints[i].name, i);
  std::set<int> indices;
  for (const std::string& name : names) {
    const auto found = places.find(name);
    indices.insert(found != places.end() ? found->second
                                         : model.joint_index(name));  // which says what is wrong
  }
  return indices;
}

Model<double> same_world(const Model<double>& model) {
  Model<double> result;
  result.name = model.name;
  result.gravity = model.gravity;
  return result;
}

}  // namespace

Inertia<double> welded(const Inertia<double>& a, const Inertia<double>& b) {
  const auto empty = [](const Inertia<double>& part) { return part.mass == 0 && part.I_c.isZero(0); };
  if (empty(b)) return a;
  return empty(a) ? b : a + b;
}

Model<double> with_gravity(Model<double> model, const Eigen::Vector3d& gravity) {
  if (!gravity.allFinite()) throw ArgumentError("with_gravity: gravity is not finite, expected m/s^2");
  model.gravity = gravity;
  return model;
}

Model<double> lock_joints(const Model<double>& model, const std::vector<std::string>& joint_names,
                          const Eigen::VectorXd& q) {
  if (q.size() != model.nq)
    throw ArgumentError("lock_joints: q has " + std::to_string(q.size()) + " entries, model \"" + model.name +
                        "\" expects " + std::to_string(model.nq));
  const std::set<int> locked = indices_of(model, joint_names);
  Model<double> result = same_world(model);
  std::vector<NewPlace> places(model.njoints());
  for (int i = 0; i < model.njoints(); ++i) {
    const Joint<double>& joint = model.joints[i];
    const NewPlace parent = model.parent[i] < 0 ? NewPlace{} : places[model.parent[i]];
    const Placement<double> fixed_side = parent.X * model.X_PJ[i];
    if (!locked.count(i)) {
      places[i].body = result.add_joint(parent.body, joint, fixed_side, model.inertias[i]);
      continue;
    }
    const Eigen::VectorXd q_joint = q.segment(joint.idx_q, nq(joint.type));
    places[i] = {parent.body, fixed_side * placement_at(joint, q_joint)};
    if (parent.body < 0) continue;
    Inertia<double>& carrier = result.inertias[parent.body];
    carrier = welded(carrier, act(places[i].X, model.inertias[i]));
  }
  carry_frames(model, places, result);
  return result;
}

}  // namespace dyntape::dynamics
