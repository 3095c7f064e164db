// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/sweep/sample_motion.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/run/simulate/motion_account.h>
#include <dyntape/interface/run/simulate/stability.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

bool needs_newton(const Scene& scene) { return longest_step(scene.integrator, {-1, 0}) == HUGE_VAL; }

// Portable: the same bits in any number of lanes, and on every processor.
CodegenOptions of_sweep(const SceneSweep& sweep, CodegenOptions options) {
  options.functions = Functions::kPortable;
  options.order = Order::kValue;
  if (!moves_in_lanes(sweep.scene)) options.lanes = Lanes::kNone;  // one after the other anyway
  return options;
}

// Observes a sample: extremes, half steps, and whether somebody stops it.
class SampleWatch {
 public:
  SampleWatch(SweptFunctions& f, SampleMotion& motion, SampleJudge* judge, const std::stop_token& stop)
      : f_(f), scene_(f.sweep.scene), motion_(motion), judge_(judge), stop_(stop) {}

  bool goes_on(const StepTime& s) {
    constexpr long kOften = 256;
    is_stopped_ = s.k % kOften == 0 && stop_.stop_requested();
    return !is_stopped_;
  }

  // With rigid contacts the steps that are compared have the forces at their beginning.
  void before(const StepTime& s, const VectorXd& u) {
    u_ = u;
    if (f_.motion->rigid() && tries_halves(s.k)) compare_free_steps(s, u);
  }

  void after(const StepTime& s, const VectorXd& u) {
    if (!f_.motion->rigid() && tries_halves(s.k))
      judge_->halves.try_at(scene_, f_.stepper, {s.k, f_.motion->x()}, u, f_.motion->p(), f_.motion->next());
  }

  void reached(long k) {
    const int nq = scene_.robot.model.nq, nv = scene_.robot.model.nv;
    const VectorXd& x = f_.motion->x();
    motion_.extremes.v = std::max(motion_.extremes.v, x.segment(nq, nv).cwiseAbs().maxCoeff());
    if (!scene_.is_sample(k)) return;
    const Energy& energy = judge_ ? f_.meter.latest() : f_.meter.at(x, u_, f_.motion->p());
    motion_.extremes.energy = std::max(motion_.extremes.energy, energy.kinetic + energy.stored);
  }

  // The last place where half steps are tried, of which the whole one is made for that alone.
  void look_behind_the_end(const StepTime& s, const VectorXd& u) {
    if (tries_halves(s.k)) compare_free_steps(s, u);
  }

  bool is_stopped() const { return is_stopped_; }

 private:
  bool tries_halves(long k) const { return judge_ && is_look(scene_, k) && !is_adaptive(scene_.integrator); }

  void compare_free_steps(const StepTime& s, const VectorXd& u) {
    const VectorXd p = f_.motion->parameters(), &x = f_.motion->x();
    VectorXd whole(x.size());
    if (f_.stepper.step(s.t, s.h, x.data(), u.data(), p.data(), whole.data()))
      judge_->halves.try_at(scene_, f_.stepper, {s.k, x}, u, p, whole);
  }

  SweptFunctions& f_;
  const Scene& scene_;
  SampleMotion& motion_;
  SampleJudge* judge_;
  const std::stop_token& stop_;
  VectorXd u_;
  bool is_stopped_ = false;
};

}  // namespace

bool moves_in_lanes(const Scene& scene) {
  return !needs_newton(scene) && scene.robot.constraints.rigid.empty();
}

VectorXd commands_at(const SceneSweep& sweep, const SampleStart& start, double t) {
  if (start.u.cols() == 1) return start.u.col(0);
  return Commands{sweep.scene.commands.t, start.u}.at(t + sweep.scene.step / 2, {});
}

SweptFunctions::SweptFunctions(const SceneSweep& all, const CodegenOptions& options)
    : sweep(all),
      motion(std::make_unique<RobotStepper>(all.scene.robot, all.scene.integrator, of_sweep(all, options),
                                            all.scene.tolerances, parameters_of(all), edit_of(all))),
      stepper(motion->stepper()),
      meter(all.scene.robot, of_sweep(all, options), parameters_of(all), edit_of(all)),
      is_in_lanes(moves_in_lanes(all.scene)),
      has_table(all.scene.commands.t.size() > 1) {}

SweptFunctions::SweptFunctions(const SweptFunctions& other, std::unique_ptr<RobotStepper> twin)
    : sweep(other.sweep),
      motion(std::move(twin)),
      stepper(motion->stepper()),
      meter(other.meter),
      is_in_lanes(other.is_in_lanes),
      has_table(other.has_table) {}

std::unique_ptr<SweptFunctions> SweptFunctions::twin() const {
  return std::unique_ptr<SweptFunctions>(new SweptFunctions(*this, motion->twin()));
}

SampleJudge::SampleJudge(const SweptFunctions& f) : account(f.sweep.scene, f.meter.layout()) {}

std::string SampleJudge::warning(const SceneSweep& sweep, long row) {
  std::string of_steps = of_contacts;
  if (of_steps.empty() && !needs_newton(sweep.scene) && !halves.looks().empty())  // or no motion is too stiff
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

bool advance(SweptFunctions& f, SampleMotion& sample, long step, SampleJudge* judge,
             const std::stop_token& stop) {
  const Scene& scene = f.sweep.scene;
  RobotStepper& motion = *f.motion;
  try {
    motion.start(sample.x, sample.start.p);
  } catch (const ArgumentError& e) {
    sample.trouble = "at the start: " + std::string(e.what());
    return true;
  }
  const StepRange range{.from = sample.steps, .to = step, .h = scene.step};
  const auto commands = [&](const StepTime& s) { return commands_at(f.sweep, sample.start, s.t); };
  SampleWatch watch(f, sample, judge, stop);
  if (judge) {
    const Scene own = motion.rigid() ? scene_of(f.sweep, sample.row) : Scene{};
    MotionAccount account(scene, f.meter, motion, judge->account);
    PenetrationCheck depth(own.robot, motion, scene.step);
    account.start(commands_at(f.sweep, sample.start, 0));
    depth.reached(0);
    sample.steps = run(motion, range, commands, account, depth, watch);
    if (motion.rigid()) judge->of_contacts = motion.rigid()->undecided();
    if (judge->of_contacts.empty()) judge->of_contacts = depth.warning();
  } else {
    sample.steps = run(motion, range, commands, watch);
  }
  sample.x = motion.x();
  if (watch.is_stopped()) return false;
  const StepTime end = range.at(sample.steps);
  if (sample.steps < step)
    sample.trouble = trouble_of_step(scene_of(f.sweep, sample.row), end.t, sample.x, motion.why());
  else if (step == scene.steps())
    watch.look_behind_the_end(end, commands(end));
  return true;
}

}  // namespace dyntape
