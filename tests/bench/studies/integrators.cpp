// SPDX-License-Identifier: BSD-3-Clause
//
// Steps in time: what is lost by which scheme, and what it takes.
#include <algorithm>
#include <chrono>
#include <cmath>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/simulation/state_space.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/system/scene_system.h>
#include <dyntape/interface/system/steps/stepper.h>

#include "measure.h"
#include "oracles.h"
#include "study.h"

namespace dyntape::tools {
namespace {

using dynamics::Model;
using Eigen::VectorXd;

constexpr double kLost = 1e6;  // times its first size: a motion that is not followed further

// A robot without motors, and how it begins.
struct Free {
  std::string label;
  RobotScene scene;
  VectorXd x0;
  double seconds;  // until errors are looked at
  double step;     // of the long motion
  double unit;     // of its energy
};

Free free_robot(const StudyOptions& options, const std::string& label, const std::string& urdf,
                dynamics::Base base, double seconds, double step) {
  Free robot{label, {}, {}, seconds, step, 0};
  robot.scene.model = dynamics::load_urdf(options.config + "/robots/" + urdf, {.base = base});
  const Model<double>& model = robot.scene.model;
  robot.x0 = VectorXd::Zero(model.nq + model.nv);
  robot.x0.head(model.nq) = dynamics::neutral(model);
  return robot;
}

std::vector<Free> robots(const StudyOptions& options) {
  using dynamics::Base;
  std::vector<Free> all;
  Free pendulum = free_robot(options, "pendulum", "pendulum.urdf", Base::kFixed, 5, 0.01);
  pendulum.x0[0] = 2, pendulum.unit = 9.81;
  Free two = free_robot(options, "double pendulum", "double_pendulum.urdf", Base::kFixed, 2, 5e-3);
  two.x0.head<2>() << 0.5, -0.9;
  two.unit = 9.81 * (2 * std::cos(0.5) + std::cos(0.4));
  Free body = free_robot(options, "free body that tumbles", "free_body.urdf", Base::kFloating, 10, 1e-3);
  body.scene.model.gravity.setZero();
  body.x0.tail<3>() << 0.01, 5, 0.01;
  body.unit = 25.0002;
  Free quadruped = free_robot(options, "quadruped in flight", "solo12.urdf", Base::kFloating, 0.5, 0);
  VectorXd& x = quadruped.x0;
  for (int leg = 0; leg < 4; ++leg)
    x.segment<3>(7 + 3 * leg) << 0, leg < 2 ? 0.8 : -0.8, leg < 2 ? -1.6 : 1.6;
  for (int i = 0; i < 18; ++i) x[19 + i] = i < 6 ? std::sin(i + 1.0) : 4 * std::sin(2.0 * i);
  all.push_back(std::move(pendulum)), all.push_back(std::move(two)), all.push_back(std::move(body));
  all.push_back(std::move(quadruped));
  return all;
}

double energy(const Free& robot, dynamics::Data<double>& data, const VectorXd& x) {
  const Model<double>& model = robot.scene.model;
  const VectorXd q = x.head(model.nq), v = x.tail(model.nv);
  return dynamics::kinetic_energy<double>(model, data, q, v) +
         dynamics::potential_energy<double>(model, data, q);
}

double distance(const Model<double>& model, const VectorXd& a, const VectorXd& b) {
  const dynamics::ConfigurationSpace<double> Q(model);
  const VectorXd turned = Q.difference(a.head(model.nq), b.head(model.nq));
  return std::max(turned.lpNorm<Eigen::Infinity>(), (a - b).tail(model.nv).lpNorm<Eigen::Infinity>());
}

// A sentence, or "": all is well.
std::string follow(Stepper& stepper, double h, long steps, VectorXd& x) {
  std::string why;
  const VectorXd no_torque = VectorXd::Zero(stepper.n_u());
  for (long k = 0; k < steps; ++k) {
    if (!stepper.step(double(k) * h, h, x.data(), no_torque.data(), nullptr, x.data(), &why)) return why;
  }
  return "";
}

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// Error of the whole motion against the time that it takes; the parameter is the step, or the tolerance of adaptive ones.
void measure_errors(Study& study, const Free& robot, const StudyOptions& options) {
  const VectorXd exact = exact_end(robot.scene.model, robot.x0, robot.seconds);
  const System system = system_of(robot.scene);
  const auto add = [&](Stepper& stepper, Integrator integrator, double parameter, long steps) {
    StudyRow row{"error", robot.label, to_string(integrator), parameter};
    row.seconds = HUGE_VAL;
    for (int run = 0; run < 3 && row.trouble.empty(); ++run) {
      VectorXd x = robot.x0;
      const auto begin = std::chrono::steady_clock::now();
      row.trouble = follow(stepper, robot.seconds / double(steps), steps, x);
      row.seconds = std::min(row.seconds, seconds_since(begin));
      if (row.trouble.empty()) row.value = distance(robot.scene.model, exact, x);
      if (row.seconds > 0.2) break;
    }
    study.rows.push_back(row);
  };
  for (Integrator integrator : kIntegrators) {
    options.watch(robot.label + ", " + to_string(integrator));
    if (is_adaptive(integrator)) {
      for (int digits = 3; digits <= (options.quick ? 6 : 13); digits += options.quick ? 3 : 1) {
        const Tolerances tolerances{.relative = std::pow(10.0, -digits),
                                    .absolute = std::pow(10.0, -digits - 3)};
        Stepper stepper(system, integrator, {}, false, 1, tolerances);
        add(stepper, integrator, tolerances.relative, 1);
      }
      continue;
    }
    Stepper stepper(system, integrator);
    for (int doubled = 5; doubled <= (options.quick ? 9 : 16); ++doubled)
      add(stepper, integrator, robot.seconds / double(1L << doubled), 1L << doubled);
  }
}

// The largest change of energy over a million steps.
void measure_drift(Study& study, const Free& robot, const StudyOptions& options) {
  const System system = system_of(robot.scene);
  dynamics::Data<double> data(robot.scene.model);
  const double start = energy(robot, data, robot.x0);
  const long all = options.quick ? 100000 : 1000000;
  for (Integrator integrator : kIntegrators) {
    options.watch(robot.label + " for long, " + to_string(integrator));
    const bool adaptive = is_adaptive(integrator);
    const int at_once = adaptive ? 100 : 1;  // steps in one, which it divides as it needs
    Stepper stepper(system, integrator, {}, false, 1, {.relative = 1e-10, .absolute = 1e-13});
    StudyRow row{"drift", robot.label, to_string(integrator), robot.step, 0, 0};
    VectorXd x = robot.x0;
    const long looks = 10000;
    for (long k = 0; k < looks && row.trouble.empty(); ++k) {
      const auto begin = std::chrono::steady_clock::now();
      row.trouble = follow(stepper, robot.step * at_once, all / looks / at_once, x);
      row.seconds += seconds_since(begin);
      if (row.trouble.empty()) {
        row.value = std::max(row.value, std::abs(energy(robot, data, x) - start) / robot.unit);
        if (!(row.value < kLost)) row.trouble = "its energy grows without bound";
      }
    }
    row.seconds /= double(all);
    if (!row.trouble.empty()) row.value = std::numeric_limits<double>::quiet_NaN();
    study.rows.push_back(row);
  }
}

// m x'' = -k x for 2000 steps: the largest excursion, by the step in units of 1 / omega.
void measure_stiffness(Study& study, const StudyOptions& options) {
  const double mass = 1e-3, stiffness = 1e6, omega = std::sqrt(stiffness / mass), start = 1e-3;
  System spring{"spring"};
  dynamics::Joint<double> slider;
  slider.name = "slider", slider.type = dynamics::JointType::kPrismatic,
  slider.axis = Eigen::Vector3d(1, 0, 0);
  spring.model.add_joint(-1, slider, {}, {mass, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()});
  spring.acceleration = [=](const SystemPoint<AD>& at) { return VectorXad(at.q * AD(-stiffness / mass)); };
  spring.lagrangian = [=](const VectorXad& q, const VectorXad& v, const VectorXad&) {
    return 0.5 * (mass * v[0] * v[0] - stiffness * q[0] * q[0]);
  };
  for (Integrator integrator : kIntegrators) {
    if (is_adaptive(integrator)) continue;
    options.watch(std::string("stiff spring, ") + to_string(integrator));
    Stepper stepper(spring, integrator);
    for (double of_omega :
         {0.1, 0.3, 1.0, 1.5, 1.8973665961, 1.99, 2.02, 2.8, 2.9, 5.0, 20.0, 100.0, 316.2278}) {
      const double h = of_omega / omega;
      StudyRow row{"stiff", "spring, 1 g on 1e6 N/m", to_string(integrator), of_omega};
      VectorXd x = Eigen::Vector2d(start, 0);
      double most = 0;
      for (int k = 0; k < 2000 && most < kLost * start && row.trouble.empty(); ++k) {
        row.trouble = follow(stepper, h, 1, x);
        most = std::max(most, std::abs(x[0]));
      }
      if (most < kLost * start && row.trouble.empty())
        row.value = most / start;
      else if (row.trouble.empty())
        row.trouble = "grows without bound";
      study.rows.push_back(row);
    }
  }
}

// Of a curve, the least time for so many digits; NaN: none reaches them.
double seconds_for(const std::vector<StudyRow>& rows, double error) {
  double least = std::numeric_limits<double>::quiet_NaN();
  for (const StudyRow& row : rows)
    if (row.value <= error && !(least <= row.seconds)) least = row.seconds;
  return least;
}

std::string quickest_for(const Study& study, const std::string& subject, double error) {
  std::string name = "none";
  double least = HUGE_VAL;
  for (Integrator integrator : kIntegrators) {
    const double t = seconds_for(curve(study, "error", subject, to_string(integrator)), error);
    if (t < least) least = t, name = to_string(integrator);
  }
  return name + (std::isfinite(least) ? " (" + io::duration(least) + ")" : "");
}

}  // namespace

Study outline_of_integrators() {
  Study study{.name = "integrators",
              .title = "Integrators: what a step loses, and what it takes",
              .question = "Which scheme, and which step, for which digits?"};
  study.parts = {{.name = "error",
                  .title = "Error at the end of a motion",
                  .x_label = "time of the whole motion [s]",
                  .y_label = "error [rad, m, rad/s, m/s]"},
                 {.name = "drift",
                  .title = "Energy that is won or lost in a million steps",
                  .x_label = "time of a step [us]",
                  .y_label = "largest change, relative",
                  .x_scale = 1e6,
                  .mark = io::Mark::kPoints},
                 {.name = "stiff",
                  .title = "A stiff spring: its largest excursion by the step",
                  .x = StudyPart::kParameter,
                  .x_label = "step times the spring's angular frequency [1]",
                  .y_label = "largest excursion / first [1]"}};
  return study;
}

Study study_integrators(const StudyOptions& options) {
  Study study = outline_of_integrators();
  const std::vector<Free> all = robots(options);
  for (const Free& robot : all) measure_errors(study, robot, options);
  for (const Free& robot : all)
    if (robot.step > 0) measure_drift(study, robot, options);
  measure_stiffness(study, options);

  for (const Free& robot : all)
    study.parts[0].findings.push_back(
        robot.label + ", " + io::shortest(robot.seconds) + " s: quickest to an error of 1e-3 is " +
        quickest_for(study, robot.label, 1e-3) + ", to 1e-6 " + quickest_for(study, robot.label, 1e-6) +
        ", to 1e-9 " + quickest_for(study, robot.label, 1e-9) + ".");
  const auto drift = [&](const char* subject, Integrator integrator) {
    return io::scientific(point(study, "drift", subject, to_string(integrator)).value);
  };
  study.parts[1].findings = {
      "The pendulum with 10 ms: semi-implicit Euler stays within " +
          drift("pendulum", Integrator::kSemiImplicitEuler) + ", implicit midpoint within " +
          drift("pendulum", Integrator::kImplicitMidpoint) + "; Runge-Kutta has lost " +
          drift("pendulum", Integrator::kRungeKutta4) + " at the end and goes on losing.",
      "A free body that tumbles, by semi-implicit Euler with 1 ms: its energy changes by " +
          drift("free body that tumbles", Integrator::kSemiImplicitEuler) +
          " of itself; velocities first, then positions, is symplectic only where inertia does not turn. By "
          "implicit midpoint it keeps " +
          drift("free body that tumbles", Integrator::kImplicitMidpoint) + "."};
  study.parts[2].findings = {
      "Semi-implicit Euler is stable below 2 / omega and excursions grow towards it; Runge-Kutta below 2.83 "
      "/ omega. Implicit "
      "midpoint and the variational scheme keep the amplitude at any step, implicit velocity damps it."};
  study.left_out = {
      "Explicit Euler: dyntape does not offer it. It gains energy at every step; the pendulum above would "
      "have 470 times g after a "
      "million.",
      "Motions with contact: their errors are the contact's as much as the scheme's (study contacts).",
      "Adaptive schemes on the stiff spring: they have no step to choose."};
  study.methods = {
      "Compiled steps by Stepper, one state; the least time of three runs. The parameter "
      "in the table is the step "
      "in s, of adaptive schemes the relative tolerance.",
      "Errors against 113 bits by Runge-Kutta-Fehlberg 7(8) and Bulirsch-Stoer (Boost.Numeric.Odeint), which "
      "agree to 1e-18.",
      "Energies are looked at ten thousand times in a motion; relative to g times the length (pendulum), to "
      "the first energy (double "
      "pendulum, body)."};
  return study;
}

}  // namespace dyntape::tools
