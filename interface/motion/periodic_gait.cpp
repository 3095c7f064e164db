// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/motion/periodic_gait.h>

#include <algorithm>
#include <numeric>

#include <dyntape/autodiff/error.h>

namespace dyntape {

namespace {

using RobotModel = dynamics::Model<double>;

// Where each entry of (q, v) comes from.
std::vector<int> sources(const RobotModel& model, const PeriodicGait& step) {
  std::vector<int> from(std::size_t(model.nq + model.nv));
  std::iota(from.begin(), from.end(), 0);
  for (const auto& [one, other] : step.swapped) {
    const auto &a = model.joints[std::size_t(model.joint_index(one))],
               &b = model.joints[std::size_t(model.joint_index(other))];
    for (int i = 0; i < dynamics::nq(a.type); ++i)
      std::swap(from[std::size_t(a.idx_q + i)], from[std::size_t(b.idx_q + i)]);
    for (int i = 0; i < dynamics::nv(a.type); ++i)
      std::swap(from[std::size_t(model.nq + a.idx_v + i)], from[std::size_t(model.nq + b.idx_v + i)]);
  }
  return from;
}

Eigen::VectorXd advance_of(const RobotModel& model, const PeriodicGait& step) {
  return step.advance.size() > 0 ? step.advance : Eigen::VectorXd::Zero(model.nq);
}

}  // namespace

void check(const RobotModel& model, const PeriodicGait& step) {
  const std::string where = "the next step of robot \"" + model.name + "\": ";
  std::vector<int> seen;
  for (const auto& [one, other] : step.swapped) {
    for (const std::string& name : {one, other}) {
      const int joint = model.joint_index(name);
      if (std::find(seen.begin(), seen.end(), joint) != seen.end())
        throw ArgumentError(where + "joint \"" + name + "\" is swapped twice, expected once, with another");
      seen.push_back(joint);
    }
    const auto a = model.joints[std::size_t(model.joint_index(one))].type,
               b = model.joints[std::size_t(model.joint_index(other))].type;
    if (a == b) continue;
    throw ArgumentError(where + "\"" + one + "\" is a " + dynamics::traits(a).name + " joint, \"" + other +
                        "\" a " + dynamics::traits(b).name + " one; expected two of one type to be swapped");
  }
  if (step.advance.size() == 0) return;
  if (step.advance.size() != model.nq || !step.advance.allFinite())
    throw ArgumentError(where + "the advance has " + std::to_string(step.advance.size()) +
                        " entries, expected " + std::to_string(model.nq) + " finite numbers");
  for (const auto& joint : model.joints) {
    const bool is_base = joint.type == dynamics::JointType::kFreeFlyer;
    const int first = joint.idx_q + (is_base ? 3 : 0), count = dynamics::nq(joint.type) - (is_base ? 3 : 0);
    if (dynamics::traits(joint.type).on_a_line || step.advance.segment(first, count).isZero(0)) continue;
    throw ArgumentError(where + "joint \"" + joint.name + "\", a " + dynamics::traits(joint.type).name +
                        " one, has no position on a line that could advance");
  }
}

StageFunction periodic_gait(const RobotScene& scene, const PeriodicGait& step, const StageFunction& impact) {
  check(scene.model, step);
  return [impact, from = sources(scene.model, step), by = advance_of(scene.model, step)](const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    const Eigen::Matrix<T, Eigen::Dynamic, 1> x = impact.empty() ? s.x : impact(s);
    Eigen::Matrix<T, Eigen::Dynamic, 1> next(x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) next[i] = x[from[std::size_t(i)]];
    next.head(by.size()) -= by.template cast<T>();
    return next;
  };
}

Eigen::VectorXd end_of_step(const RobotModel& model, const PeriodicGait& step, const Eigen::VectorXd& q) {
  check(model, step);
  const std::vector<int> from = sources(model, step);
  const Eigen::VectorXd moved = q + advance_of(model, step);
  Eigen::VectorXd end(q.size());
  for (Eigen::Index i = 0; i < q.size(); ++i) end[from[std::size_t(i)]] = moved[i];
  return end;
}

}  // namespace dyntape
