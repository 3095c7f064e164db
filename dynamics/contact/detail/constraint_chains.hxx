// SPDX-License-Identifier: BSD-3-Clause
//
// Kinematics of frame 1 relative to frame 2: a walk over the joints between them, those of body 2 backwards.
#pragma once

#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/dynamics/algorithms/detail/checks.hxx>

#include <algorithm>
#include <utility>
#include <vector>

namespace dyntape::dynamics::detail {

// Throws ArgumentError unless the constraint fits a model of n joints.
void check_constraint(int rows, int body_1, int body_2, int njoints, const std::string& model);

// Joints from `body` up to, and without, the first that `stop` contains.
inline std::vector<int> way_up(const std::vector<int>& parent, int body, const std::vector<int>& stop) {
  std::vector<int> way;
  for (int i = body; i >= 0; i = parent[i]) {
    if (std::find(stop.begin(), stop.end(), i) != stop.end()) break;
    way.push_back(i);
  }
  return way;
}

template <class T>
ConstraintChain chain_of(const Model<T>& model, const Tree& tree, const Constraint<T>& constraint,
                         int first_row) {
  check_constraint(constraint.rows, constraint.body_1, constraint.body_2, model.njoints(), model.name);
  const std::vector<int> all_1 = way_up(model.parent, constraint.body_1, {});
  const std::vector<int> side_2 = way_up(model.parent, constraint.body_2, all_1);
  const std::vector<int> all_2 = way_up(model.parent, constraint.body_2, {});
  const std::vector<int> side_1 = way_up(model.parent, constraint.body_1, all_2);
  ConstraintChain chain;
  chain.first_row = first_row;
  chain.rows = constraint.rows;
  chain.backward = static_cast<int>(side_2.size());
  const auto add = [&](int joint, bool backward) {
    chain.links.push_back({joint, backward, static_cast<int>(chain.dofs.size()), tree.count[joint]});
    for (int k = 0; k < tree.count[joint]; ++k) chain.dofs.push_back(tree.first[joint] + k);
  };
  for (int joint : side_2) add(joint, true);
  for (auto joint = side_1.rbegin(); joint != side_1.rend(); ++joint) add(*joint, false);
  return chain;
}

template <class T>
Motion<T> operator-(const Motion<T>& m) {
  return {-m.linear, -m.angular};
}

// m += c s.
template <class T>
void add(Motion<T>& m, const Motion<T>& c, const T& s) {
  m.linear += c.linear * s;
  m.angular += c.angular * s;
}

// (L.1): the columns, seen from frame 1, after place_joints; returns X_21.  Places are subtracted where the
// two sides meet, so that the motion of a common ancestor costs no digit.
template <class T>
Placement<T> place_chain(const Data<T>& data, const Constraint<T>& constraint, const ConstraintChain& chain,
                         std::vector<Motion<T>>& columns) {
  const auto& links = chain.links;
  const int n = static_cast<int>(links.size());
  const auto place = [&](const ConstraintChain::Link& link, const Placement<T>& X, bool backward) {
    for (int k = link.first; k < link.first + link.count; ++k) {
      const Motion<T> c = act_inverse(X, motion<T>(data.tree.dofs[chain.dofs[k]]));
      columns[k] = backward ? -c : c;
    }
  };
  // Of each side: the placement of its last joint, or of its frame where no joint is in between.
  Placement<T> X_1 = constraint.X_1, X_2 = constraint.X_2, top_1 = X_1, top_2 = X_2;
  for (int e = n - 1; e >= chain.backward; --e) {
    place(links[e], X_1, false);
    if (e > chain.backward) X_1 = data.X_PB[links[e].joint] * X_1;
  }
  for (int e = 0; e + 1 < chain.backward; ++e) X_2 = data.X_PB[links[e].joint] * X_2;
  if (n > chain.backward) top_1 = data.X_PB[links[chain.backward].joint];
  if (chain.backward > 0) top_2 = data.X_PB[links[chain.backward - 1].joint];
  const Matrix3<T> Rt = top_2.R.transpose();
  Placement<T> X_21{Rt * top_1.R, Rt * (top_1.p - top_2.p)};
  if (n > chain.backward) X_21 = X_21 * X_1;
  if (chain.backward > 0) X_21 = inverse(X_2) * X_21;
  Placement<T> X = constraint.X_2 * X_21;  // frame 1 in the body that the chain has reached
  for (int e = 0; e < chain.backward; ++e) {
    place(links[e], X, true);
    if (e + 1 < chain.backward) X = data.X_PB[links[e].joint] * X;
  }
  return X_21;
}

template <class T>
Motion<T> link_motion(const ConstraintChain& chain, const std::vector<Motion<T>>& columns,
                      const ConstraintChain::Link& link, const VectorRef<T>& x) {
  Motion<T> m;
  for (int k = link.first; k < link.first + link.count; ++k) add(m, columns[k], x[chain.dofs[k]]);
  return m;
}

// (L.2), (L.3): relative velocity, and relative spatial acceleration at zero joint accelerations.
template <class T>
std::pair<Motion<T>, Motion<T>> chain_motion(const ConstraintChain& chain,
                                             const std::vector<Motion<T>>& columns, const VectorRef<T>& v) {
  Motion<T> V, A;
  for (const auto& link : chain.links) {
    const Motion<T> m = link_motion(chain, columns, link, v);
    A = A + cross(V, m);
    V = V + m;
  }
  return {V, A};
}

// Linear rows, and angular ones where there are six.
template <class T, class Block>
void set_rows(Block&& block, const ConstraintChain& chain, const Vector3<T>& linear,
              const Vector3<T>& angular) {
  block.template segment<3>(chain.first_row) = linear;
  if (chain.rows == 6) block.template segment<3>(chain.first_row + 3) = angular;
}

}  // namespace dyntape::dynamics::detail
