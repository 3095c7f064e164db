// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/accuracy_warnings.h>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/run/simulate/stability.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

// Where a joint turns round within the step, its friction may be far stiffer than at both ends.
std::string trouble_at_turns(const Scene& scene, double t, const VectorXd& x) {
  const dynamics::Model<double>& model = scene.robot.model;
  dynamics::Data<double> data(model);
  dynamics::EffectTorques<double> torques(model);
  const VectorXd q = x.head(model.nq);
  const VectorXd tau =
      torques_at(actuated_dofs(scene.robot), drive_in(scene, x, scene.commands.at(t, x)), model.nv);
  VectorXd v = x.segment(model.nq, model.nv);
  const VectorXd next = v + scene.step * dynamics::forward_dynamics<double>(model, data, torques,
                                                                            scene.robot.effects, q, v, tau);
  const auto turns = (v.array() * next.array() < 0).eval();
  if (!turns.any()) return "";
  v = turns.select(VectorXd::Zero(model.nv), v);
  return stability_trouble(scene, q, v);
}

// Where half steps lead elsewhere again and again: friction that trembles, forces that come and go within a step.
std::string doubt_of_halves(const Scene& scene, Stepper& stepper, const std::vector<Look>& looks) {
  const int nq = scene.robot.model.nq, nv = scene.robot.model.nv;
  const double h = scene.step;
  std::vector<VectorXd> error;
  VectorXd whole(stepper.nx()), half(stepper.nx()), twice(stepper.nx());
  VectorXd most = VectorXd::Zero(nv);
  for (const auto& [k, x, forces] : looks) {
    const double t = double(k) * h;
    const VectorXd u = scene.commands.at(t + h / 2, x);
    if (!stepper.step(t, h, x.data(), u.data(), forces.data(), whole.data())) continue;
    if (!stepper.step(t, h / 2, x.data(), u.data(), forces.data(), half.data())) continue;
    if (!stepper.step(t + h / 2, h / 2, half.data(), u.data(), forces.data(), twice.data())) continue;
    most = most.cwiseMax((twice - x).segment(nq, nv).cwiseAbs());
    error.push_back((twice - whole).segment(nq, nv).cwiseAbs());
  }
  return doubt_of_half_steps(error, most);
}

}  // namespace

std::string doubt_of_half_steps(const std::vector<VectorXd>& error, const VectorXd& most) {
  constexpr double kElsewhere = 0.1, kOften = 0.25;
  long elsewhere = 0;
  for (const VectorXd& e : error) elsewhere += (e.array() > kElsewhere * most.array() + 1e-12).any();
  if (double(elsewhere) <= kOften * double(error.size()) || elsewhere < 3) return "";
  return "in " + std::to_string(elsewhere) + " of " + std::to_string(error.size()) +
         " places two steps of half the length lead elsewhere; take shorter steps, or smoother forces";
}

std::string at_time(double t) { return "at t = " + io::with_digits(t, 6) + " s: "; }

VectorXd drive_in(const Scene& scene, const VectorXd& x, const VectorXd& u) {
  VectorXd drive = u;
  Eigen::Index m = scene.robot.model.nq + scene.robot.model.nv;
  for (Eigen::Index k = 0; k < scene.robot.lag.size(); ++k) {
    if (scene.robot.lag[k] > 0) drive[k] = x[m++];
  }
  return drive;
}

std::string doubt_at(const Scene& scene, const Look& look) {
  const int nq = scene.robot.model.nq, nv = scene.robot.model.nv;
  const double t = double(look.step) * scene.step;
  std::string stiff = stability_trouble(scene, look.x.head(nq), look.x.segment(nq, nv));
  if (stiff.empty()) stiff = trouble_at_turns(scene, t, look.x);
  return stiff.empty() ? "" : at_time(t) + stiff;
}

std::string doubt_of_steps(const Scene& scene, Stepper& stepper, const std::vector<Look>& looks) {
  if (is_adaptive(scene.integrator)) return "";  // its steps are as short as its tolerances ask for
  for (const Look& look : looks) {
    if (std::string warning = doubt_at(scene, look); !warning.empty()) return warning;
  }
  return doubt_of_halves(scene, stepper, looks);
}

}  // namespace dyntape
