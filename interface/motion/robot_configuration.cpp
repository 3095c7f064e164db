// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/motion/robot_configuration.h>

#include <cmath>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algebra/lie.h>
#include <dyntape/dynamics/model/configuration.h>

namespace dyntape {

namespace {

using dynamics::Joint;
using dynamics::JointType;
using dynamics::Model;
using dynamics::Vector3;
using dynamics::Vector4;
using dynamics::VectorX;

// Where a joint's entries are, by kind: numbers, then a direction, which is a pair, a quaternion or nothing.
struct JointParts {
  int q, v, numbers;     // first entries; how many are plain
  int direction, turns;  // entries of the direction (0, 2, 4), of its velocity (0, 1, 3)
};

JointParts parts_of(const Joint<double>& joint) {
  switch (joint.type) {
    case JointType::kContinuous:
      return {joint.idx_q, joint.idx_v, 0, 2, 1};
    case JointType::kPlanar:
      return {joint.idx_q, joint.idx_v, 2, 2, 1};
    case JointType::kSpherical:
      return {joint.idx_q, joint.idx_v, 0, 4, 3};
    case JointType::kFreeFlyer:
      return {joint.idx_q, joint.idx_v, 3, 4, 3};
    default:
      return {joint.idx_q, joint.idx_v, 1, 0, 0};
  }
}

// The rate of the numbers: of positions, which move in the joint's own axes, in those of its base.
template <class T>
void add_rate_of_numbers(const JointParts& at, const VectorX<T>& q, const VectorX<T>& v, VectorX<T>& rate) {
  if (at.direction == 0) {
    rate[at.q] = v[at.v];
  } else if (at.numbers == 3) {
    const Vector4<T> u = q.template segment<4>(at.q + 3);
    rate.template segment<3>(at.q) = dynamics::rotation(u) * Vector3<T>(v.template segment<3>(at.v));
  } else if (at.numbers == 2) {
    using std::sqrt;
    const T c = q[at.q + 2], s = q[at.q + 3], scale = T(1) / sqrt(c * c + s * s);
    rate[at.q] = (c * v[at.v] - s * v[at.v + 1]) * scale;
    rate[at.q + 1] = (s * v[at.v] + c * v[at.v + 1]) * scale;
  }
}

template <class T>
void add_rate_of_direction(const JointParts& at, const VectorX<T>& q, const VectorX<T>& v, VectorX<T>& rate) {
  const int i = at.q + at.numbers, k = at.v + at.numbers;
  if (at.direction == 2) {
    const T c = q[i], s = q[i + 1], home = (T(1) - (c * c + s * s)) * T(kNormReturn);
    rate[i] = home * c - s * v[k];
    rate[i + 1] = home * s + c * v[k];
  } else if (at.direction == 4) {
    const Vector4<T> u = q.template segment<4>(i);
    const Vector4<T> w(v[k] * T(0.5), v[k + 1] * T(0.5), v[k + 2] * T(0.5), T(0));
    const T home = (T(1) - dynamics::squared_length(u)) * T(kNormReturn);
    rate.template segment<4>(i) = dynamics::quaternion_product(u, w) + u * home;
  }
}

// The turn from `from` to the direction at q[i], in its own axes.
template <class T>
void put_turn(int entries, const Eigen::VectorXd& from, const VectorX<T>& to, int i, VectorX<T>& e, int k) {
  if (entries == 2) {
    const T c0(from[i]), s0(from[i + 1]);
    using std::atan2;
    e[k] = atan2(T(c0 * to[i + 1] - s0 * to[i]), T(c0 * to[i] + s0 * to[i + 1]));
  } else if (entries == 4) {
    const Vector4<T> back = dynamics::conjugate(Vector4<T>(from.template segment<4>(i).cast<T>()));
    e.template segment<3>(k) =
        dynamics::log(dynamics::quaternion_product(back, Vector4<T>(to.template segment<4>(i))));
  }
}

void check_configuration(const Model<double>& model, const std::string& what, Eigen::Index size,
                         Eigen::Index expected) {
  if (size == expected) return;
  refuse(model, what + " has " + std::to_string(size) + " entries, expected " + std::to_string(expected));
}

// Of length one; all of it free, or nothing.
enum class MayBeOpen { kNo, kYes };
Eigen::VectorXd with_unit_directions(const Model<double>& model, const std::string& what, Eigen::VectorXd q,
                                     MayBeOpen may_be_open) {
  for (const auto& joint : model.joints) {
    const JointParts at = parts_of(joint);
    auto u = q.segment(at.q + at.numbers, at.direction);
    if (at.direction == 0) continue;
    if (u.array().isNaN().all() && may_be_open == MayBeOpen::kYes) continue;
    const double length = u.stableNorm();
    if (length > 0 && std::isfinite(length)) {
      u /= length;
      continue;
    }
    refuse(model, what + " of joint \"" + joint.name + "\" is " +
                      (length == 0 ? "of length zero" : "not given in all its entries") + ", expected " +
                      (at.direction == 4 ? "a quaternion (x y z w)" : "(cos, sin)") +
                      (may_be_open == MayBeOpen::kYes ? ", or all of it free" : ""));
  }
  return q;
}

void check_state(const Problem& problem, const Model<double>& model, const std::string& end,
                 const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  check_configuration(model, "the configuration at the " + end, q.size(), model.nq);
  check_configuration(model, "the velocity at the " + end, v.size(), model.nv);
  check_configuration(model, "the state of problem \"" + problem.name + "\"", problem.n_x(),
                      model.nq + model.nv);
}

}  // namespace

bool is_on_lines(const Model<double>& model) {
  for (const auto& joint : model.joints) {
    if (!dynamics::traits(joint.type).on_a_line) return false;
  }
  return true;
}

DirectionEntries direction_entries(const Joint<double>& joint) {
  const JointParts at = parts_of(joint);
  return {at.q + at.numbers, at.direction};
}

std::vector<std::string> entry_names_of(const Model<double>& model, const std::string& prefix, bool of_q) {
  std::vector<std::string> names;
  for (const auto& joint : model.joints) {
    const int count = of_q ? dynamics::nq(joint.type) : dynamics::nv(joint.type);
    for (int k = 0; k < count; ++k)
      names.push_back(prefix + joint.name + (count > 1 ? "[" + std::to_string(k) + "]" : ""));
  }
  return names;
}

template <class T>
VectorX<T> configuration_rate(const Model<double>& model, const VectorX<T>& q, const VectorX<T>& v) {
  VectorX<T> rate(model.nq);
  for (const auto& joint : model.joints) {
    const JointParts at = parts_of(joint);
    add_rate_of_numbers(at, q, v, rate);
    add_rate_of_direction(at, q, v, rate);
  }
  return rate;
}
template VectorX<AD> configuration_rate(const Model<double>&, const VectorX<AD>&, const VectorX<AD>&);
template VectorX<double> configuration_rate(const Model<double>&, const VectorX<double>&,
                                            const VectorX<double>&);

template <class T>
VectorX<T> configuration_error(const Model<double>& model, const Eigen::VectorXd& q_ref,
                               const VectorX<T>& q) {
  check_configuration(model, "the reference of a configuration", q_ref.size(), model.nq);
  VectorX<T> e(model.nv);
  for (const auto& joint : model.joints) {
    const JointParts at = parts_of(joint);
    for (int k = 0; k < at.numbers; ++k) e[at.v + k] = q[at.q + k] - T(q_ref[at.q + k]);
    put_turn(at.direction, q_ref, q, at.q + at.numbers, e, at.v + at.numbers);
  }
  return e;
}
template VectorX<AD> configuration_error(const Model<double>&, const Eigen::VectorXd&, const VectorX<AD>&);
template VectorX<double> configuration_error(const Model<double>&, const Eigen::VectorXd&,
                                             const VectorX<double>&);

StageFunction configuration_error(const RobotScene& scene, const Eigen::VectorXd& q_ref) {
  check_configuration(scene.model, "the reference of a configuration", q_ref.size(), scene.model.nq);
  const Eigen::VectorXd unit = with_unit_directions(scene.model, "the reference", q_ref, MayBeOpen::kNo);
  return [model = scene.model, unit](const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    return configuration_error<T>(model, unit, s.x.head(model.nq));
  };
}

Eigen::VectorXd state_difference(const Model<double>& model, const Eigen::VectorXd& from,
                                 const Eigen::VectorXd& x) {
  Eigen::VectorXd change = x - from;
  const Eigen::VectorXd q = from.head(model.nq);
  const Eigen::VectorXd turned = configuration_error<double>(
      model, with_unit_directions(model, "the state", q, MayBeOpen::kNo), x.head(model.nq));
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(model.nv);
  const Eigen::VectorXd by_turning =
      configuration_rate<double>(model, q, turned) - configuration_rate<double>(model, q, none);
  for (const auto& joint : model.joints) {
    const DirectionEntries at = direction_entries(joint);
    change.segment(at.first, at.count) = by_turning.segment(at.first, at.count);
  }
  return change;
}

void start_at(Problem& problem, const RobotScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  check_state(problem, scene.model, "start", q, v);
  problem.start << with_unit_directions(scene.model, "the start", q, MayBeOpen::kNo), v;
}

void end_at(Problem& problem, const RobotScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  const Model<double>& model = scene.model;
  check_state(problem, model, "goal", q, v);
  Eigen::VectorXd numbers = with_unit_directions(model, "the goal", q, MayBeOpen::kYes);
  const Eigen::VectorXd unit = numbers;
  for (const auto& joint : model.joints) {
    const JointParts at = parts_of(joint);
    const int i = at.q + at.numbers;
    if (at.direction == 0) continue;
    numbers.segment(i, at.direction).setConstant(Problem::kFree);
    if (std::isnan(unit[i])) continue;
    problem.add(terminal_equality("goal of " + joint.name, [at, unit, i](const auto& s) {
      using T = typename std::decay_t<decltype(s.x)>::Scalar;
      VectorX<T> left(at.turns);
      put_turn<T>(at.direction, unit, s.x, i, left, 0);
      return left;
    }));
  }
  problem.goal << numbers, v;
}

Eigen::VectorXd between(const Model<double>& model, const Eigen::VectorXd& q0, const Eigen::VectorXd& q1,
                        double s) {
  const Eigen::VectorXd d = configuration_error<double>(model, q0, q1);
  Eigen::VectorXd q = q0;
  for (const auto& joint : model.joints) {
    const JointParts at = parts_of(joint);
    const int i = at.q + at.numbers, k = at.v + at.numbers;
    q.segment(at.q, at.numbers) += d.segment(at.v, at.numbers) * s;
    if (at.direction == 2) {
      const double c = std::cos(d[k] * s), sine = std::sin(d[k] * s);
      q.segment<2>(i) << c * q0[i] - sine * q0[i + 1], sine * q0[i] + c * q0[i + 1];
    } else if (at.direction == 4) {
      const Vector3<double> turn = d.segment<3>(k) * s;
      q.segment<4>(i) =
          dynamics::quaternion_product(Vector4<double>(q0.segment<4>(i)), dynamics::exp_quaternion(turn));
    }
  }
  return q;
}

Eigen::VectorXd velocity_between(const Model<double>& model, const Eigen::VectorXd& q0,
                                 const Eigen::VectorXd& q1, double s) {
  Eigen::VectorXd v = configuration_error<double>(model, q0, q1);
  const Eigen::VectorXd q = between(model, q0, q1, s);
  for (const auto& joint : model.joints) {
    const JointParts at = parts_of(joint);
    if (at.direction == 0 || at.numbers == 0) continue;
    if (at.numbers == 3) {
      const Vector4<double> u = q.segment<4>(at.q + 3);
      v.segment<3>(at.v) = (dynamics::rotation(u).transpose() * Vector3<double>(v.segment<3>(at.v))).eval();
    } else {
      const double c = q[at.q + 2], sine = q[at.q + 3], x = v[at.v], y = v[at.v + 1];
      v.segment<2>(at.v) << c * x + sine * y, c * y - sine * x;
    }
  }
  return v;
}

void fill_free(const Model<double>& model, Eigen::VectorXd& q0, Eigen::VectorXd& q1) {
  const Eigen::VectorXd neutral = dynamics::neutral(model);
  for (int i = 0; i < model.nq; ++i) {
    if (std::isnan(q0[i])) q0[i] = std::isnan(q1[i]) ? neutral[i] : q1[i];
    if (std::isnan(q1[i])) q1[i] = q0[i];
  }
}

}  // namespace dyntape
