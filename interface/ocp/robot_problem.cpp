// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/ocp/robot_problem.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/effects/check.h>
#include <dyntape/interface/robot/robot_callee.h>
#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape {

namespace {

using dynamics::Data;
using dynamics::Effects;
using dynamics::Model;

template <class T>
using Vector = Eigen::Matrix<T, Eigen::Dynamic, 1>;

// The robot in one scalar, with its working memory; one thread at a time.
template <class T>
struct Plant {
  Plant(Model<T> m, Effects<T> e, std::vector<int> driven, Eigen::VectorXd gains)
      : model(std::move(m)),
        effects(std::move(e)),
        data(model),
        torques(model),
        dofs(std::move(driven)),
        gain(std::move(gains)) {}

  Model<T> model;
  Effects<T> effects;
  Data<T> data;
  dynamics::EffectTorques<T> torques;
  std::vector<int> dofs;
  Eigen::VectorXd gain;  // of each control: torque = gain u

  Vector<T> command(const Stage<T>& s) const {
    return torques_at(dofs, Vector<T>(gain.template cast<T>().cwiseProduct(s.u)), model.nv);
  }
  // What arrives of it at the joints.
  Vector<T> torque(const Stage<T>& s) {
    return dynamics::driving_torques<T>(model, torques, effects, command(s));
  }
  // What callees are given, which know no other than the robot that moves with v.
  Vector<T> seen_v(const Stage<T>& s) const {
    return effects.acting().coriolis ? v(s) : Vector<T>::Constant(model.nv, T(0));
  }
  Vector<T> q(const Stage<T>& s) const { return s.x.head(model.nv); }
  Vector<T> v(const Stage<T>& s) const { return s.x.tail(model.nv); }

  // What effects add that are not the callees' own.
  Vector<T> passive(const Stage<T>& s) {
    return dynamics::effect_torques<T>(model, data, torques, effects, q(s), v(s));
  }
  Vector<T> forward(const Stage<T>& s) {
    return dynamics::forward_dynamics(model, data, torques, effects, q(s), v(s), command(s));
  }
  Vector<T> inverse(const Stage<T>& s) {
    return dynamics::inverse_dynamics(model, data, torques, effects, q(s), v(s), Vector<T>(s.a));
  }
};

template <class T>
Vector<T> joined(const Vector<T>& a, const Vector<T>& b) {
  Vector<T> c(a.size() + b.size());
  c << a, b;
  return c;
}

// Both scalars of the plant.  The taped one is made within the recording that asks for it: an AD belongs to
// one recording.  Its dynamics are callees, whose derivatives are the analytic ones, where that pays.
struct Plants {
  RobotScene scene;
  std::vector<int> dofs;
  Eigen::VectorXd gain;
  std::shared_ptr<Plant<double>> plain;
  std::shared_ptr<const Callee> forward_callee, inverse_callee;  // null: recorded as they are

  Plants(const RobotScene& s, Eigen::VectorXd gains)
      : scene(s),
        dofs(actuated_dofs(s)),
        gain(std::move(gains)),
        plain(std::make_shared<Plant<double>>(s.model, s.effects, dofs, gain)) {
    dynamics::check(s.model, s.effects);
    const bool adds_inertia = s.effects.acting().added.count > 0;  // which callees do not know
    if (adds_inertia || !is_worth_callees(s.model)) return;
    const Model<double> acting = dynamics::acting_model(s.model, s.effects);
    forward_callee = forward_dynamics_callee(acting);
    inverse_callee = inverse_dynamics_callee(acting);
  }

  VectorXad forward(const Stage<AD>& s) const {
    Plant<AD> plant = recorded();
    if (!forward_callee) return plant.forward(s);
    const VectorXad tau = plant.torque(s) + plant.passive(s);
    return call(forward_callee, joined<AD>(joined<AD>(plant.q(s), plant.seen_v(s)), tau));
  }
  // The torques that the motion needs, less the controls'.
  VectorXad missing(const Stage<AD>& s) const {
    Plant<AD> plant = recorded();
    if (!inverse_callee) return plant.inverse(s) - plant.torque(s);
    const VectorXad tau = call(inverse_callee, joined<AD>(joined<AD>(plant.q(s), plant.seen_v(s)), s.a));
    return tau - plant.passive(s) - plant.torque(s);
  }

  Plant<AD> recorded() const { return {scene.model.cast<AD>(), scene.effects.cast<AD>(), dofs, gain}; }
};

StageFunction forward_rate(const std::shared_ptr<const Plants>& plants) {
  return {[plants](const Stage<AD>& s) {
            return joined<AD>(s.x.tail(plants->scene.model.nv), plants->forward(s));
          },
          [plants](const Stage<double>& s) {
            return joined<double>(plants->plain->v(s), plants->plain->forward(s));
          }};
}

StageFunction scaled_residual(const std::shared_ptr<const Plants>& plants, const Eigen::VectorXd& scale) {
  return {
      [=](const Stage<AD>& s) { return VectorXad(plants->missing(s).cwiseProduct(scale.cast<AD>())); },
      [=](const Stage<double>& s) {
        return Eigen::VectorXd((plants->plain->inverse(s) - plants->plain->torque(s)).cwiseProduct(scale));
      }};
}

std::vector<std::string> prefixed(const std::string& prefix, const Model<double>& model) {
  std::vector<std::string> names;
  for (const auto& joint : model.joints) names.push_back(prefix + joint.name);
  return names;
}

void check_joints(const Model<double>& model) {
  for (const auto& joint : model.joints) {
    if (dynamics::traits(joint.type).on_a_line) continue;
    const bool continuous = joint.type == dynamics::JointType::kContinuous;
    throw ArgumentError(
        "robot \"" + model.name + "\": joint \"" + joint.name + "\" is " + dynamics::to_string(joint.type) +
        (continuous ? " and written as (cos, sin); read the robot with continuous joints as angles"
                    : "; collocation takes robots with a fixed base and joints of one degree of freedom"));
  }
}

double effort_limit(const RobotScene& scene, int dof, bool required) {
  const auto& joint = scene.model.joints[std::size_t(dof)];
  const double limit = joint.limits.effort;
  if (required && !(std::isfinite(limit) && limit > 0)) {
    throw ArgumentError("robot \"" + scene.model.name + "\": joint \"" + joint.name +
                        "\" has no effort limit above zero of which a control could be a fraction");
  }
  return limit;
}

Eigen::VectorXd gains(const RobotScene& scene, ControlUnit unit) {
  const std::vector<int> dofs = actuated_dofs(scene);
  Eigen::VectorXd gain = Eigen::VectorXd::Ones(Eigen::Index(dofs.size()));
  if (unit == ControlUnit::kPhysical) return gain;
  for (std::size_t k = 0; k < dofs.size(); ++k) gain[long(k)] = effort_limit(scene, dofs[k], true);
  return gain;
}

}  // namespace

Problem robot_problem(const RobotScene& scene, const RobotProblemOptions& options) {
  check_joints(scene.model);
  check_has_no_constraints(scene, "optimal control");
  const auto plants = std::make_shared<const Plants>(scene, gains(scene, options.unit));
  const Model<double>& model = scene.model;
  std::vector<std::string> states = prefixed("q.", model), velocities = prefixed("v.", model), controls;
  states.insert(states.end(), velocities.begin(), velocities.end());
  for (int dof : plants->dofs) controls.push_back("u." + model.joints[std::size_t(dof)].name);
  const StageFunction ode = forward_rate(plants);
  if (options.form == DynamicsForm::kForward) return {model.name, states, controls, options.duration, ode};

  Problem problem(model.name, states, controls, options.duration, [n = model.nv](const auto& s) {
    auto rate = s.x;
    rate << s.x.tail(n), s.a;
    return rate;
  });
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(model.nv);
  for (int i = 0; i < model.nv; ++i) {
    const double limit = effort_limit(scene, i, false);
    if (std::isfinite(limit) && limit > 0) scale[i] = 1 / limit;
  }
  problem.use_accelerations(prefixed("a.", model), scaled_residual(plants, scale), ode);
  return problem;
}

Eigen::VectorXd holding_torque(const RobotScene& scene, const Eigen::VectorXd& q) {
  Data<double> data(scene.model);
  dynamics::EffectTorques<double> torques(scene.model);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(scene.model.nv);
  return dynamics::inverse_dynamics(scene.model, data, torques, scene.effects, q, zero, zero);
}

double rated(double limit) { return limit > 0 ? limit : std::numeric_limits<double>::infinity(); }

void limit_positions(Problem& problem, const RobotScene& scene) {
  for (int i = 0; i < scene.model.nv; ++i) {
    problem.x.lower[i] = scene.model.joints[std::size_t(i)].limits.lower;
    problem.x.upper[i] = scene.model.joints[std::size_t(i)].limits.upper;
  }
}

void limit_velocities(Problem& problem, const RobotScene& scene) {
  const int n = scene.model.nv;
  for (int i = 0; i < n; ++i) {
    const double limit = rated(scene.model.joints[std::size_t(i)].limits.velocity);
    problem.x.lower[n + i] = -limit;
    problem.x.upper[n + i] = limit;
  }
}

void limit_efforts(Problem& problem, const RobotScene& scene, ControlUnit unit) {
  const std::vector<int> dofs = actuated_dofs(scene);
  for (std::size_t k = 0; k < dofs.size(); ++k) {
    const double limit = unit == ControlUnit::kFraction ? 1 : rated(effort_limit(scene, dofs[k], false));
    problem.u.lower[long(k)] = -limit;
    problem.u.upper[long(k)] = limit;
  }
}

Term squared_controls(double weight) {
  return running_squares("control", [r = std::sqrt(weight)](const auto& s) { return (s.u * r).eval(); });
}

Term squared_fractions(const RobotScene& scene, double weight, ControlUnit unit) {
  Eigen::VectorXd scale = gains(scene, ControlUnit::kFraction).cwiseInverse() * std::sqrt(weight);
  if (unit == ControlUnit::kFraction) scale.setConstant(std::sqrt(weight));
  return running_squares("effort", [scale](const auto& s) {
    using T = typename std::decay_t<decltype(s.u)>::Scalar;
    return s.u.cwiseProduct(scale.template cast<T>()).eval();
  });
}

Term squared_accelerations(const Problem& problem, double weight) {
  const StageFunction rate = problem.rate;
  return running_squares("acceleration", [rate, r = std::sqrt(weight)](const auto& s) {
    return (rate(s).tail(s.x.size() / 2) * r).eval();
  });
}

Term joint_tracking(Eigen::VectorXd w_q, Eigen::VectorXd q_ref, Eigen::VectorXd w_v, Eigen::VectorXd v_ref) {
  const Eigen::VectorXd root = joined<double>(w_q, w_v).cwiseSqrt(), reference = joined<double>(q_ref, v_ref);
  return running_squares("tracking", [=](const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    return (s.x - reference.template cast<T>()).cwiseProduct(root.template cast<T>()).eval();
  });
}

}  // namespace dyntape
