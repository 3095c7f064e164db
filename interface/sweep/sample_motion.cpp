// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/sweep/sample_motion.h>

#include <algorithm>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/interface/scene/stability.h>
#include <dyntape/interface/scene/step_doubts.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

Function record_swept_energy(const SceneSweep& sweep, const Stepper& stepper) {
  const RobotScene& robot = sweep.scene.robot;
  const int nq = robot.model.nq, nv = robot.model.nv, n_u = stepper.n_u(), n_p = stepper.n_p();
  const SceneEdit edit = edit_of(sweep);
  return record(robot.model.name + " energies", std::size_t(stepper.nx()), std::size_t(2 + n_u + n_p),
                [&](const VectorXad& x, const VectorXad& arguments) {
                  RecordedScene scene = recorded(robot);
                  edit(scene, arguments.tail(n_p));
                  dynamics::Data<AD> data(scene.model);
                  const VectorXad q = x.head(nq), v = x.segment(nq, nv);
                  VectorXad energies(2);
                  energies[0] = dynamics::kinetic_energy<AD>(scene.model, data, q, v, scene.effects.acting());
                  energies[1] = dynamics::stored_energy<AD>(scene.model, data, scene.effects, q);
                  return energies;
                });
}

bool needs_newton(const Scene& scene) { return longest_step(scene.integrator, {-1, 0}) == HUGE_VAL; }

// Portable: the same bits in any number of lanes, and on every processor.
CodegenOptions of_sweep(const SceneSweep& sweep, CodegenOptions options) {
  options.functions = Functions::kPortable;
  options.order = Order::kValue;
  if (needs_newton(sweep.scene)) options.lanes = Lanes::kNone;  // one after the other anyway
  return options;
}

// What the motors are told over a step from `t`.
VectorXd commands_at(const SceneSweep& sweep, const SampleStart& start, double t) {
  if (start.u.cols() == 1) return start.u.col(0);
  return Commands{sweep.scene.commands.t, start.u}.at(t + sweep.scene.step / 2, {});
}

void try_halves(SweptFunctions& f, const SampleMotion& motion, double t, const VectorXd& u, HalfSteps& halves,
                const VectorXd& whole) {
  const double h = f.sweep.scene.step;
  VectorXd half(motion.x.size()), twice(motion.x.size());
  const double* p = motion.start.p.data();
  if (!f.stepper.step(t, h / 2, motion.x.data(), u.data(), p, half.data())) return;
  if (!f.stepper.step(t + h / 2, h / 2, half.data(), u.data(), p, twice.data())) return;
  halves.note(f.sweep.scene, {motion.steps, motion.x}, whole, twice);
}

}  // namespace

void HalfSteps::note(const Scene& scene, Look look, const VectorXd& whole, const VectorXd& twice) {
  const int nq = scene.robot.model.nq, nv = scene.robot.model.nv;
  const VectorXd error = (twice - whole).segment(nq, nv).cwiseAbs();
  const VectorXd change = (twice - look.x).segment(nq, nv).cwiseAbs();
  if (!error.allFinite() || !change.allFinite()) return;
  most_ = looks_.empty() ? change : VectorXd(most_.cwiseMax(change));
  errors_.push_back(error);
  looks_.push_back(std::move(look));
}

std::string HalfSteps::doubt(const SceneSweep& sweep, long row) const {
  if (looks_.empty()) return "";
  const std::string halves = doubt_of_half_steps(errors_, most_);
  if (!halves.empty() || needs_newton(sweep.scene)) return halves;
  const Eigen::ArrayXd scale = most_.array() + 1e-12;
  std::size_t worst = 0;
  double farthest = -1;
  for (std::size_t k = 0; k < errors_.size(); ++k) {
    const double away = (errors_[k].array() / scale).maxCoeff();
    if (away > farthest) farthest = away, worst = k;
  }
  const Scene scene = scene_of(sweep, row);
  std::string stiff = doubt_at(scene, looks_.front());
  if (stiff.empty() && worst > 0) stiff = doubt_at(scene, looks_[worst]);
  return stiff;
}

SweptFunctions::SweptFunctions(const SceneSweep& all, const CodegenOptions& options)
    : sweep(all),
      stepper(system_of(all.scene.robot, parameters_of(all), edit_of(all)), all.scene.integrator,
              of_sweep(all, options), false, 1, all.scene.tolerances),
      energy(CompiledFunction::make(record_swept_energy(all, stepper), of_sweep(all, options))),
      of_energy(energy),
      is_implicit(needs_newton(all.scene)),
      has_table(all.scene.commands.t.size() > 1),
      look_stride(1 + all.scene.steps() / 64),
      arguments_(VectorXd::Zero(2 + stepper.n_u() + stepper.n_p())) {}

SweptFunctions::SweptFunctions(const SweptFunctions& other, Stepper twin)
    : sweep(other.sweep),
      stepper(std::move(twin)),
      energy(other.energy),
      of_energy(energy),
      is_implicit(other.is_implicit),
      has_table(other.has_table),
      look_stride(other.look_stride),
      arguments_(other.arguments_) {}

SweptFunctions SweptFunctions::twin() const { return {*this, stepper.twin()}; }

SweptFunctions::Energies SweptFunctions::energies(const SampleMotion& at) {
  double y[2];
  arguments_.tail(at.start.p.size()) = at.start.p;
  (void)energy.run(Order::kValue, {.x = at.x.data(), .p = arguments_.data(), .y = y}, of_energy);
  return {y[0], y[1]};
}

bool is_look(const SweptFunctions& functions, long step) { return step % functions.look_stride == 0; }
bool is_sample_time(const Scene& scene, long step) {
  return step % scene.stride() == 0 || step == scene.steps();
}

SampleMotion begin_of(SweptFunctions& f, long row) {
  SampleMotion motion{start_of(f.sweep, values_of(f.sweep, row)), row, 0, {}, {}, {}};
  motion.x = motion.start.x;
  const int nq = f.sweep.scene.robot.model.nq, nv = f.sweep.scene.robot.model.nv;
  motion.extremes = {motion.x.segment(nq, nv).cwiseAbs().maxCoeff(), f.energies(motion).all()};
  return motion;
}

void advance(SweptFunctions& f, SampleMotion& motion, long step, HalfSteps* halves) {
  const Scene& scene = f.sweep.scene;
  const int nq = scene.robot.model.nq, nv = scene.robot.model.nv;
  VectorXd next(motion.x.size());
  while (motion.steps < step) {
    const double t = double(motion.steps) * scene.step;
    const VectorXd u = commands_at(f.sweep, motion.start, t);
    std::string why;
    if (!f.stepper.step(t, scene.step, motion.x.data(), u.data(), motion.start.p.data(), next.data(), &why)) {
      const std::string stiff =
          stability_trouble(scene_of(f.sweep, motion.row), motion.x.head(nq), motion.x.segment(nq, nv));
      motion.trouble = at_time(t) + (stiff.empty() ? why : stiff);
      return;
    }
    if (halves && is_look(f, motion.steps)) try_halves(f, motion, t, u, *halves, next);
    motion.x.swap(next);
    ++motion.steps;
    motion.extremes.v = std::max(motion.extremes.v, motion.x.segment(nq, nv).cwiseAbs().maxCoeff());
    if (is_sample_time(scene, motion.steps))
      motion.extremes.energy = std::max(motion.extremes.energy, f.energies(motion).all());
  }
}

}  // namespace dyntape
