// SPDX-License-Identifier: BSD-3-Clause
//
// Results and working memory of the algorithms, allocated once.  Use one Data per thread.
//
//   Data<double> data(model);
//   const VectorX<double>& tau = rnea(model, data, q, v, a);    // a reference into data
//
// Each algorithm overwrites the fields named in algorithms.h; others keep their values.  Entries that are
// structurally zero are set to zero here and never written again.
#pragma once

#include <dyntape/dynamics/algebra/composite.h>
#include <dyntape/dynamics/algebra/ldlt.h>
#include <dyntape/dynamics/model/following.h>
#include <dyntape/dynamics/model/joints.h>
#include <dyntape/dynamics/model/tree_shape.h>
#include <dyntape/dynamics/algorithms/detail/lanes.hxx>

#include <algorithm>
#include <optional>
#include <vector>

namespace dyntape::dynamics {

// The shape of a tree, independent of the state.
struct Tree {
  std::vector<Dof> dofs;          // (nv)
  std::vector<int> first, count;  // (njoints) dofs of joint i: first[i] ... + count[i]
  std::vector<Axis> axes;         // (njoints)
  std::vector<int> root;          // (njoints) the root joint of the same tree
  std::vector<int> turning;       // the revolute and helical joints, ascending

  // Columns in preorder, so that a subtree is contiguous: the dofs of joint i at begin[i] ... begin[i] + count[i];
  // its whole subtree up to end[i].
  std::vector<int> preorder;    // (njoints) joints in preorder, subtree by subtree
  std::vector<int> begin, end;  // (njoints)
  std::vector<int> dof_at;      // (nv) index in v of the column at a position
  std::vector<int> place_of;    // (nv) the inverse
  bool in_order = true;         // true if this is the order of v
  std::vector<int> depth;       // (njoints) number of joints between joint i and the world
  int deepest = 0;

  // Returns true if joint i moves along all six directions: its columns are then the identity (6 x 6).
  bool is_free(int i) const { return count[i] == 6; }

  // The dofs on the paths through dof j: towards the root, then those of its joint and its subtree, at path_begin(j)
  // ...  path_end[j] of path.
  std::vector<int> path, path_end;
  int path_begin(int j) const { return j == 0 ? 0 : path_end[j - 1]; }
};

template <class T>
Tree tree_of(const Model<T>& model) {
  Tree tree;
  const int n = model.njoints();
  for (int i = 0; i < n; ++i) {
    const std::vector<Dof> dofs = joint_dofs(model.joints[i], i);
    tree.first.push_back(model.joints[i].idx_v);
    tree.count.push_back(static_cast<int>(dofs.size()));
    tree.axes.push_back(dofs.front().axis);
    const JointType type = model.joints[i].type;
    if (type == JointType::kRevolute || type == JointType::kHelical) tree.turning.push_back(i);
    tree.root.push_back(model.parent[i] < 0 ? i : tree.root[model.parent[i]]);
    tree.dofs.insert(tree.dofs.end(), dofs.begin(), dofs.end());
    tree.depth.push_back(model.parent[i] < 0 ? 0 : tree.depth[model.parent[i]] + 1);
    tree.deepest = std::max(tree.deepest, tree.depth.back());
  }
  // Computes sizes from the leaves, then positions from the roots: each joint takes the next free position of its
  // parent.
  std::vector<int> size = tree.count, next(n), next_joint(n), joints_below(n, 1);
  for (int i = n - 1; i >= 0; --i) {
    const int p = model.parent[i];
    if (p >= 0) size[p] += size[i], joints_below[p] += joints_below[i];
  }
  int root_place = 0, root_joint = 0;
  tree.preorder.resize(n);
  tree.dof_at.resize(model.nv);
  tree.place_of.resize(model.nv);
  for (int i = 0; i < n; ++i) {
    const int p = model.parent[i];
    int &place = p < 0 ? root_place : next[p], &joint = p < 0 ? root_joint : next_joint[p];
    tree.begin.push_back(place);
    tree.end.push_back(place + size[i]);
    tree.preorder[joint] = i;
    for (int k = 0; k < tree.count[i]; ++k) {
      tree.dof_at[place + k] = tree.first[i] + k;
      tree.in_order = tree.in_order && place == tree.first[i];
      tree.place_of[tree.first[i] + k] = place + k;
    }
    next[i] = place + tree.count[i];
    next_joint[i] = joint + 1;
    place += size[i];
    joint += joints_below[i];
  }
  for (int j = 0; j < model.nv; ++j) {
    const int i = tree.dofs[j].joint;
    for (int p = model.parent[i]; p >= 0; p = model.parent[p]) {
      for (int k = tree.first[p]; k < tree.first[p] + tree.count[p]; ++k) tree.path.push_back(k);
    }
    for (int at = tree.begin[i]; at < tree.end[i]; ++at) tree.path.push_back(tree.dof_at[at]);
    tree.path_end.push_back(static_cast<int>(tree.path.size()));
  }
  return tree;
}

template <class T>
struct Data {
  explicit Data(const Model<T>& model) : tree(tree_of(model)), shape(tree_shape_of(model)) {
    const int n = model.njoints(), nv = model.nv;
    for (auto* x : {&X_PB, &X_WB}) x->resize(n);
    for (auto* x : {&v, &a, &a_gf}) x->resize(n);
    for (auto* x : {&f, &p_A}) x->resize(n);
    for (auto* x : {&S_dot, &S_ddot, &S_v}) x->resize(nv);
    for (auto* x : {&angles, &sines, &cosines}) x->resize(tree.turning.size());
    stride = static_cast<int>(detail::whole_lines<T>(nv));
    const auto lanes = [&](int quantities) {
      return detail::LaneArray<T>(std::ptrdiff_t{stride} * quantities);
    };
    travellers = lanes(21);
    rows = lanes(5);
    responses = lanes(6 * (tree.deepest + 1));
    upper = columns_of_minverse = lanes(nv);
    composites.resize(n);
    velocity_products.resize(n);
    articulated.resize(n);
    U.resize(nv);
    ldlt.resize(n);
    for (auto* x : {&tau, &ddq, &nle, &g, &D_inverse, &u}) *x = VectorX<T>::Zero(nv);
    for (auto* x : {&M, &Minv, &dtau_dq, &dtau_dv, &ddq_dq, &ddq_dv}) *x = MatrixX<T>::Zero(nv, nv);
    J = Matrix6X<T>::Zero(6, nv);
  }

  Tree tree;
  TreeShape shape;  // of the model
  // Mimic joints, for forward dynamics (following.h); none by default.
  std::optional<Following<T>> following;

  // Of the joints in tree.turning, in plain double only.
  std::vector<T> angles, sines, cosines;

  // Kinematics, per body.
  std::vector<Placement<T>> X_PB;  // body in its parent (for a root: in the world)
  std::vector<Placement<T>> X_WB;  // body in the world
  std::vector<Motion<T>> v;        // velocity, in the body frame
  std::vector<Motion<T>> a;        // spatial acceleration, in the body frame

  // Results.
  VectorX<T> tau, ddq, nle, g;  // (nv)
  MatrixX<T> M, Minv;           // (nv x nv), both triangles
  MatrixX<T> dtau_dq, dtau_dv;  // (nv x nv) columns: tangent increments
  bool across = false;          // true if these have entries off the paths of the tree, which effects may add
  MatrixX<T> ddq_dq, ddq_dv;    // (nv x nv)
  Matrix6X<T> J;                // (6 x nv)
  T kinetic_energy = T(0), potential_energy = T(0);

  // Working memory.
  std::vector<Motion<T>> a_gf;                // acceleration relative to free fall, in the body frame
  std::vector<Force<T>> f, p_A;               // force through the joint; articulated bias force
  std::vector<Motion<T>> S_dot, S_ddot, S_v;  // (nv) see algorithms.h, derivatives
  std::vector<Composite<T>> composites;
  std::vector<VelocityProduct<T>> velocity_products;
  std::vector<Articulated<T>> articulated;
  std::vector<Force<T>> U;     // (nv) I_A S
  std::vector<Ldlt6<T>> ldlt;  // of the free-flyers
  VectorX<T> D_inverse, u;     // (nv)

  // Column by column, in the order of the tree, each quantity `stride` apart (detail/columns.hxx).
  int stride = 0;
  detail::LaneArray<T> travellers;           // (21) forces on the way to the root
  detail::LaneArray<T> rows;                 // (5) entries of the joint that they pass
  detail::LaneArray<T> responses;            // (6) per depth: motions in response to unit torques
  detail::LaneArray<T> upper;                // (nv) rows of Minv, right of the diagonal
  detail::LaneArray<T> columns_of_minverse;  // (nv)
};

}  // namespace dyntape::dynamics
