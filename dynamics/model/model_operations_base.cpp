// SPDX-License-Identifier: BSD-3-Clause
//
// change_base: the walk from the new root.  X_old_new[k] places the new frame of body k in its old frame.
//   forward joint i (parent p -> i)    fixed side X_PJ[i] seen from the new frame of p, frame of i unchanged
//   reversed joint i (i -> parent p)   X_ip = (X_PJ M(q))^-1 = M(q)^-1 X_PJ^-1, and M(q)^-1 is M(q) about the
//                                      opposite axis: fixed side = old frame i, new frame of p = fixed side
//                                      X_PJ
#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/model/model_operations.h>

namespace dyntape::dynamics {
namespace {

// One step of the walk: cross joint `joint` into old body `body`.
struct Step {
  int joint, body;
  int from;  // old body on this side
};

// Old joints that touch each body, in the order in which the walk shall take them: by name.
std::vector<std::vector<Step>> steps_from_bodies(const Model<double>& model) {
  std::vector<std::vector<Step>> steps(model.njoints());
  for (int i = 1; i < model.njoints(); ++i) {
    steps[model.parent[i]].push_back({i, i, model.parent[i]});
    steps[i].push_back({i, model.parent[i], i});
  }
  for (auto& list : steps)
    std::sort(list.begin(), list.end(), [&](const Step& a, const Step& b) {
      return model.joints[a.joint].name < model.joints[b.joint].name;
    });
  return steps;
}

void check_floating(const Model<double>& model, const std::string& frame_name, const Frame<double>& frame) {
  const auto hangs_on_world = [](int parent) { return parent < 0; };
  const bool floating = model.njoints() > 0 && model.joints[0].type == JointType::kFreeFlyer &&
                        std::count_if(model.parent.begin(), model.parent.end(), hangs_on_world) == 1;
  if (!floating)
    throw ArgumentError("change_base: model \"" + model.name +
                        "\" does not float, so that the inertia of its " +
                        "root is unknown; expected a model with one floating base");
  if (frame.body < 0)
    throw ArgumentError("change_base: frame \"" + frame_name +
                        "\" belongs to the world; expected one of a body");
}

// The inverse of a joint is the joint about the opposite axis; those of several columns have none.
void check_reversible(const Model<double>& model, const Joint<double>& joint) {
  if (is_single(joint.type)) return;
  throw ArgumentError("change_base: the " + std::string(to_string(joint.type)) + " joint \"" + joint.name +
                      "\" of model \"" + model.name +
                      "\" lies between the old and the new base and would change the meaning of q; expected "
                      "joints of one degree of freedom there");
}

}  // namespace

Model<double> change_base(const Model<double>& model, const std::string& frame_name, Base base) {
  const Frame<double>& root = model.frames[model.frame_index(frame_name)];
  check_floating(model, frame_name, root);
  Model<double> result;
  result.name = model.name;
  result.gravity = model.gravity;

  const auto steps = steps_from_bodies(model);
  std::vector<int> new_body(model.njoints(), -1);
  std::vector<Placement<double>> X_old_new(model.njoints());
  X_old_new[root.body] = root.X_BF;
  if (base == Base::kFloating)
    new_body[root.body] = result.add_joint(-1, model.joints[0], model.X_PJ[0],
                                           act(inverse(root.X_BF), model.inertias[root.body]));

  std::vector<Step> open(steps[root.body].rbegin(), steps[root.body].rend());
  while (!open.empty()) {
    const Step step = open.back();
    open.pop_back();
    const bool reversed = step.body != step.joint;
    Joint<double> joint = model.joints[step.joint];
    const Placement<double> X_new_old = inverse(X_old_new[step.from]);
    if (reversed) {
      check_reversible(model, joint);
      joint.axis = -joint.axis + Eigen::Vector3d::Zero();  // the sum turns -0 into 0
      X_old_new[step.body] = model.X_PJ[step.joint];
    }
    new_body[step.body] = result.add_joint(new_body[step.from], joint,
                                           reversed ? X_new_old : X_new_old * model.X_PJ[step.joint],
                                           act(inverse(X_old_new[step.body]), model.inertias[step.body]));
    for (auto next = steps[step.body].rbegin(); next != steps[step.body].rend(); ++next)
      if (next->joint != step.joint) open.push_back(*next);
  }
  for (const Frame<double>& frame : model.frames) {
    if (frame.body < 0) continue;  // marks in the old world have no place in a robot that hangs elsewhere
    result.frames.push_back({frame.name, new_body[frame.body], inverse(X_old_new[frame.body]) * frame.X_BF});
  }
  return result;
}

}  // namespace dyntape::dynamics
