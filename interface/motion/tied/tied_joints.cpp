// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/motion/tied/tied_joints.h>

#include <algorithm>
#include <cmath>

namespace dyntape {
namespace {

using dynamics::FollowedEntry;
using dynamics::VectorX;
using Eigen::VectorXd;

// The stage of all joints.
template <class T>
Stage<T> stage_of_all(const Ties& ties, const Stage<T>& s) {
  const auto nq = Eigen::Index(ties.q_owners.size()), nv = Eigen::Index(ties.v_owners.size());
  const VectorX<T> q = s.x.head(nq), v = s.x.segment(nq, nv);
  Stage<T> all{s.t, VectorX<T>(Eigen::Index(ties.q.size() + ties.v.size())), s.a, s.u, s.p};
  all.x << ties.all_q(q), ties.all_v(v);
  if (s.a.size() > 0) all.a = ties.all_v(s.a);
  return all;
}

template <class T>
VectorX<T> own_state(const Ties& ties, const VectorX<T>& all) {
  const VectorX<T> q = all.head(Eigen::Index(ties.q.size())), v = all.tail(Eigen::Index(ties.v.size()));
  VectorX<T> own(Eigen::Index(ties.q_owners.size() + ties.v_owners.size()));
  own << ties.own_q(q), ties.own_v(v);
  return own;
}

std::vector<std::string> names_at(const std::vector<int>& where, const std::vector<std::string>& all,
                                  int first = 0) {
  std::vector<std::string> names;
  for (int k : where) names.push_back(all[std::size_t(first + k)]);
  return names;
}

}  // namespace

TiedJoints::TiedJoints(const RobotScene& scene) : scene_(scene), ties_(ties_of(scene)) {}

StageFunction TiedJoints::of_all(const StageFunction& function) const {
  if (ties_.empty()) return function;
  return [function, ties = ties_](const auto& s) { return function(stage_of_all(ties, s)); };
}

Term TiedJoints::of_all(Term term) const {
  term.function = of_all(term.function);
  if (!term.curvature.empty()) term.curvature = of_all(term.curvature);
  return term;
}

VectorXd TiedJoints::all_q(const VectorXd& q) const { return ties_.all_q(q); }
VectorXd TiedJoints::all_v(const VectorXd& v) const { return ties_.all_v(v); }
VectorXd TiedJoints::own_q(const VectorXd& all) const { return ties_.own_q(all); }
VectorXd TiedJoints::own_x(const VectorXd& all) const { return ties_.empty() ? all : own_state(ties_, all); }
VectorXd TiedJoints::all_x(const VectorXd& x) const {
  return ties_.empty() ? x : stage_of_all<double>(ties_, {0, x, {}, {}, {}}).x;
}

StageFunction TiedJoints::own_rows(const StageFunction& function) const {
  if (ties_.empty()) return function;
  return [function, ties = ties_](const auto& s) { return own_state(ties, function(stage_of_all(ties, s))); };
}

Trajectory TiedJoints::of_all(Trajectory motion) const {
  if (ties_.empty()) return motion;
  Eigen::MatrixXd x(scene_.model.nq + scene_.model.nv, motion.points());
  Eigen::MatrixXd a(motion.a.rows() > 0 ? scene_.model.nv : 0, motion.points());
  for (Eigen::Index p = 0; p < motion.points(); ++p) {
    x.col(p) = all_x(motion.x.col(p));
    if (a.rows() > 0) a.col(p) = all_v(motion.a.col(p));
  }
  motion.x = std::move(x), motion.a = std::move(a);
  return motion;
}

int TiedJoints::index_in_all(int own) const {
  if (ties_.empty() || own < 0) return own;
  return own < nq() ? ties_.q_owners[std::size_t(own)]
                    : scene_.model.nq + ties_.v_owners[std::size_t(own - nq())];
}

Bounds TiedJoints::own_bounds(Bounds all) const {
  const int nq = scene_.model.nq, nv = scene_.model.nv;
  ties_.narrow_q(all.lower.head(nq), all.upper.head(nq));
  ties_.narrow_v(all.lower.segment(nq, nv), all.upper.segment(nq, nv));
  return {own_x(all.lower), own_x(all.upper)};
}

Problem TiedJoints::shortened(const Problem& all) const {
  if (ties_.empty()) return all;
  std::vector<std::string> states = names_at(ties_.q_owners, all.states);
  for (const std::string& name : names_at(ties_.v_owners, all.states, scene_.model.nq))
    states.push_back(name);
  Problem own(all.name, states, all.controls, all.duration, own_rows(all.rate));
  if (!all.residual.empty()) {
    const auto residual = [f = all.residual, ties = ties_](const auto& s) {
      return ties.own_v(f(stage_of_all(ties, s)));
    };
    own.use_accelerations(names_at(ties_.v_owners, all.accelerations), residual, own_rows(all.ode));
  }
  own.positions = nq();
  own.free_time = all.free_time;
  own.parameters = all.parameters;
  own.u = all.u;
  if (all.a.lower.size() > 0) own.a = {ties_.own_v(all.a.lower), ties_.own_v(all.a.upper)};
  own.x = own_bounds(all.x);
  take_ends(own, all);
  if (all.guess)
    own.guess = [guess = all.guess, ties = ties_](double t) {
      Stage<double> s = guess(t);
      s.x = own_state(ties, s.x);
      if (s.a.size() > 0) s.a = ties.own_v(s.a);
      return s;
    };
  if (all.typical.size() > 0) own.typical = own_x(all.typical);
  if (all.most_typical.size() > 0) own.most_typical = own_x(all.most_typical);
  if (all.difference) {
    own.difference = [f = all.difference, *this](const VectorXd& from, const VectorXd& x) {
      return own_x(f(all_x(from), all_x(x)));
    };
  }
  return own;
}

Problem TiedJoints::of_all_joints() const {
  const int n = scene_.model.nq + scene_.model.nv;
  return Problem("", std::vector<std::string>(std::size_t(n)), {}, 1, [](const auto& s) { return s.x; });
}

void TiedJoints::take_ends(Problem& own, const Problem& all) const {
  if (!all.start.array().isNaN().all()) own.start = own_x(all.start);
  if (!all.goal.array().isNaN().all()) own.goal = own_x(all.goal);
  for (const Term& term : all.terms) {
    const auto is_of = [&](const auto& rule) { return term.name == "goal of " + rule.joint; };
    if (std::none_of(scene_.mimics.begin(), scene_.mimics.end(), is_of)) own.add(of_all(term));
  }
}

void TiedJoints::set_ends(Problem& problem, const std::function<void(Problem&)>& set) const {
  Problem all = of_all_joints();
  all.start.setConstant(Problem::kFree), all.goal.setConstant(Problem::kFree);
  set(all);
  take_ends(problem, all);
}

void TiedJoints::set_bounds(Problem& problem, const std::function<void(Problem&)>& set) const {
  Problem all = of_all_joints();
  set(all);
  const Bounds own = own_bounds(all.x);
  problem.x.lower = problem.x.lower.cwiseMax(own.lower);
  problem.x.upper = problem.x.upper.cwiseMin(own.upper);
}

}  // namespace dyntape
