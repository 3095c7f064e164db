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
  data.following = ties_of(scene.robot).following<double>();
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

std::string at_time(double t) { return "at t = " + io::with_digits(t, 6) + " s: "; }

}  // namespace

bool is_look(const Scene& scene, long step) {
  constexpr long kLooks = 64;
  return step % (1 + scene.steps() / kLooks) == 0;
}

void HalfSteps::try_at(const Scene& scene, Stepper& stepper, const Look& look, const VectorXd& u,
                       const VectorXd& p, const VectorXd& whole) {
  const double h = scene.step, t = double(look.step) * h;
  VectorXd half(look.x.size()), twice(look.x.size());
  if (!stepper.step(t, h / 2, look.x.data(), u.data(), p.data(), half.data())) return;
  if (!stepper.step(t + h / 2, h / 2, half.data(), u.data(), p.data(), twice.data())) return;
  note(scene, look, whole, twice);
}

void HalfSteps::note(const Scene& scene, const Look& look, const VectorXd& whole, const VectorXd& twice) {
  const int nq = scene.robot.model.nq, nv = scene.robot.model.nv;
  const VectorXd error = (twice - whole).segment(nq, nv).cwiseAbs();
  const VectorXd change = (twice - look.x).segment(nq, nv).cwiseAbs();
  looks_.push_back(look);
  if (!error.allFinite() || !change.allFinite()) return;
  most_ = errors_.empty() ? change : VectorXd(most_.cwiseMax(change));
  errors_.push_back(error);
}

std::string HalfSteps::warning() const {
  constexpr double kElsewhere = 0.1, kOften = 0.25;
  long elsewhere = 0;
  for (const VectorXd& e : errors_) elsewhere += (e.array() > kElsewhere * most_.array() + 1e-12).any();
  if (double(elsewhere) <= kOften * double(errors_.size()) || elsewhere < 3) return "";
  return "in " + std::to_string(elsewhere) + " of " + std::to_string(errors_.size()) +
         " places two steps of half the length lead elsewhere; take shorter steps, or smoother forces";
}

VectorXd drive_in(const Scene& scene, const VectorXd& x, const VectorXd& u) {
  VectorXd drive = u;
  Eigen::Index m = scene.robot.model.nq + scene.robot.model.nv;
  for (Eigen::Index k = 0; k < scene.robot.lag.size(); ++k) {
    if (scene.robot.lag[k] > 0) drive[k] = x[m++];
  }
  return drive;
}

std::string trouble_of_step(const Scene& scene, double t, const VectorXd& x, const std::string& why) {
  const int nq = scene.robot.model.nq, nv = scene.robot.model.nv;
  const std::string stiff = stability_trouble(scene, x.head(nq), x.segment(nq, nv));
  return at_time(t) + (stiff.empty() ? why : stiff);
}

std::string doubt_of_stiffness(const Scene& scene, const std::vector<Look>& looks) {
  const int nq = scene.robot.model.nq, nv = scene.robot.model.nv;
  for (const Look& look : looks) {
    const double t = double(look.step) * scene.step;
    std::string stiff = stability_trouble(scene, look.x.head(nq), look.x.segment(nq, nv));
    if (stiff.empty()) stiff = trouble_at_turns(scene, t, look.x);
    if (!stiff.empty()) return at_time(t) + stiff;
  }
  return "";
}

std::string doubt_of_steps(const Scene& scene, Stepper& stepper, const std::vector<Look>& looks) {
  if (is_adaptive(scene.integrator)) return "";  // its steps are as short as its tolerances ask for
  if (std::string stiff = doubt_of_stiffness(scene, looks); !stiff.empty()) return stiff;
  HalfSteps halves;
  VectorXd whole(stepper.nx());
  for (const Look& look : looks) {
    const double t = double(look.step) * scene.step;
    const VectorXd u = scene.commands.at(t + scene.step / 2, look.x);
    if (stepper.step(t, scene.step, look.x.data(), u.data(), look.forces.data(), whole.data()))
      halves.try_at(scene, stepper, look, u, look.forces, whole);
  }
  return halves.warning();
}

}  // namespace dyntape
