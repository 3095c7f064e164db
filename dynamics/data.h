// SPDX-License-Identifier: BSD-3-Clause
//
// Results and working memory of the algorithms, allocated once.
//
//   Data<double> data(model);
//   const VectorX<double>& tau = rnea(model, data, q, v, a);    // a reference into data
//
// Each algorithm overwrites the fields named in algorithms.h; the others keep their values.  Entries that are
// zero by structure are set to zero here and never touched again.  One Data per thread.
#pragma once

#include <dyntape/dynamics/body.h>
#include <dyntape/dynamics/joints.h>
#include <dyntape/dynamics/ldlt6.h>

#include <vector>

namespace dyntape::dynamics {

// The shape of a tree: what is known without any number of the state.
struct Tree {
  std::vector<Dof> dofs;                  // (nv)
  std::vector<int> first, count;          // (njoints) dofs of joint i: first[i] ... + count[i]
  std::vector<Axis> axes;                 // (njoints)
  std::vector<int> root;                  // (njoints) the joint of the same tree that hangs on the world
  std::vector<std::vector<int>> subtree;  // (njoints) dofs of the joints beyond i, without i's own
};

template <class T>
Tree tree_of(const Model<T>& model) {
  Tree tree;
  const int n = model.njoints();
  tree.subtree.resize(n);
  for (int i = 0; i < n; ++i) {
    const std::vector<Dof> dofs = joint_dofs(model.joints[i], i);
    tree.first.push_back(model.joints[i].idx_v);
    tree.count.push_back(static_cast<int>(dofs.size()));
    tree.axes.push_back(dofs.front().axis);
    tree.root.push_back(model.parent[i] < 0 ? i : tree.root[model.parent[i]]);
    tree.dofs.insert(tree.dofs.end(), dofs.begin(), dofs.end());
    for (int p = model.parent[i]; p >= 0; p = model.parent[p]) {
      for (int k = 0; k < tree.count[i]; ++k) tree.subtree[p].push_back(tree.first[i] + k);
    }
  }
  return tree;
}

template <class T>
struct Data {
  explicit Data(const Model<T>& model) : tree(tree_of(model)) {
    const int n = model.njoints(), nv = model.nv;
    for (auto* x : {&X_PB, &X_WB}) x->resize(n);
    for (auto* x : {&v, &a, &a_gf}) x->resize(n);
    for (auto* x : {&f, &p_A}) x->resize(n);
    for (auto* x : {&S_dot, &S_ddot, &S_v}) x->resize(nv);
    column.resize(n);
    composites.resize(n);
    velocity_products.resize(n);
    articulated.resize(n);
    U.resize(nv);
    F.resize(nv);
    ldlt.resize(n);
    for (auto* x : {&tau, &ddq, &nle, &g, &D_inverse, &u}) *x = VectorX<T>::Zero(nv);
    for (auto* x : {&M, &Minv, &dtau_dq, &dtau_dv, &ddq_dq, &ddq_dv}) *x = MatrixX<T>::Zero(nv, nv);
    J = Matrix6X<T>::Zero(6, nv);
  }

  Tree tree;

  // Kinematics, per body.
  std::vector<Placement<T>> X_PB;  // body in its parent (for a root: in the world)
  std::vector<Placement<T>> X_WB;  // body in the world
  std::vector<Motion<T>> v;        // velocity, in the body frame
  std::vector<Motion<T>> a;        // spatial acceleration, in the body frame

  // Results.
  VectorX<T> tau, ddq, nle, g;  // (nv)
  MatrixX<T> M, Minv;           // (nv x nv), both triangles
  MatrixX<T> dtau_dq, dtau_dv;  // (nv x nv) columns: tangent increments
  MatrixX<T> ddq_dq, ddq_dv;    // (nv x nv)
  Matrix6X<T> J;                // (6 x nv)
  T kinetic_energy = T(0), potential_energy = T(0);
  Vector3<T> com = Vector3<T>::Zero();

  // Working memory.
  std::vector<Motion<T>> a_gf;                // acceleration against free fall, in the body frame
  std::vector<Force<T>> f, p_A;               // force through the joint; articulated bias force
  std::vector<Motion<T>> S_dot, S_ddot, S_v;  // (nv) see algorithms.h, derivatives
  std::vector<Motion<T>> column;              // per body: response to one torque
  std::vector<Composite<T>> composites;
  std::vector<VelocityProduct<T>> velocity_products;
  std::vector<Articulated<T>> articulated;
  std::vector<Force<T>> U, F;  // (nv) I_A S; force columns on their way up
  std::vector<Ldlt6<T>> ldlt;  // of the free-flyers
  VectorX<T> D_inverse, u;     // (nv)
};

}  // namespace dyntape::dynamics
