// SPDX-License-Identifier: BSD-3-Clause
#include "tied_joints.h"

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>

namespace dyntape::python {
namespace {

using dynamics::FollowedEntry;
using dynamics::VectorX;
using Eigen::VectorXd;

template <class T>
VectorX<T> expanded(const std::vector<FollowedEntry>& entries, const VectorX<T>& own) {
  VectorX<T> all = VectorX<T>::Constant(Eigen::Index(entries.size()), T(0));
  dynamics::detail::expand<T>(entries, own, all);
  return all;
}

// The stage of all joints.
template <class T>
Stage<T> stage_of_all(const dynamics::MimicModel<double>& tied, const Stage<T>& s) {
  const VectorX<T> q = s.x.head(tied.nq), v = s.x.tail(tied.nv);
  Stage<T> all{s.t, VectorX<T>(tied.full.nq + tied.full.nv), s.a, s.u, s.p};
  all.x << expanded<T>(tied.q_entries, q), expanded<T>(tied.v_entries, v);
  if (s.a.size() > 0) all.a = expanded<T>(tied.v_entries, s.a);
  return all;
}

template <class Vector>
Vector entries_at(const std::vector<int>& where, const Vector& all, int first = 0) {
  Vector some(Eigen::Index(where.size()));
  for (std::size_t k = 0; k < where.size(); ++k) some[Eigen::Index(k)] = all[first + where[k]];
  return some;
}

template <class Vector>
Vector own_state(const dynamics::MimicModel<double>& tied, const Vector& all) {
  Vector own(tied.nq + tied.nv);
  own << entries_at(tied.q_owners, all), entries_at(tied.v_owners, all, tied.full.nq);
  return own;
}

// G^T of the torques whose rows robot_problem() has divided by the limits of efforts, divided by those of the leaders.
template <class T>
VectorX<T> gathered(const dynamics::MimicModel<double>& tied, const VectorXd& scale, const VectorX<T>& rows) {
  VectorX<T> own = VectorX<T>::Constant(tied.nv, T(0));
  for (int k = 0; k < tied.full.nv; ++k) {
    const FollowedEntry& entry = tied.v_entries[std::size_t(k)];
    const double leader = scale[tied.v_owners[std::size_t(entry.index)]];
    own[entry.index] += rows[k] * T(entry.factor * leader / scale[k]);
  }
  return own;
}

VectorXd effort_scale(const dynamics::Model<double>& model) {
  VectorXd scale = VectorXd::Ones(model.nv);
  for (const auto& joint : model.joints)
    if (const double limit = joint.limits.effort; std::isfinite(limit) && limit > 0)
      scale[joint.idx_v] = 1 / limit;
  return scale;
}

std::vector<std::string> names_at(const std::vector<int>& where, const std::vector<std::string>& all,
                                  int first = 0) {
  std::vector<std::string> names;
  for (int k : where) names.push_back(all[std::size_t(first + k)]);
  return names;
}

// The bounds lower <= factor x + offset <= upper as bounds of x.
void narrow(double& low, double& high, const FollowedEntry& entry, double lower, double upper) {
  if (entry.is != FollowedEntry::Is::kNumber || entry.factor == 0) return;
  const double a = (lower - entry.offset) / entry.factor, b = (upper - entry.offset) / entry.factor;
  low = std::max(low, std::min(a, b));
  high = std::min(high, std::max(a, b));
}

}  // namespace

TiedJoints::TiedJoints(const RobotScene& scene, const std::vector<dynamics::MimicRule>& rules)
    : scene_(scene), tied_(scene.model, rules) {}

StageFunction TiedJoints::of_all(const StageFunction& function) const {
  return [function, tied = tied_](const auto& s) { return function(stage_of_all(tied, s)); };
}

Term TiedJoints::of_all(Term term) const {
  term.function = of_all(term.function);
  if (!term.curvature.empty()) term.curvature = of_all(term.curvature);
  return term;
}

VectorXd TiedJoints::all_q(const VectorXd& q) const { return expanded<double>(tied_.q_entries, q); }
VectorXd TiedJoints::all_v(const VectorXd& v) const { return expanded<double>(tied_.v_entries, v); }
VectorXd TiedJoints::own_q(const VectorXd& all) const { return entries_at(tied_.q_owners, all); }
VectorXd TiedJoints::own_x(const VectorXd& all) const { return own_state(tied_, all); }

Problem TiedJoints::shortened(const Problem& all) const {
  const auto own_rows = [this](const StageFunction& f) -> StageFunction {
    return [f, tied = tied_](const auto& s) { return own_state(tied, f(stage_of_all(tied, s))); };
  };
  std::vector<std::string> states = names_at(tied_.q_owners, all.states);
  for (const std::string& name : names_at(tied_.v_owners, all.states, tied_.full.nq)) states.push_back(name);
  Problem own(all.name, states, all.controls, all.duration, own_rows(all.rate));
  if (!all.residual.empty()) {
    const VectorXd scale = effort_scale(tied_.full);
    const auto residual = [f = all.residual, scale, tied = tied_](const auto& s) {
      return gathered(tied, scale, f(stage_of_all(tied, s)));
    };
    own.use_accelerations(names_at(tied_.v_owners, all.accelerations), residual, own_rows(all.ode));
  }
  own.positions = tied_.nq;
  own.u = all.u;
  if (all.typical.size() > 0) own.typical = own_x(all.typical);
  if (all.most_typical.size() > 0) own.most_typical = own_x(all.most_typical);
  if (all.difference) {
    own.difference = [f = all.difference, *this](const VectorXd& from, const VectorXd& x) {
      const auto whole = [this](const VectorXd& of) {
        return stage_of_all<double>(tied_, {0, of, {}, {}, {}}).x;
      };
      return own_x(f(whole(from), whole(x)));
    };
  }
  return own;
}

Problem TiedJoints::of_all_joints() const {
  const int n = tied_.full.nq + tied_.full.nv;
  return Problem("", std::vector<std::string>(std::size_t(n)), {}, 1, [](const auto& s) { return s.x; });
}

void TiedJoints::set_ends(Problem& problem, const std::function<void(Problem&)>& set) const {
  Problem all = of_all_joints();
  all.start.setConstant(Problem::kFree), all.goal.setConstant(Problem::kFree);
  set(all);
  if (!all.start.array().isNaN().all()) problem.start = own_x(all.start);
  if (!all.goal.array().isNaN().all()) problem.goal = own_x(all.goal);
  for (const Term& term : all.terms) {
    const auto is_of = [&](const auto& rule) { return term.name == "goal of " + rule.joint; };
    if (std::none_of(tied_.rules.begin(), tied_.rules.end(), is_of)) problem.add(of_all(term));
  }
}

void TiedJoints::set_bounds(Problem& problem, const std::function<void(Problem&)>& set) const {
  Problem all = of_all_joints();
  set(all);
  const auto take = [&](const std::vector<FollowedEntry>& entries, int first, int own) {
    for (std::size_t k = 0; k < entries.size(); ++k) {
      const Eigen::Index from = first + Eigen::Index(k), to = own + entries[k].index;
      narrow(problem.x.lower[to], problem.x.upper[to], entries[k], all.x.lower[from], all.x.upper[from]);
    }
  };
  take(tied_.q_entries, 0, 0);
  take(tied_.v_entries, tied_.full.nq, tied_.nq);
}

std::vector<std::string> TiedJoints::leaders() const {
  std::vector<std::string> names;
  for (const auto& joint : tied_.full.joints) {
    const auto is_of = [&](const auto& rule) { return rule.joint == joint.name; };
    const bool follows = std::any_of(tied_.rules.begin(), tied_.rules.end(), is_of);
    if (dynamics::is_single(joint.type) && !follows) names.push_back(joint.name);
  }
  return names;
}

void TiedJoints::check_driven(const std::vector<std::string>& driven) const {
  for (const auto& rule : tied_.rules) {
    if (std::find(driven.begin(), driven.end(), rule.joint) == driven.end()) continue;
    throw ArgumentError("problem: driven: joint \"" + rule.joint + "\" follows \"" + rule.leader +
                        "\", whose motor moves it; expected \"" + rule.leader + "\"");
  }
}

}  // namespace dyntape::python
