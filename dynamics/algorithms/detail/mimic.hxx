// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/algorithms/mimic.h>
#include <dyntape/dynamics/algorithms/detail/following.hxx>

#include <algorithm>

namespace dyntape::dynamics {
namespace detail {

// `count` full entries from `first` on follow no joint.
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

// The entries of joints that follow no joint.
template <class T>
VectorX<T> owned(const std::vector<int>& owners, const VectorX<T>& full) {
  VectorX<T> result(owners.size());
  for (size_t k = 0; k < owners.size(); ++k) result[k] = full[owners[k]];
  return result;
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
    if (joint.type == JointType::kContinuous) {
      using Is = FollowedEntry::Is;
      q_entries[joint.idx_q].is = leader.type == joint.type ? Is::kPairOfPair : Is::kPairOfAngle;
      q_entries[joint.idx_q + 1] = {q_entries[leader.idx_q].index, 0, 0, Is::kSecondOfPair};
    }
    v_entries[joint.idx_v] = {v_entries[leader.idx_v].index, rule->multiplier, 0};
  }
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
VectorX<T> integrate(const MimicModel<T>& model, const VectorRef<T>& q, const VectorRef<T>& v) {
  return detail::owned<T>(model.q_owners,
                          integrate<T>(model.full, expand_configuration(model, q), expand_tangent(model, v)));
}

template <class T>
VectorX<T> random_configuration(const MimicModel<T>& model, std::mt19937_64& random) {
  return detail::owned<T>(model.q_owners, random_configuration(model.full, random));
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_MIMIC(T, ...)                                                                    \
  __VA_ARGS__ template struct dyntape::dynamics::MimicModel<T>;                                              \
  DYNTAPE_COMPILE(expand_configuration, T, __VA_ARGS__)                                                      \
  DYNTAPE_COMPILE(expand_tangent, T, __VA_ARGS__)                                                            \
  DYNTAPE_COMPILE(gather, T, __VA_ARGS__)                                                                    \
  DYNTAPE_COMPILE(gather_columns, T, __VA_ARGS__)                                                            \
  DYNTAPE_COMPILE(gather_both, T, __VA_ARGS__)                                                               \
  namespace dyntape::dynamics {                                                                              \
  __VA_ARGS__ template VectorX<T> integrate(const MimicModel<T>&, const VectorRef<T>&, const VectorRef<T>&); \
  __VA_ARGS__ template VectorX<T> random_configuration(const MimicModel<T>&, std::mt19937_64&);              \
  }

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_MIMIC)
