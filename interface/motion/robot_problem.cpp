// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/motion/robot_problem.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/factorisations.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/effects/check.h>
#include <dyntape/interface/control/problem/penalties.h>
#include <dyntape/interface/motion/implicit_contacts.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/motion/robot_plant.h>
#include <dyntape/interface/motion/robot_terms.h>
#include <dyntape/interface/robot/robot_callee.h>
#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape {
namespace {

using detail::Drives;
using detail::Plant;
using dynamics::Data;
using dynamics::Matrix3;
using dynamics::Model;
using dynamics::Vector3;
using dynamics::VectorX;

template <class T>
VectorX<T> joined(const VectorX<T>& a, const VectorX<T>& b) {
  VectorX<T> c(a.size() + b.size());
  c << a, b;
  return c;
}

// Both scalars of the plant.  The taped one is made within the recording that asks for it: an AD belongs to
// one recording.  Its dynamics are callees, whose derivatives are the analytic ones, where that pays.
struct Plants {
  RobotScene scene;
  Drives drives;
  std::shared_ptr<Plant<double>> plain;
  std::shared_ptr<const Callee> forward_callee, inverse_callee;  // null: recorded as they are

  Plants(const RobotScene& s, const Drives& d)
      : scene(s), drives(d), plain(std::make_shared<Plant<double>>(s.model, s.effects, d)) {
    dynamics::check(s.model, s.effects);
    const bool adds_inertia = s.effects.acting().added.count > 0;  // which callees do not know
    if (adds_inertia || !d.ties.empty() || !is_worth_callees(s.model)) return;
    const Model<double> acting = dynamics::acting_model(s.model, s.effects);
    forward_callee = forward_dynamics_callee(acting);
    inverse_callee = inverse_dynamics_callee(acting);
  }

  VectorXad forward(const Stage<AD>& s) const {
    Plant<AD> plant = recorded();
    if (!forward_callee) return plant.forward(s);
    const VectorXad tau = plant.driving(s) + plant.passive(s);
    return call(forward_callee, joined<AD>(joined<AD>(plant.q(s), plant.seen_v(s)), tau));
  }
  Eigen::VectorXd forward(const Stage<double>& s) const { return plain->forward(s); }

  // The torques that the motion needs, less the controls'.
  VectorXad missing(const Stage<AD>& s) const {
    Plant<AD> plant = recorded();
    if (!inverse_callee) return plant.inverse(s) - plant.driving(s);
    const VectorXad tau = call(inverse_callee, joined<AD>(joined<AD>(plant.q(s), plant.seen_v(s)), s.a));
    return tau - plant.passive(s) - plant.driving(s);
  }
  Eigen::VectorXd missing(const Stage<double>& s) const { return plain->inverse(s) - plain->driving(s); }

  using Rigid = dynamics::UnilateralConstraints;
  auto touching(const Stage<AD>& s, const Rigid& rigid) const { return recorded().touching(s, rigid); }
  auto touching(const Stage<double>& s, const Rigid& rigid) const { return plain->touching(s, rigid); }

  auto held(const Stage<AD>& s, const VectorXad& a, int i) const { return recorded().held(s, a, i); }
  auto held(const Stage<double>& s, const Eigen::VectorXd& a, int i) const { return plain->held(s, a, i); }

  // N(q) v.
  template <class T>
  VectorX<T> configuration(const Stage<T>& s) const {
    const int nq = scene.model.nq, nv = scene.model.nv;
    return configuration_rate<T>(scene.model, s.x.head(nq), s.x.segment(nq, nv));
  }

  Plant<AD> recorded() const { return {scene.model.cast<AD>(), scene.effects.cast<AD>(), drives}; }
};

StageFunction forward_rate(const std::shared_ptr<const Plants>& plants) {
  return [plants](const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    return joined<T>(plants->configuration(s), plants->forward(s));
  };
}

StageFunction scaled_residual(const std::shared_ptr<const Plants>& plants, const Eigen::VectorXd& scale) {
  return [plants, scale](const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    const VectorX<T> missing = detail::tied_rows<T>(plants->drives.ties, plants->missing(s), s.a);
    return VectorX<T>(missing.cwiseProduct(scale.template cast<T>()));
  };
}

double effort_limit(const RobotScene& scene, const dynamics::Joint<double>& joint, bool required) {
  const double limit = joint.limits.effort;
  if (required && !(std::isfinite(limit) && limit > 0)) {
    throw ArgumentError(
        "robot \"" + scene.model.name + "\": joint \"" + joint.name +
        "\" has no effort limit, and controls are asked for as fractions of it; expected an effort "
        "above zero in the <limit> of its file, or controls in N m");
  }
  return limit;
}

const dynamics::Joint<double>& joint_of_dof(const Model<double>& model, int dof) {
  for (const auto& joint : model.joints)
    if (dof < joint.idx_v + dynamics::nv(joint.type)) return joint;
  return model.joints.back();
}

Eigen::VectorXd gains(const RobotScene& scene, ControlUnit unit) {
  const std::vector<int> dofs = actuated_dofs(scene);
  Eigen::VectorXd gain = Eigen::VectorXd::Ones(Eigen::Index(dofs.size()));
  if (unit == ControlUnit::kPhysical) return gain;
  for (std::size_t k = 0; k < dofs.size(); ++k)
    gain[long(k)] = effort_limit(scene, joint_of_dof(scene.model, dofs[k]), true);
  return gain;
}

Drives::Push push_of(const RobotScene& scene, const Thruster& thruster) {
  const auto refuse = [&](const std::string& what) {
    dyntape::refuse(scene.model, "thruster \"" + thruster.name + "\": " + what);
  };
  if (!thruster.axis.allFinite() || !(thruster.axis.stableNorm() > 0))
    refuse("the axis is no direction; expected three finite numbers, not all of them zero");
  if (!(thruster.lower <= thruster.upper))
    refuse("the thrust lies between " + std::to_string(thruster.lower) + " and " +
           std::to_string(thruster.upper) + " N; expected the smaller one first");
  if (!std::isfinite(thruster.moment)) refuse("the moment of a newton is no finite number");
  const Eigen::Vector3d axis = thruster.axis.stableNormalized();
  return {moving_frame(scene.model, thruster.frame), axis, axis * thruster.moment};
}

void check_contact(const std::string& robot, const HeldContact& contact) {
  const auto refuse = [&](const std::string& what) {
    throw ArgumentError("robot \"" + robot + "\": contact of \"" + contact.frame + "\": " + what);
  };
  if (!(contact.friction > 0 && std::isfinite(contact.friction)))
    refuse("the friction is " + std::to_string(contact.friction) + ", expected a number above zero");
  if (contact.place && !contact.place->allFinite()) refuse("its place has an entry that is no finite number");
  if (contact.axes && !contact.axes->isUnitary(1e-9)) refuse("its axes are no rotation");
  if (!contact.corners.empty() && contact.corners.size() < 3)
    refuse("a foot of " + std::to_string(contact.corners.size()) + " corners, expected three or more");
  for (const Eigen::Vector3d& corner : contact.corners)
    if (!corner.allFinite()) refuse("a corner has an entry that is no finite number");
}

// With a frame at each corner of a foot, behind those that there are.
RobotScene with_corners(RobotScene scene, const RobotProblemOptions& options) {
  for (const HeldContact& contact : options.contacts) {
    if (contact.corners.empty()) continue;
    const dynamics::Frame<double> foot =
        scene.model.frames[std::size_t(moving_frame(scene.model, contact.frame))];
    for (const Eigen::Vector3d& corner : contact.corners) {
      dynamics::Frame<double> at = foot;
      at.X_BF.p += at.X_BF.R * corner;
      scene.model.frames.push_back(at);
    }
  }
  return scene;
}

Drives drives_of(const RobotScene& scene, const RobotProblemOptions& options) {
  Drives drives{actuated_dofs(scene), gains(scene, options.unit), {}, {}};
  for (const Thruster& thruster : options.thrusters) drives.thrusters.push_back(push_of(scene, thruster));
  std::vector<int> held;
  int corner = int(scene.model.frames.size());  // with_corners() below
  for (const HeldContact& contact : options.contacts) {
    check_contact(scene.model.name, contact);
    const int frame = moving_frame(scene.model, contact.frame);
    if (std::find(held.begin(), held.end(), frame) != held.end())
      refuse(scene.model, "frame \"" + contact.frame + "\" has two held contacts, expected one");
    held.push_back(frame);
    if (contact.corners.empty()) drives.contacts.push_back(frame);
    for (std::size_t i = 0; i < contact.corners.size(); ++i) drives.contacts.push_back(corner++);
  }
  drives.rigid = scene.constraints.rigid;
  drives.ties = ties_of(scene);
  return drives;
}

std::vector<std::string> control_names(const RobotScene& scene, const RobotProblemOptions& options) {
  std::vector<std::string> names;
  for (const std::string& joint : driven_names(scene)) names.push_back("u." + joint);
  for (const Thruster& thruster : options.thrusters) names.push_back("f." + thruster.name);
  for (const HeldContact& contact : options.contacts) {
    for (const std::string& point : force_points(contact)) {
      for (const char* axis : {".x", ".y", ".z"}) names.push_back("f." + point + axis);
    }
  }
  for (const std::string& name : force_names(scene.constraints.rigid)) names.push_back(name);
  return names;
}

// How far orientations move is not told by a guess that does not turn: about one, as directions do.
Eigen::VectorXd typical_moves(const Model<double>& model) {
  Eigen::VectorXd typical = Eigen::VectorXd::Zero(model.nq + model.nv);
  for (const auto& joint : model.joints) {
    const auto [first, count] = direction_entries(joint);
    typical.segment(first, count).setOnes();
  }
  return typical;
}

// Angles say the same after a turn, so none is estimated to move by more than half of one.
Eigen::VectorXd half_turns(const Model<double>& model) {
  Eigen::VectorXd most = Eigen::VectorXd::Zero(model.nq + model.nv);
  for (const auto& joint : model.joints)
    if (dynamics::traits(joint.type).has_angle) most[joint.idx_q] = std::numbers::pi;
  return most;
}

void bound_forces(Problem& problem, const Model<double>& model, const Drives& drives,
                  const RobotProblemOptions& options) {
  Eigen::Index k = drives.gain.size();
  for (const Thruster& thruster : options.thrusters) {
    problem.u.lower[k] = thruster.lower;
    problem.u.upper[k++] = thruster.upper;
  }
  for (const HeldContact& contact : options.contacts) {
    const std::vector<int> axes = held_axes(model, contact);
    for (std::size_t point = 0; point < force_points(contact).size(); ++point, k += 3) {
      for (int i = 0; i < 3; ++i) {
        if (std::find(axes.begin(), axes.end(), i) == axes.end())
          problem.u.lower[k + i] = problem.u.upper[k + i] = 0;
      }
      if (contact.barrier == 0) problem.u.lower[k + 2] = 0;
    }
  }
}

constexpr double kConeTip = 1e-3;          // of the weight, below no force
constexpr double kPull = 100, kDrag = 20;  // of held points (1/s^2, 1/s): critically damped

// (6) Rows that keep a frame where it is: of its origin, and of its axes.  A scheduled contact stands wherever it has landed.
template <class T>
VectorX<T> holding_rows(const HeldContact& contact, const detail::HeldFrame<T>& f) {
  VectorX<T> rows = f.acceleration.vector() + f.velocity.vector() * T(kDrag);
  if (contact.has_schedule) return rows;
  if (contact.place) rows.head(3) += (f.placement.p - contact.place->template cast<T>()) * T(kPull);
  // sin(angle) about the axis by which it is turned, which is the angle where it holds
  for (int i = 0; contact.axes && i < 3; ++i) {
    const Vector3<T> wanted = contact.axes->col(i).template cast<T>();
    rows.tail(3) += wanted.cross(Vector3<T>(f.placement.R.col(i))) * T(kPull / 2);
  }
  return rows;
}

// (6) Force and moment about the frame's origin, world axes, of the forces at a foot's corners or at a point.
template <class T>
VectorX<T> wrench_of(const HeldContact& contact, const Matrix3<T>& R, const VectorX<T>& forces) {
  VectorX<T> wrench = VectorX<T>::Zero(6);
  wrench.head(3) = forces.head(3);
  for (std::size_t i = 0; i < contact.corners.size(); ++i) {
    const Vector3<T> at = R * contact.corners[i].cast<T>(), force = forces.segment(3 * Eigen::Index(i), 3);
    if (i > 0) wrench.head(3) += force;
    wrench.tail(3) += at.cross(force);
  }
  return wrench;
}

// It is held; with a load, only while it is loaded, and has no wrench else.  forces: its first control.
StageFunction holds(const std::shared_ptr<const Plants>& plants, const HeldContact& contact,
                    const std::optional<Parameter>& load, Eigen::Index forces) {
  return [=, frame = moving_frame(plants->scene.model, contact.frame),
          count = 3 * force_points(contact).size(), scale = 1 / weight_of(plants->scene)](const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    const VectorX<T> a = s.a.size() > 0 ? VectorX<T>(s.a) : plants->forward(s);
    const detail::HeldFrame<T> f = plants->held(s, a, frame);
    const VectorX<T> rows = holding_rows(contact, f);
    if (!load) return rows;
    const T on = (*load)(s)[0], off = (T(1) - on) * T(scale);
    return VectorX<T>(rows * on + wrench_of<T>(contact, f.placement.R, s.u.segment(forces, count)) * off);
  };
}

// friction fz - |(fx, fy)| over the weight, the latter rounded near zero; while it is loaded.
Term soft_cone(const HeldContact& contact, Eigen::Index first, double weight,
               const std::optional<Parameter>& load) {
  constexpr double kRound = 1e-2;
  const auto room = [=, scale = 1 / weight, mu = contact.friction](const auto& s) {
    using T = typename std::decay_t<decltype(s.u)>::Scalar;
    using std::sqrt;
    const T x = s.u[first] * T(scale), y = s.u[first + 1] * T(scale), z = s.u[first + 2] * T(scale);
    const T room = z * T(mu) - (sqrt(x * x + y * y + T(kRound * kRound)) - T(kRound));
    return vector(load ? T(room * (*load)(s)[0] + T(1) - (*load)(s)[0]) : room);
  };
  const Term cone = path_not_negative(contact.frame + " cone", room);
  return soft(cone, RelaxedBarrier{contact.barrier, contact.width});
}

void add_contacts(Problem& problem, const std::shared_ptr<const Plants>& plants,
                  const RobotProblemOptions& options) {
  const double weight = weight_of(plants->scene);
  Eigen::Index k = problem.n_u() - plants->drives.n_rigid() - plants->drives.n_held();
  for (const HeldContact& contact : options.contacts) {
    const std::vector<int> axes = held_axes(plants->scene.model, contact);
    std::optional<Parameter> load;
    if (contact.has_schedule) load = problem.parameters.add(contact.frame + " load", 1.0);
    problem.add(path_equality(contact.frame + " holds", entries_of(holds(plants, contact, load, k), axes)));
    for (const std::string& point : force_points(contact)) {
      HeldContact at = contact;
      at.frame = point;
      problem.add(contact.barrier > 0
                      ? soft_cone(at, k, weight, load)
                      : friction_cone(plants->scene.model.name, {point, contact.friction}, k, weight));
      k += 3;
    }
  }
}

}  // namespace

std::vector<std::string> force_points(const HeldContact& contact) {
  if (contact.corners.empty()) return {contact.frame};
  std::vector<std::string> names;
  for (std::size_t i = 0; i < contact.corners.size(); ++i)
    names.push_back(contact.frame + "." + std::to_string(i));
  return names;
}

std::vector<int> held_axes(const Model<double>& model, const HeldContact& contact) {
  std::vector<int> axes = moved_axes(model, contact.frame);
  if (contact.corners.empty()) std::erase_if(axes, [](int axis) { return axis >= 3; });
  return axes;
}

double weight_of(const RobotScene& scene) {
  double mass = 0;
  for (const auto& inertia : scene.model.inertias) mass += inertia.mass;
  const double weight = mass * scene.model.gravity.norm();
  return weight > 0 ? weight : 1;
}

Term friction_cone(const std::string& robot, const HeldContact& contact, Eigen::Index first, double weight) {
  check_contact(robot, contact);
  const auto room = [k = first, steep = contact.friction / weight, scale = 1 / weight](const auto& s) {
    using T = typename std::decay_t<decltype(s.u)>::Scalar;
    const T x = s.u[k] * scale, y = s.u[k + 1] * scale, most = s.u[k + 2] * steep + kConeTip;
    return vector(T(most - (x * x + y * y) / most));
  };
  return path_not_negative(contact.frame + " cone", room);
}

Problem robot_problem(const RobotScene& scene, const RobotProblemOptions& options) {
  check_implicit_contacts(scene);
  const auto plants = std::make_shared<const Plants>(with_corners(scene, options), drives_of(scene, options));
  const Model<double>& model = scene.model;
  std::vector<std::string> states = entry_names_of(model, "q.", true);
  const std::vector<std::string> velocities = entry_names_of(model, "v.", false);
  states.insert(states.end(), velocities.begin(), velocities.end());
  const std::vector<std::string> controls = control_names(scene, options);
  const StageFunction ode = forward_rate(plants);
  Problem problem;
  if (options.form == DynamicsForm::kForward) {
    problem = Problem(model.name, states, controls, options.duration, ode);
  } else {
    problem = Problem(model.name, states, controls, options.duration, [plants](const auto& s) {
      using T = typename std::decay_t<decltype(s.x)>::Scalar;
      return joined<T>(plants->configuration(s), s.a);
    });
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(model.nv);
    for (const auto& joint : model.joints) {
      const double limit = effort_limit(scene, joint, false);
      if (std::isfinite(limit) && limit > 0) scale[joint.idx_v] = 1 / limit;
    }
    problem.use_accelerations(entry_names_of(model, "a.", false), scaled_residual(plants, scale), ode);
  }
  problem.positions = model.nq;
  bound_forces(problem, model, plants->drives, options);
  add_contacts(problem, plants, options);
  add_implicit_contacts(problem, scene.constraints.rigid, weight_of(scene),
                        [plants](const auto& s, const auto& rigid) { return plants->touching(s, rigid); });
  problem.most_typical = half_turns(model);
  if (!is_on_lines(model)) {
    problem.typical = typical_moves(model);
    problem.difference = [plants](const Eigen::VectorXd& from, const Eigen::VectorXd& x) {
      return state_difference(plants->scene.model, from, x);
    };
  }
  return problem;
}

Eigen::VectorXd holding_torque(const RobotScene& scene, const Eigen::VectorXd& q) {
  Data<double> data(scene.model);
  dynamics::EffectTorques<double> torques(scene.model);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(scene.model.nv);
  return dynamics::inverse_dynamics(scene.model, data, torques, scene.effects, q, zero, zero);
}

Eigen::VectorXd holding_controls(const RobotScene& scene, const RobotProblemOptions& options,
                                 const Eigen::VectorXd& q) {
  Plant<double> plant(with_corners(scene, options).model, scene.effects, drives_of(scene, options));
  const int n = plant.drives.n_u(), joints = int(plant.drives.dofs.size()), nv = scene.model.nv;
  const Eigen::VectorXd tau = plant.drives.ties.gathered(holding_torque(scene, q));
  Eigen::VectorXd u(n);
  if (!plant.drives.push()) {
    for (int k = 0; k < n; ++k) u[k] = tau[plant.drives.dofs[std::size_t(k)]] / plant.drives.gain[k];
    return u;
  }
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(nv, n);
  for (int k = 0; k < joints; ++k) B(plant.drives.dofs[std::size_t(k)], k) = plant.drives.gain[k];
  Eigen::VectorXd x = Eigen::VectorXd::Zero(scene.model.nq + nv);
  x.head(scene.model.nq) = q;
  for (int k = joints; k < n; ++k)
    B.col(k) = plant.drives.ties.gathered(plant.push_torques({0, x, {}, Eigen::VectorXd::Unit(n, k)}));
  return least_norm_solution(B, tau);
}

double rated(double limit) { return limit > 0 ? limit : std::numeric_limits<double>::infinity(); }

void limit_positions(Problem& problem, const RobotScene& scene) {
  for (const auto& joint : scene.model.joints) {
    if (!dynamics::traits(joint.type).on_a_line) continue;
    problem.x.lower[joint.idx_q] = joint.limits.lower;
    problem.x.upper[joint.idx_q] = joint.limits.upper;
  }
}

void limit_velocities(Problem& problem, const RobotScene& scene) {
  for (const auto& joint : scene.model.joints) {
    if (!dynamics::is_single(joint.type)) continue;
    const double limit = rated(joint.limits.velocity);
    problem.x.lower[scene.model.nq + joint.idx_v] = -limit;
    problem.x.upper[scene.model.nq + joint.idx_v] = limit;
  }
}

void limit_efforts(Problem& problem, const RobotScene& scene, ControlUnit unit) {
  const std::vector<int> dofs = actuated_dofs(scene);
  for (std::size_t k = 0; k < dofs.size(); ++k) {
    const auto& joint = joint_of_dof(scene.model, dofs[k]);
    const double limit = unit == ControlUnit::kFraction ? 1 : rated(effort_limit(scene, joint, false));
    problem.u.lower[long(k)] = -limit, problem.u.upper[long(k)] = limit;
  }
}

StageFunction joint_torque(const RobotScene& scene, ControlUnit unit) {
  return [gain = gains(scene, unit)](const auto& s) {
    using T = typename std::decay_t<decltype(s.u)>::Scalar;
    return s.u.head(gain.size()).cwiseProduct(gain.template cast<T>()).eval();
  };
}

StageFunction joint_power(const RobotScene& scene, ControlUnit unit) {
  return
      [torque = joint_torque(scene, unit), dofs = actuated_dofs(scene), nq = scene.model.nq](const auto& s) {
        auto power = torque(s);
        for (std::size_t k = 0; k < dofs.size(); ++k) power[Eigen::Index(k)] *= s.x[nq + dofs[k]];
        return power;
      };
}

Term squared_controls(double weight) {
  return running_squares("control", [r = std::sqrt(weight)](const auto& s) { return (s.u * r).eval(); });
}

Term squared_fractions(const RobotScene& scene, double weight, ControlUnit unit) {
  Eigen::VectorXd scale = gains(scene, ControlUnit::kFraction).cwiseInverse() * std::sqrt(weight);
  if (unit == ControlUnit::kFraction) scale.setConstant(std::sqrt(weight));
  return running_squares("effort", [scale](const auto& s) {
    using T = typename std::decay_t<decltype(s.u)>::Scalar;
    return s.u.head(scale.size()).cwiseProduct(scale.template cast<T>()).eval();
  });
}

Term squared_accelerations(const Problem& problem, double weight) {
  const auto is_velocity = [](const std::string& name) { return name.starts_with("v."); };
  const auto n = std::count_if(problem.states.begin(), problem.states.end(), is_velocity);
  return running_squares("acceleration", [rate = problem.rate, n, r = std::sqrt(weight)](const auto& s) {
    return (rate(s).tail(n) * r).eval();
  });
}

Term joint_tracking(const RobotScene& scene, const Eigen::VectorXd& w_q, const Eigen::VectorXd& q_ref,
                    const Eigen::VectorXd& w_v, const Eigen::VectorXd& v_ref) {
  const Eigen::VectorXd root = joined<double>(w_q, w_v).cwiseSqrt();
  const StageFunction error = configuration_error(scene, q_ref);
  return running_squares("tracking", [=, first = scene.model.nq, n = scene.model.nv](const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    const VectorX<T> dv = s.x.segment(first, n) - v_ref.template cast<T>();
    return joined<T>(error(s), dv).cwiseProduct(root.template cast<T>()).eval();
  });
}

}  // namespace dyntape
