// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/algorithms/mimic.h>
#include <dyntape/dynamics/algorithms/detail/following.hxx>

#include <algorithm>

namespace dyntape::dynamics {
namespace detail {

// `count` full entries from `first` on follow nobody.
inline void own(int first, int count, std::vector<FollowedEntry>& entries, std::vector<int>& owners) {
  for (int k = first; k < first + count; ++k) {
    entries[k].index = static_cast<int>(owners.size());
    owners.push_back(k);
  }
}

template <class T>
VectorX<T> expanded(const std::vector<FollowedEntry>& entries, const VectorRef<T>& x) {
  VectorX<T> full(entries.size());
  expand<T>(entries, x, full);
  return full;
}

// The entries of joints that follow nobody.
template <class T>
VectorX<T> owned(const std::vector<int>& owners, const VectorX<T>& full) {
  VectorX<T> result(owners.size());
  for (size_t k = 0; k < owners.size(); ++k) result[k] = full[owners[k]];
  return result;
}

template <class T>
void check_arguments(const char* function, const MimicModel<T>& model, const MimicData<T>& data,
                     const VectorRef<T>& q, const VectorRef<T>* v = nullptr, const VectorRef<T>* w = nullptr,
                     const char* last = "a") {
  check(function, "q", model.full, q.size(), model.nq);
  if (v) check(function, "v", model.full, v->size(), model.nv);
  if (w) check(function, last, model.full, w->size(), model.nv);
  check(function, "data", model.full, data.tau.size(), model.nv);
}

template <class T>
void expand_arguments(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q,
                      const VectorRef<T>* v = nullptr, const VectorRef<T>* w = nullptr) {
  expand<T>(model.q_entries, q, data.q_full);
  if (v) expand<T>(model.v_entries, *v, data.v_full);
  if (w) expand<T>(model.v_entries, *w, data.w_full);
}

// Torques of the leaders, none on followers.
template <class T>
void scatter_torques(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& tau) {
  data.w_full.setZero();
  for (int k = 0; k < model.nv; ++k) data.w_full[model.v_owners[k]] = tau[k];
}

// The rows and columns of leaders.
template <class T>
void keep_owned(const MimicModel<T>& model, const MatrixX<T>& full, MatrixX<T>& result) {
  for (int c = 0; c < model.nv; ++c) {
    for (int r = 0; r < model.nv; ++r) result(r, c) = full(model.v_owners[r], model.v_owners[c]);
  }
}

// The rows of leaders, columns times G.
template <class T>
void keep_owned_rows(const MimicModel<T>& model, const MatrixX<T>& full, MatrixX<T>& result) {
  result.setZero();
  for (int c = 0; c < model.full.nv; ++c) {
    const FollowedEntry& column = model.v_entries[c];
    for (int r = 0; r < model.nv; ++r) {
      result(r, column.index) += scaled<T>(full(model.v_owners[r], c), column.factor);
    }
  }
}

template <class T>
void gather_derivatives(const MimicModel<T>& model, MimicData<T>& data) {
  gather_into<T>(model.v_entries, data.full.tau, data.tau);
  gather_into(model.v_entries, data.full.dtau_dq, data.dtau_dq);
  gather_into(model.v_entries, data.full.dtau_dv, data.dtau_dv);
  gather_into(model.v_entries, data.full.M, data.M);
  make_symmetric(data.M);
}

}  // namespace detail

template <class T>
MimicModel<T>::MimicModel(const Model<T>& model, const std::vector<MimicRule>& given)
    : full(model), name(model.name) {
  check_mimic_rules(name, joint_kinds(full), given);
  rules = resolved(given);
  const auto rule_of = [&](const std::string& joint) {
    const auto is_of = [&](const MimicRule& rule) { return rule.joint == joint; };
    return std::find_if(rules.begin(), rules.end(), is_of);
  };
  q_entries.resize(full.nq);
  v_entries.resize(full.nv);
  for (const Joint<T>& joint : full.joints) {
    if (rule_of(joint.name) != rules.end()) continue;
    detail::own(joint.idx_q, dynamics::nq(joint.type), q_entries, q_owners);
    detail::own(joint.idx_v, dynamics::nv(joint.type), v_entries, v_owners);
  }
  nq = static_cast<int>(q_owners.size());
  nv = static_cast<int>(v_owners.size());
  for (const Joint<T>& joint : full.joints) {
    const auto rule = rule_of(joint.name);
    if (rule == rules.end()) continue;
    const Joint<T>& leader = full.joints[full.joint_index(rule->leader)];
    q_entries[joint.idx_q] = {q_entries[leader.idx_q].index, rule->multiplier, rule->offset};
    v_entries[joint.idx_v] = {v_entries[leader.idx_v].index, rule->multiplier, 0};
  }
}

template <class T>
MimicData<T>::MimicData(const MimicModel<T>& model) : full(model.full) {
  full.following = following(model);
  const int n = model.nv;
  for (auto* x : {&tau, &ddq, &nle, &g}) *x = VectorX<T>::Zero(n);
  for (auto* x : {&M, &Minv, &dtau_dq, &dtau_dv, &ddq_dq, &ddq_dv}) *x = MatrixX<T>::Zero(n, n);
  q_full = VectorX<T>::Zero(model.full.nq);
  for (auto* x : {&v_full, &w_full}) *x = VectorX<T>::Zero(model.full.nv);
}

template <class T>
VectorX<T> expand_configuration(const MimicModel<T>& model, const VectorRef<T>& q) {
  detail::check("expand_configuration", "q", model.full, q.size(), model.nq);
  return detail::expanded<T>(model.q_entries, q);
}

template <class T>
VectorX<T> expand_tangent(const MimicModel<T>& model, const VectorRef<T>& v) {
  detail::check("expand_tangent", "v", model.full, v.size(), model.nv);
  return detail::expanded<T>(model.v_entries, v);
}

template <class T>
VectorX<T> gather(const MimicModel<T>& model, const VectorRef<T>& tau_full) {
  detail::check("gather", "tau", model.full, tau_full.size(), model.full.nv);
  VectorX<T> tau(model.nv);
  detail::gather_into<T>(model.v_entries, tau_full, tau);
  return tau;
}

template <class T>
MatrixX<T> gather_columns(const MimicModel<T>& model, const MatrixX<T>& J_full) {
  detail::check("gather_columns", "J", model.full, J_full.cols(), model.full.nv);
  MatrixX<T> J = MatrixX<T>::Zero(J_full.rows(), model.nv);
  for (int c = 0; c < model.full.nv; ++c) {
    const auto& entry = model.v_entries[c];
    for (int r = 0; r < J.rows(); ++r) J(r, entry.index) += detail::scaled<T>(J_full(r, c), entry.factor);
  }
  return J;
}

template <class T>
MatrixX<T> gather_both(const MimicModel<T>& model, const MatrixX<T>& D_full) {
  detail::check("gather_both", "D", model.full, D_full.rows(), model.full.nv);
  detail::check("gather_both", "D", model.full, D_full.cols(), model.full.nv);
  MatrixX<T> D(model.nv, model.nv);
  detail::gather_into(model.v_entries, D_full, D);
  return D;
}

template <class T>
const VectorX<T>& rnea(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q,
                       const VectorRef<T>& v, const VectorRef<T>& a, const Acting<T>& acting) {
  detail::check_arguments("rnea", model, data, q, &v, &a);
  detail::expand_arguments(model, data, q, &v, &a);
  detail::gather_into<T>(model.v_entries,
                         rnea<T>(model.full, data.full, data.q_full, data.v_full, data.w_full, acting),
                         data.tau);
  return data.tau;
}

template <class T>
const VectorX<T>& nonlinear_effects(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q,
                                    const VectorRef<T>& v, const Acting<T>& acting) {
  detail::check_arguments("nonlinear_effects", model, data, q, &v);
  detail::expand_arguments(model, data, q, &v);
  detail::gather_into<T>(model.v_entries,
                         nonlinear_effects<T>(model.full, data.full, data.q_full, data.v_full, acting),
                         data.nle);
  return data.nle;
}

template <class T>
const VectorX<T>& generalized_gravity(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q) {
  detail::check_arguments("generalized_gravity", model, data, q);
  detail::expand_arguments(model, data, q);
  detail::gather_into<T>(model.v_entries, generalized_gravity<T>(model.full, data.full, data.q_full), data.g);
  return data.g;
}

template <class T>
const MatrixX<T>& crba(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q,
                       const Acting<T>& acting) {
  detail::check_arguments("crba", model, data, q);
  detail::expand_arguments(model, data, q);
  detail::gather_into(model.v_entries, crba<T>(model.full, data.full, data.q_full, acting), data.M);
  detail::make_symmetric(data.M);
  return data.M;
}

template <class T>
const VectorX<T>& aba(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q,
                      const VectorRef<T>& v, const VectorRef<T>& tau, const Acting<T>& acting) {
  detail::check_arguments("aba", model, data, q, &v, &tau, "tau");
  detail::expand_arguments(model, data, q, &v);
  detail::scatter_torques(model, data, tau);
  aba<T>(model.full, data.full, data.q_full, data.v_full, data.w_full, acting);
  for (int k = 0; k < model.nv; ++k) data.ddq[k] = data.full.ddq[model.v_owners[k]];
  return data.ddq;
}

template <class T>
const MatrixX<T>& minverse(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q,
                           const Acting<T>& acting) {
  detail::check_arguments("minverse", model, data, q);
  detail::expand_arguments(model, data, q);
  detail::keep_owned(model, minverse<T>(model.full, data.full, data.q_full, acting), data.Minv);
  return data.Minv;
}

template <class T>
void id_derivatives(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q,
                    const VectorRef<T>& v, const VectorRef<T>& a, const Acting<T>& acting) {
  detail::check_arguments("id_derivatives", model, data, q, &v, &a);
  detail::expand_arguments(model, data, q, &v, &a);
  id_derivatives<T>(model.full, data.full, data.q_full, data.v_full, data.w_full, acting);
  detail::gather_derivatives(model, data);
}

template <class T>
void fd_derivatives(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q,
                    const VectorRef<T>& v, const VectorRef<T>& tau, const Acting<T>& acting) {
  detail::check_arguments("fd_derivatives", model, data, q, &v, &tau, "tau");
  detail::expand_arguments(model, data, q, &v);
  detail::scatter_torques(model, data, tau);
  fd_derivatives<T>(model.full, data.full, data.q_full, data.v_full, data.w_full, acting);
  for (int k = 0; k < model.nv; ++k) data.ddq[k] = data.full.ddq[model.v_owners[k]];
  detail::keep_owned(model, data.full.Minv, data.Minv);
  detail::keep_owned_rows(model, data.full.ddq_dq, data.ddq_dq);
  detail::keep_owned_rows(model, data.full.ddq_dv, data.ddq_dv);
  detail::gather_derivatives(model, data);
}

template <class T>
const T& kinetic_energy(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q,
                        const VectorRef<T>& v, const Acting<T>& acting) {
  detail::check_arguments("kinetic_energy", model, data, q, &v);
  detail::expand_arguments(model, data, q, &v);
  return data.kinetic_energy = kinetic_energy<T>(model.full, data.full, data.q_full, data.v_full, acting);
}

template <class T>
const T& potential_energy(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q) {
  detail::check_arguments("potential_energy", model, data, q);
  detail::expand_arguments(model, data, q);
  return data.potential_energy = potential_energy<T>(model.full, data.full, data.q_full);
}

template <class T>
VectorX<T> integrate(const MimicModel<T>& model, const VectorRef<T>& q, const VectorRef<T>& v) {
  return detail::owned<T>(model.q_owners,
                          integrate<T>(model.full, expand_configuration(model, q), expand_tangent(model, v)));
}

template <class T>
VectorX<T> difference(const MimicModel<T>& model, const VectorRef<T>& q0, const VectorRef<T>& q1) {
  return detail::owned<T>(model.v_owners, difference<T>(model.full, expand_configuration(model, q0),
                                                        expand_configuration(model, q1)));
}

template <class T>
VectorX<T> neutral(const MimicModel<T>& model) {
  return detail::owned<T>(model.q_owners, neutral(model.full));
}

template <class T>
VectorX<T> random_configuration(const MimicModel<T>& model, std::mt19937_64& random) {
  return detail::owned<T>(model.q_owners, random_configuration(model.full, random));
}

}  // namespace dyntape::dynamics
