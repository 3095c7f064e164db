// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/sweep/sample_motion.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include <dyntape/interface/run/simulate/stability.h>
#include <dyntape/interface/run/simulate/step_work.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

bool needs_newton(const Scene& scene) { return longest_step(scene.integrator, {-1, 0}) == HUGE_VAL; }

// Portable: the same bits in any number of lanes, and on every processor.
CodegenOptions of_sweep(const SceneSweep& sweep, CodegenOptions options) {
  options.functions = Functions::kPortable;
  options.order = Order::kValue;
  if (needs_newton(sweep.scene)) options.lanes = Lanes::kNone;  // one after the other anyway
  return options;
}

}  // namespace

VectorXd commands_at(const SceneSweep& sweep, const SampleStart& start, double t) {
  if (start.u.cols() == 1) return start.u.col(0);
  return Commands{sweep.scene.commands.t, start.u}.at(t + sweep.scene.step / 2, {});
}

SweptFunctions::SweptFunctions(const SceneSweep& all, const CodegenOptions& options)
    : sweep(all),
      stepper(system_of(all.scene.robot, parameters_of(all), edit_of(all)), all.scene.integrator,
              of_sweep(all, options), false, 1, all.scene.tolerances),
      meter(all.scene.robot, of_sweep(all, options), parameters_of(all), edit_of(all)),
      is_implicit(needs_newton(all.scene)),
      has_table(all.scene.commands.t.size() > 1) {}

SweptFunctions::SweptFunctions(const SweptFunctions& other, Stepper twin)
    : sweep(other.sweep),
      stepper(std::move(twin)),
      meter(other.meter),
      is_implicit(other.is_implicit),
      has_table(other.has_table) {}

SweptFunctions SweptFunctions::twin() const { return {*this, stepper.twin()}; }

SampleJudge::SampleJudge(SweptFunctions& f, const SampleMotion& motion)
    : account(f.sweep.scene, f.meter.layout()) {
  account.start(f.meter.at(motion.x, commands_at(f.sweep, motion.start, 0), motion.start.p));
}

std::string SampleJudge::warning(const SceneSweep& sweep, long row) {
  std::string of_steps;
  if (!needs_newton(sweep.scene) && !halves.looks().empty())  // or no motion is too stiff
    of_steps = doubt_of_stiffness(scene_of(sweep, row), halves.looks());
  if (of_steps.empty()) of_steps = halves.warning();
  return of_steps.empty() ? doubt_of_energy(account.finish()) : of_steps;
}

SampleMotion begin_of(SweptFunctions& f, long row) {
  SampleMotion motion{start_of(f.sweep, values_of(f.sweep, row)), row, 0, {}, {}, {}};
  motion.x = motion.start.x;
  const int nq = f.sweep.scene.robot.model.nq, nv = f.sweep.scene.robot.model.nv;
  const Energy& energy = f.meter.at(motion.x, motion.start.u.col(0), motion.start.p);
  motion.extremes = {motion.x.segment(nq, nv).cwiseAbs().maxCoeff(), energy.kinetic + energy.stored};
  return motion;
}

void advance(SweptFunctions& f, SampleMotion& motion, long step, SampleJudge* judge) {
  const Scene& scene = f.sweep.scene;
  const VectorXd& p = motion.start.p;
  const int nq = scene.robot.model.nq, nv = scene.robot.model.nv;
  std::optional<MotionWork> work;
  if (judge) work.emplace(scene, f.meter, f.stepper);
  VectorXd next(motion.x.size());
  const auto tries_halves = [&] {
    return judge && is_look(scene, motion.steps) && !is_adaptive(scene.integrator);
  };
  while (motion.steps < step) {
    const double t = double(motion.steps) * scene.step;
    const VectorXd u = commands_at(f.sweep, motion.start, t);
    if (work) work->before_step(u, p);
    std::string why;
    const bool done = f.stepper.step(t, scene.step, motion.x.data(), u.data(), p.data(), next.data(), &why);
    if (!done || !(next.squaredNorm() < kBeyond)) {
      motion.trouble = trouble_of_step(scene_of(f.sweep, motion.row), t, motion.x, done ? kUnbounded : why);
      return;
    }
    if (tries_halves()) judge->halves.try_at(scene, f.stepper, {motion.steps, motion.x}, u, p, next);
    const Eigen::MatrixXd of_step = work ? work->after_step(t, motion.x, next) : Eigen::MatrixXd();
    motion.x.swap(next);
    ++motion.steps;
    const bool is_sample = scene.is_sample(motion.steps);
    motion.extremes.v = std::max(motion.extremes.v, motion.x.segment(nq, nv).cwiseAbs().maxCoeff());
    if (!judge && !is_sample) continue;
    const Energy& energy = f.meter.at(motion.x, u, p);
    if (judge) judge->account.add(energy, of_step);
    if (is_sample) motion.extremes.energy = std::max(motion.extremes.energy, energy.kinetic + energy.stored);
  }
  // The last place where half steps are tried, of which the whole one is made for that alone.
  if (motion.steps < scene.steps() || !tries_halves()) return;
  const double end = double(motion.steps) * scene.step;
  const VectorXd u = commands_at(f.sweep, motion.start, end);
  if (f.stepper.step(end, scene.step, motion.x.data(), u.data(), p.data(), next.data()))
    judge->halves.try_at(scene, f.stepper, {motion.steps, motion.x}, u, p, next);
}

}  // namespace dyntape
