// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/mimic.h>
#include <dyntape/dynamics/detail/checks.hxx>

#include <algorithm>

namespace dyntape::dynamics {
namespace detail {

// Structure is decided on plain numbers: a factor of one leaves no product.
template <class T>
T scaled(const T& x, double factor) {
  return factor == 1 ? x : T(x * T(factor));
}

template <class T>
void expand(const std::vector<typename MimicModel<T>::Entry>& entries, const VectorRef<T>& x,
            VectorX<T>& full) {
  for (size_t k = 0; k < entries.size(); ++k) {
    full[k] = scaled<T>(x[entries[k].index], entries[k].factor);
    if (entries[k].offset != 0) full[k] += T(entries[k].offset);
  }
}

template <class T>
void gather_into(const MimicModel<T>& model, const VectorRef<T>& full, VectorX<T>& result) {
  result.setZero();
  for (int k = 0; k < model.full.nv; ++k) {
    result[model.v_entries[k].index] += scaled<T>(full[k], model.v_entries[k].factor);
  }
}

template <class T>
void gather_into(const MimicModel<T>& model, const MatrixX<T>& full, MatrixX<T>& result) {
  result.setZero();
  for (int c = 0; c < model.full.nv; ++c) {
    for (int r = 0; r < model.full.nv; ++r) {
      const auto &row = model.v_entries[r], &column = model.v_entries[c];
      result(row.index, column.index) += scaled<T>(full(r, c), row.factor * column.factor);
    }
  }
}

template <class T>
void make_symmetric(MatrixX<T>& M) {
  for (int c = 0; c < M.cols(); ++c) {
    for (int r = 0; r < c; ++r) M(c, r) = M(r, c);
  }
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

// M = L^T D L, from the last row to the first (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, 6.3).
template <class T>
void factorise(MimicData<T>& data) {
  data.L = data.M;
  MatrixX<T>& L = data.L;
  for (int k = static_cast<int>(L.rows()) - 1; k >= 0; --k) {
    data.D_inverse[k] = T(1) / L(k, k);
    for (int i = k - 1; i >= 0; --i) {
      const T a = L(k, i) * data.D_inverse[k];
      for (int j = i; j >= 0; --j) L(i, j) -= a * L(k, j);
      L(k, i) = a;
    }
  }
}

// x becomes M^-1 x.
template <class T, class Column>
void solve(const MimicData<T>& data, Column&& x) {
  const int n = static_cast<int>(data.D_inverse.size());
  for (int i = n - 1; i >= 0; --i) {
    for (int j = 0; j < i; ++j) x[j] -= data.L(i, j) * x[i];
  }
  for (int i = 0; i < n; ++i) {
    x[i] *= data.D_inverse[i];
    for (int j = 0; j < i; ++j) x[i] -= data.L(i, j) * x[j];
  }
}

template <class T>
void factorise_mass(const MimicModel<T>& model, MimicData<T>& data, const Acting<T>& acting) {
  gather_into(model, crba<T>(model.full, data.full, data.q_full, acting), data.M);
  make_symmetric(data.M);
  factorise(data);
}

template <class T>
void invert(MimicData<T>& data) {
  data.Minv.setIdentity();
  for (int c = 0; c < data.Minv.cols(); ++c) solve(data, data.Minv.col(c));
  make_symmetric(data.Minv);
}

// data.ddq from the mass matrix's factors and the bias at (q_full, v_full).
template <class T>
void accelerate(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& tau,
                const Acting<T>& acting) {
  gather_into<T>(model, nonlinear_effects<T>(model.full, data.full, data.q_full, data.v_full, acting),
                 data.nle);
  data.ddq = tau - data.nle;
  solve(data, data.ddq);
}

template <class T>
void gather_derivatives(const MimicModel<T>& model, MimicData<T>& data) {
  gather_into<T>(model, data.full.tau, data.tau);
  gather_into(model, data.full.dtau_dq, data.dtau_dq);
  gather_into(model, data.full.dtau_dv, data.dtau_dv);
  gather_into(model, data.full.M, data.M);
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
    for (int k = joint.idx_q; k < joint.idx_q + dynamics::nq(joint.type); ++k) {
      q_entries[k].index = nq++;
      q_owners.push_back(k);
    }
    for (int k = joint.idx_v; k < joint.idx_v + dynamics::nv(joint.type); ++k) {
      v_entries[k].index = nv++;
      v_owners.push_back(k);
    }
  }
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
  const int n = model.nv;
  for (auto* x : {&tau, &ddq, &nle, &g, &D_inverse}) *x = VectorX<T>::Zero(n);
  for (auto* x : {&M, &Minv, &dtau_dq, &dtau_dv, &ddq_dq, &ddq_dv, &L}) *x = MatrixX<T>::Zero(n, n);
  q_full = VectorX<T>::Zero(model.full.nq);
  for (auto* x : {&v_full, &w_full}) *x = VectorX<T>::Zero(model.full.nv);
}

template <class T>
VectorX<T> expand_configuration(const MimicModel<T>& model, const VectorRef<T>& q) {
  detail::check("expand_configuration", "q", model.full, q.size(), model.nq);
  VectorX<T> full(model.full.nq);
  detail::expand<T>(model.q_entries, q, full);
  return full;
}

template <class T>
VectorX<T> expand_tangent(const MimicModel<T>& model, const VectorRef<T>& v) {
  detail::check("expand_tangent", "v", model.full, v.size(), model.nv);
  VectorX<T> full(model.full.nv);
  detail::expand<T>(model.v_entries, v, full);
  return full;
}

template <class T>
VectorX<T> gather(const MimicModel<T>& model, const VectorRef<T>& tau_full) {
  detail::check("gather", "tau", model.full, tau_full.size(), model.full.nv);
  VectorX<T> tau(model.nv);
  detail::gather_into<T>(model, tau_full, tau);
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
  detail::gather_into(model, D_full, D);
  return D;
}

template <class T>
const VectorX<T>& rnea(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q,
                       const VectorRef<T>& v, const VectorRef<T>& a, const Acting<T>& acting) {
  detail::check_arguments("rnea", model, data, q, &v, &a);
  detail::expand_arguments(model, data, q, &v, &a);
  detail::gather_into<T>(model, rnea<T>(model.full, data.full, data.q_full, data.v_full, data.w_full, acting),
                         data.tau);
  return data.tau;
}

template <class T>
const VectorX<T>& nonlinear_effects(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q,
                                    const VectorRef<T>& v, const Acting<T>& acting) {
  detail::check_arguments("nonlinear_effects", model, data, q, &v);
  detail::expand_arguments(model, data, q, &v);
  detail::gather_into<T>(model, nonlinear_effects<T>(model.full, data.full, data.q_full, data.v_full, acting),
                         data.nle);
  return data.nle;
}

template <class T>
const VectorX<T>& generalized_gravity(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q) {
  detail::check_arguments("generalized_gravity", model, data, q);
  detail::expand_arguments(model, data, q);
  detail::gather_into<T>(model, generalized_gravity<T>(model.full, data.full, data.q_full), data.g);
  return data.g;
}

template <class T>
const MatrixX<T>& crba(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q,
                       const Acting<T>& acting) {
  detail::check_arguments("crba", model, data, q);
  detail::expand_arguments(model, data, q);
  detail::gather_into(model, crba<T>(model.full, data.full, data.q_full, acting), data.M);
  detail::make_symmetric(data.M);
  return data.M;
}

template <class T>
const VectorX<T>& aba(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q,
                      const VectorRef<T>& v, const VectorRef<T>& tau, const Acting<T>& acting) {
  detail::check_arguments("aba", model, data, q, &v, &tau, "tau");
  detail::expand_arguments(model, data, q, &v);
  detail::factorise_mass(model, data, acting);
  detail::accelerate(model, data, tau, acting);
  return data.ddq;
}

template <class T>
const MatrixX<T>& minverse(const MimicModel<T>& model, MimicData<T>& data, const VectorRef<T>& q,
                           const Acting<T>& acting) {
  detail::check_arguments("minverse", model, data, q);
  detail::expand_arguments(model, data, q);
  detail::factorise_mass(model, data, acting);
  detail::invert(data);
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
  detail::factorise_mass(model, data, acting);
  detail::invert(data);
  detail::accelerate(model, data, tau, acting);
  detail::expand<T>(model.v_entries, data.ddq, data.w_full);
  id_derivatives<T>(model.full, data.full, data.q_full, data.v_full, data.w_full, acting);
  detail::gather_derivatives(model, data);
  data.ddq_dq = -data.dtau_dq;
  data.ddq_dv = -data.dtau_dv;
  for (int c = 0; c < model.nv; ++c) {
    detail::solve(data, data.ddq_dq.col(c));
    detail::solve(data, data.ddq_dv.col(c));
  }
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
