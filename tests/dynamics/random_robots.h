// SPDX-License-Identifier: BSD-3-Clause
//
// Random robots and states, the same from one seed on every machine.
//
//   Random random(seed);
//   Model<double> robot = random_tree(random, {.joints = 12, .base = Base::kFloating});
//   State s = random_state(robot, random);
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/model/mimic_rules.h>

#include <Eigen/Dense>
#include <random>
#include <string>

namespace dyntape::dynamics {

struct Random {
  explicit Random(unsigned long seed) : engine(seed) {}

  double uniform(double lower = -1, double upper = 1) {
    return lower + (upper - lower) * static_cast<double>(engine() >> 11) * 0x1p-53;
  }
  int below(int n) { return static_cast<int>(engine() % static_cast<unsigned long>(n)); }
  Eigen::VectorXd vector(long n, double size = 1) {
    Eigen::VectorXd x(n);
    for (double& value : x) value = uniform(-size, size);
    return x;
  }
  Vector3<double> vector3(double size = 1) { return vector(3, size); }
  Motion<double> motion(double size = 1) { return {vector3(size), vector3(size)}; }

  std::mt19937_64 engine;
};

struct RandomTreeShape {
  int joints = 10;
  Base base = Base::kFixed;
  bool chain = false;              // each joint on the one before
  bool inner_free_flyers = false;  // a free-flyer may also hang on a body
};

// A body of positive mass with a possible rotational inertia: that of some point masses.
inline Inertia<double> random_inertia(Random& random) {
  Inertia<double> sum;
  for (int k = 0; k < 5; ++k) {
    sum = sum + Inertia<double>{random.uniform(0.1, 1), random.vector3(0.3), Matrix3<double>::Zero()};
  }
  return sum;
}

inline Placement<double> random_placement(Random& random, double size = 0.5) {
  return {exp(random.vector3(3)), random.vector3(size)};
}

inline Joint<double> random_joint(Random& random, const std::string& name, JointType type) {
  Joint<double> joint;
  joint.name = name;
  joint.type = type;
  const int k = random.below(7);
  joint.axis = k < 6 ? Vector3<double>((k < 3 ? 1 : -1) * Vector3<double>::Unit(k % 3))
                     : random.vector3().normalized();
  joint.pitch = random.uniform(-0.3, 0.3);
  joint.armature = random.uniform(0, 0.3);
  joint.damping = random.uniform(0, 2);
  joint.friction = random.uniform(0, 2);
  return joint;
}

inline Model<double> random_tree(Random& random, const RandomTreeShape& shape = {}) {
  Model<double> model;
  model.name = "random tree";
  model.gravity = random.vector3(10);
  for (int i = 0; i < shape.joints; ++i) {
    const int parent = i == 0 ? -1 : shape.chain ? i - 1 : random.below(i);
    const int types = static_cast<int>(JointType::kFreeFlyer) + (shape.inner_free_flyers ? 1 : 0);
    JointType type = static_cast<JointType>(random.below(types));
    if (i == 0 && shape.base == Base::kFloating) type = JointType::kFreeFlyer;
    model.add_joint(parent, random_joint(random, "joint " + std::to_string(i), type),
                    random_placement(random), random_inertia(random));
    model.frames.push_back({"frame " + std::to_string(i), i, random_placement(random)});
  }
  return model;
}

// Every second joint on a line follows one before it, some of which follow others.
inline std::vector<MimicRule> random_rules(const Model<double>& model, Random& random) {
  std::vector<MimicRule> rules;
  std::vector<std::string> on_lines, turning;
  const auto one_of = [&](const std::vector<std::string>& names) {
    return names[random.below(static_cast<int>(names.size()))];
  };
  for (const Joint<double>& joint : model.joints) {
    if (nv(joint.type) != 1) continue;
    const bool turns = joint.type == JointType::kContinuous;
    const bool of_turning = turns && !turning.empty() && (on_lines.empty() || random.below(2) == 0);
    const auto& leaders = of_turning ? turning : on_lines;
    if (!leaders.empty() && random.below(2) == 0) {
      const double whole = random.below(2) == 0 ? -1 - random.below(2) : 1 + random.below(3);
      rules.push_back({joint.name, one_of(leaders),
                       of_turning || random.below(3) == 0 ? whole : random.uniform(-2, 2),
                       random.below(3) == 0 ? 0 : random.uniform()});
    }
    (turns ? turning : on_lines).push_back(joint.name);
  }
  return rules;
}

// The entries of q that a joint reads by their direction: (cos, sin) or a quaternion; none for most.
inline auto unit_part(const Joint<double>& joint, Eigen::VectorXd& q) {
  const JointType type = joint.type;
  const int pair = type == JointType::kContinuous || type == JointType::kPlanar ? 2 : 0;
  const int size = type == JointType::kSpherical || type == JointType::kFreeFlyer ? 4 : pair;
  return q.segment(joint.idx_q + nq(type) - size, size);
}

struct State {
  Eigen::VectorXd q, v, a, tau;
};

inline State random_state(const Model<double>& model, Random& random) {
  return {random_configuration(model, random.engine), random.vector(model.nv), random.vector(model.nv, 3),
          random.vector(model.nv, 3)};
}

// max |a - b| / max |b|.
template <class A, class B>
double relative_error(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  const auto size = b.cwiseAbs().maxCoeff();
  if (size == 0) return static_cast<double>(a.cwiseAbs().maxCoeff());
  return static_cast<double>((a - b).cwiseAbs().maxCoeff() / size);
}

}  // namespace dyntape::dynamics
