// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/dynamics/algorithms/detail/kinematics.hxx>
#include <dyntape/dynamics/effects/detail/effects.hxx>

#include <algorithm>
#include <utility>
#include <vector>

namespace dyntape::dynamics {

template <class T>
Constraint<T> point_constraint(const Model<T>& model, int frame,
                               const std::type_identity_t<Vector3<T>>& point) {
  const Frame<T>& F = detail::frame_at("point_constraint", model, frame);
  return {.rows = 3, .body_1 = F.body, .X_1 = F.X_BF, .X_2 = {Matrix3<T>::Identity(), point}};
}

template <class T>
Constraint<T> frame_constraint(const Model<T>& model, int frame,
                               const std::type_identity_t<Placement<T>>& placement) {
  const Frame<T>& F = detail::frame_at("frame_constraint", model, frame);
  return {.rows = 6, .body_1 = F.body, .X_1 = F.X_BF, .X_2 = placement};
}

template <class T>
Constraint<T> loop_constraint(const Model<T>& model, int frame_1, int frame_2, int rows) {
  const Frame<T>& F = detail::frame_at("loop_constraint", model, frame_1);
  const Frame<T>& G = detail::frame_at("loop_constraint", model, frame_2);
  return {.rows = rows, .body_1 = F.body, .X_1 = F.X_BF, .body_2 = G.body, .X_2 = G.X_BF};
}

namespace detail {

// --- Chains: frame 1 relative to frame 2, over the joints between them, those of body 2 backwards ----------

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

// --- All constraints ----------------------------------------------------------------------------------------

template <class T>
int count_rows(const std::vector<Constraint<T>>& list) {
  int rows = 0;
  for (const Constraint<T>& constraint : list) rows += constraint.rows;
  return rows;
}

}  // namespace detail

template <class T>
ConstraintData<T>::ConstraintData(const Model<T>& model, std::vector<Constraint<T>> list)
    : shape(tree_shape_of(model)), constraints(std::move(list)), delassus(detail::count_rows(constraints)) {
  const Tree tree = tree_of(model);
  int m = 0;
  for (const Constraint<T>& constraint : constraints) {
    chains.push_back(detail::chain_of(model, tree, constraint, m));
    columns.emplace_back(chains.back().dofs.size());
    m += constraint.rows;
  }
  const int nv = model.nv;
  for (auto* x : {&error, &velocity, &bias, &lambda, &residual, &impulse, &rhs}) *x = VectorX<T>::Zero(m);
  for (auto* x : {&ddq, &v_plus, &step, &along}) *x = VectorX<T>::Zero(nv);
  for (auto* x : {&J, &lambda_dq, &lambda_dv, &lambda_dtau, &impulse_dq, &impulse_dv, &A_dq, &A_dv}) {
    *x = MatrixX<T>::Zero(m, nv);
  }
  for (auto* x : {&ddq_dq, &ddq_dv, &ddq_dtau, &v_plus_dq, &v_plus_dv, &P}) *x = MatrixX<T>::Zero(nv, nv);
  for (auto* x : {&K, &Z}) *x = MatrixX<T>::Zero(nv, m);
  G_inverse = MatrixX<T>::Zero(m, m);
}

namespace detail {

template <class T>
void check_constraints(const char* function, const Model<T>& model, const ConstraintData<T>& c) {
  check_shape(function, "constraint data", model, c.shape);
  check(function, "constraints", model, static_cast<long>(c.constraints.size()),
        static_cast<long>(c.chains.size()));
}

// e, J v, gamma and J for placed joints: (L.4) to (L.6).
template <class T>
void move_constraints(const Data<T>& data, ConstraintData<T>& c, const VectorRef<T>& v) {
  for (std::size_t i = 0; i < c.chains.size(); ++i) {
    const ConstraintChain& chain = c.chains[i];
    const Placement<T> X_21 = place_chain(data, c.constraints[i], chain, c.columns[i]);
    for (std::size_t k = 0; k < chain.dofs.size(); ++k) {
      set_rows<T>(c.J.col(chain.dofs[k]), chain, c.columns[i][k].linear, c.columns[i][k].angular);
    }
    const auto [V, A] = chain_motion<T>(chain, c.columns[i], v);
    set_rows<T>(c.velocity, chain, V.linear, V.angular);
    set_rows<T>(c.bias, chain, A.linear + V.angular.cross(V.linear), A.angular);
    const Vector3<T> distance = X_21.R.transpose() * X_21.p;
    set_rows<T>(c.error, chain, distance, chain.rows == 6 ? log(X_21.R) : distance);
  }
}

// y += J x.
template <class T>
void add_rows(const ConstraintData<T>& c, const VectorX<T>& x, VectorX<T>& y) {
  for (const ConstraintChain& chain : c.chains) {
    for (int k : chain.dofs) {
      for (int r = chain.first_row; r < chain.first_row + chain.rows; ++r) y[r] += c.J(r, k) * x[k];
    }
  }
}

// K = M^-1 J^T and J M^-1 J^T, over the joints of each chain only.
template <class T>
void factor_delassus(const Data<T>& data, ConstraintData<T>& c) {
  c.K.setZero();
  for (const ConstraintChain& chain : c.chains) {
    for (int r = chain.first_row; r < chain.first_row + chain.rows; ++r) {
      for (int k : chain.dofs) c.K.col(r) += data.Minv.col(k) * c.J(r, k);
    }
  }
  for (const ConstraintChain& chain : c.chains) {
    for (int r = chain.first_row; r < chain.first_row + chain.rows; ++r) {
      for (int s = 0; s <= r; ++s) {
        T sum(0);
        for (int k : chain.dofs) sum += c.J(r, k) * c.K(k, s);
        c.G_inverse(r, s) = sum;
      }
    }
  }
  c.delassus.factor(c.G_inverse, c.independent);
}

// Minimises the residual J x + rhs over x + K y, y the force; once more against rounding: (L.8).
template <class T>
void meet_constraints(ConstraintData<T>& c, VectorX<T>& x, VectorX<T>& y) {
  y.setZero();
  for (int round = 0; round < 2; ++round) {
    c.residual = c.rhs;
    add_rows(c, x, c.residual);
    c.residual = -c.residual;
    c.delassus.solve(c.residual);
    y += c.residual;
    for (long r = 0; r < y.size(); ++r) x += c.K.col(r) * c.residual[r];
  }
  c.residual = c.rhs;
  add_rows(c, x, c.residual);
}

// gamma + kd J v + kp e.
template <class T>
void demand_acceleration(ConstraintData<T>& c) {
  c.rhs = c.bias;
  for (std::size_t i = 0; i < c.chains.size(); ++i) {
    const Constraint<T>& constraint = c.constraints[i];
    const int first = c.chains[i].first_row, rows = c.chains[i].rows;
    if (constraint.kd != 0) c.rhs.segment(first, rows) += c.velocity.segment(first, rows) * T(constraint.kd);
    if (constraint.kp != 0) c.rhs.segment(first, rows) += c.error.segment(first, rows) * T(constraint.kp);
  }
}

}  // namespace detail

template <class T>
void constraint_kinematics(const Model<T>& model, Data<T>& data, ConstraintData<T>& c, const VectorRef<T>& q,
                           const VectorRef<T>& v) {
  detail::check_arguments("constraint_kinematics", model, data, q, &v);
  detail::check_constraints("constraint_kinematics", model, c);
  detail::place_joints(model, data, q);
  detail::move_constraints(data, c, v);
}

template <class T>
const VectorX<T>& constrained_dynamics(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                       const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& tau,
                                       const DynamicsTerms<T>& acting) {
  detail::check_arguments("constrained_dynamics", model, data, q, &v, &tau, "tau");
  detail::check_constraints("constrained_dynamics", model, c);
  minverse(model, data, q, acting);
  nonlinear_effects(model, data, q, v, acting);  // leaves the joints placed, as minverse does
  detail::move_constraints(data, c, v);
  detail::factor_delassus(data, c);
  c.along = tau - data.nle;
  c.ddq.setZero();
  for (int k = 0; k < model.nv; ++k) c.ddq += data.Minv.col(k) * c.along[k];
  detail::demand_acceleration(c);
  detail::meet_constraints(c, c.ddq, c.lambda);
  return c.ddq;
}

template <class T>
const VectorX<T>& constrained_dynamics(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                       EffectTorques<T>& torques, const Effects<T>& effects,
                                       const VectorRef<T>& q, const VectorRef<T>& v,
                                       const VectorRef<T>& tau) {
  detail::check_arguments("constrained_dynamics", model, data, q, &v, &tau, "tau");
  if (!detail::adds_torques(effects))
    return constrained_dynamics(model, data, c, q, v, tau, effects.acting());
  return constrained_dynamics<T>(model, data, c, q, v,
                                 detail::total_torques(model, data, torques, effects, q, v, tau),
                                 effects.acting());
}

template <class T>
const VectorX<T>& impulse_dynamics(const Model<T>& model, Data<T>& data, ConstraintData<T>& c,
                                   const VectorRef<T>& q, const VectorRef<T>& v,
                                   const std::type_identity_t<T>& restitution,
                                   const DynamicsTerms<T>& acting) {
  detail::check_arguments("impulse_dynamics", model, data, q, &v);
  detail::check_constraints("impulse_dynamics", model, c);
  minverse(model, data, q, acting);
  detail::move_constraints(data, c, v);
  detail::factor_delassus(data, c);
  c.v_plus = v;
  c.rhs = c.velocity * restitution;
  detail::meet_constraints(c, c.v_plus, c.impulse);
  return c.v_plus;
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_CONSTRAINTS(T, ...)                                                              \
  __VA_ARGS__ template struct dyntape::dynamics::ConstraintData<T>;                                          \
  DYNTAPE_COMPILE(point_constraint, T, __VA_ARGS__)                                                          \
  DYNTAPE_COMPILE(frame_constraint, T, __VA_ARGS__)                                                          \
  DYNTAPE_COMPILE(loop_constraint, T, __VA_ARGS__)                                                           \
  DYNTAPE_COMPILE(constraint_kinematics, T, __VA_ARGS__)                                                     \
  DYNTAPE_COMPILE(impulse_dynamics, T, __VA_ARGS__)                                                          \
  namespace dyntape::dynamics {                                                                              \
  __VA_ARGS__ template const VectorX<T>& constrained_dynamics(const Model<T>&, Data<T>&, ConstraintData<T>&, \
                                                              const VectorRef<T>&, const VectorRef<T>&,      \
                                                              const VectorRef<T>&, const DynamicsTerms<T>&); \
  __VA_ARGS__ template const VectorX<T>& constrained_dynamics(const Model<T>&, Data<T>&, ConstraintData<T>&, \
                                                              EffectTorques<T>&, const Effects<T>&,          \
                                                              const VectorRef<T>&, const VectorRef<T>&,      \
                                                              const VectorRef<T>&);                          \
  }

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_CONSTRAINTS)
