// SPDX-License-Identifier: BSD-3-Clause
//
// The joints for which a workspace was made, to check that a model fits.
//
//   TreeShape shape = tree_shape_of(model);
//   detail::check_shape("rnea", "data", model, shape);   // ArgumentError if the model has other joints
//
// Sizes do not identify a robot: a free-flyer has as many dofs as an arm of six joints.  A workspace for another
// tree would have wrong columns S and arrays that are too short.
#pragma once

#include <dyntape/dynamics/model/checks.h>
#include <dyntape/dynamics/model/model.h>

#include <string>
#include <vector>

namespace dyntape::dynamics {

struct JointShape {
  int parent = -1, idx_v = 0;
  JointType type = JointType::kRevolute;
  double pitch = 0;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
};

using TreeShape = std::vector<JointShape>;  // (njoints)

template <class T>
TreeShape tree_shape_of(const Model<T>& model) {
  TreeShape shape;
  for (int i = 0; i < model.njoints(); ++i) {
    const Joint<T>& joint = model.joints[i];
    shape.push_back({model.parent[i], joint.idx_v, joint.type, joint.pitch, joint.axis});
  }
  return shape;
}

namespace detail {

// `rnea: data was made for other joints than those of model "arm": joint 2 "wrist" differs`
void throw_shape(const char* function, const char* what, const std::string& model, int index,
                 const std::string& joint);

template <class T>
void check_shape(const char* function, const char* what, const Model<T>& model, const TreeShape& shape) {
  check_count(function, what, model, std::ssize(shape));
  for (int i = 0; i < model.njoints(); ++i) {
    const JointShape& made_for = shape[i];
    const Joint<T>& joint = model.joints[i];
    const bool same = made_for.parent == model.parent[i] && made_for.idx_v == joint.idx_v &&
                      made_for.type == joint.type && made_for.pitch == joint.pitch &&
                      made_for.axis == joint.axis;
    if (!same) throw_shape(function, what, model.name, i, joint.name);
  }
}

}  // namespace detail

}  // namespace dyntape::dynamics
