// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/sweep/sample_motion.h>

#include <algorithm>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/interface/run/simulate/accuracy_warnings.h>
#include <dyntape/interface/run/simulate/stability.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

// Motors with a lag have a state of their own.
Function record_swept_energy(const SceneSweep& sweep, const Stepper& stepper, EnergyLayout& layout) {
  const RobotScene& robot = sweep.scene.robot;
  const int nq = robot.model.nq, nv = robot.model.nv, n_u = stepper.n_u(), n_p = stepper.n_p();
  const SceneEdit edit = edit_of(sweep);
  return record(robot.model.name + " energies", std::size_t(stepper.nx()), std::size_t(2 + n_u + n_p),
                [&](const VectorXad& x, const VectorXad& arguments) {
                  RecordedScene scene = recorded(robot);
                  edit(scene, arguments.tail(n_p));
                  VectorXad drive = arguments.segment(2, n_u);
                  for (Eigen::Index k = 0, m = nq + nv; k < robot.lag.size(); ++k) {
                    if (robot.lag[k] > 0) drive[k] = x[m++];
                  }
                  return record_energies(robot, scene.model, scene.effects, x.head(nq), x.segment(nq, nv),
                                         torques_at(actuated_dofs(robot), drive, nv), layout);
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

void try_halves(SweptFunctions& f, const SampleMotion& motion, double t, const VectorXd& u, HalfSteps& halves,
                const VectorXd& whole) {
  const double h = f.sweep.scene.step;
  VectorXd half(motion.x.size()), twice(motion.x.size());
  const double* p = motion.start.p.data();
  if (!f.stepper.step(t, h / 2, motion.x.data(), u.data(), p, half.data())) return;
  if (!f.stepper.step(t + h / 2, h / 2, half.data(), u.data(), p, twice.data())) return;
  halves.note(f.sweep.scene, {motion.steps, motion.x}, whole, twice);
}

struct Unwatched {
  Stepper& stepper;
  ~Unwatched() { stepper.watch({}); }
};

// The work of a step that was made, where it is not that of neighbouring steps.
Eigen::MatrixXd work_of_step(SweptFunctions& f, const SampleMotion& motion, double t, const VectorXd& u,
                             const VectorXd& next) {
  const double h = f.sweep.scene.step;
  VectorXd middle(motion.x.size());
  if (!f.stepper.step(t, h / 2, motion.x.data(), u.data(), motion.start.p.data(), middle.data()))
    middle = next;
  Eigen::MatrixXd work = f.energies(motion, motion.x, u).power;
  work += 4 * f.energies(motion, middle, u).power;
  work += f.energies(motion, next, u).power;
  return h / 6 * work;
}

}  // namespace

VectorXd commands_at(const SceneSweep& sweep, const SampleStart& start, double t) {
  if (start.u.cols() == 1) return start.u.col(0);
  return Commands{sweep.scene.commands.t, start.u}.at(t + sweep.scene.step / 2, {});
}

void HalfSteps::note(const Scene& scene, Look look, const VectorXd& whole, const VectorXd& twice) {
  const int nq = scene.robot.model.nq, nv = scene.robot.model.nv;
  const VectorXd error = (twice - whole).segment(nq, nv).cwiseAbs();
  const VectorXd change = (twice - look.x).segment(nq, nv).cwiseAbs();
  looks_.push_back(std::move(look));
  if (!error.allFinite() || !change.allFinite()) return;
  most_ = errors_.empty() ? change : VectorXd(most_.cwiseMax(change));
  errors_.push_back(error);
}

std::string HalfSteps::warning(const SceneSweep& sweep, long row) const {
  if (looks_.empty() || is_adaptive(sweep.scene.integrator)) return "";
  if (!needs_newton(sweep.scene)) {  // or no motion is too stiff
    const Scene scene = scene_of(sweep, row);
    for (const Look& look : looks_) {
      if (std::string stiff = doubt_at(scene, look); !stiff.empty()) return stiff;
    }
  }
  return errors_.empty() ? "" : doubt_of_half_steps(errors_, most_);
}

SweptFunctions::SweptFunctions(const SceneSweep& all, const CodegenOptions& options)
    : sweep(all),
      stepper(system_of(all.scene.robot, parameters_of(all), edit_of(all)), all.scene.integrator,
              of_sweep(all, options), false, 1, all.scene.tolerances),
      energy(CompiledFunction::make(record_swept_energy(all, stepper, layout), of_sweep(all, options))),
      of_energy(energy),
      is_implicit(needs_newton(all.scene)),
      has_table(all.scene.commands.t.size() > 1),
      look_stride(1 + all.scene.steps() / 64),
      arguments_(VectorXd::Zero(2 + stepper.n_u() + stepper.n_p())),
      output_(layout.size()) {}

SweptFunctions::SweptFunctions(const SweptFunctions& other, Stepper twin)
    : sweep(other.sweep),
      stepper(std::move(twin)),
      layout(other.layout),
      energy(other.energy),
      of_energy(energy),
      is_implicit(other.is_implicit),
      has_table(other.has_table),
      look_stride(other.look_stride),
      arguments_(other.arguments_),
      output_(other.output_) {}

SweptFunctions SweptFunctions::twin() const { return {*this, stepper.twin()}; }

const Energy& SweptFunctions::energies(const SampleMotion& of, const VectorXd& x, const VectorXd& u) {
  arguments_.segment(2, u.size()) = u;
  arguments_.tail(of.start.p.size()) = of.start.p;
  (void)energy.run(Order::kValue, {.x = x.data(), .p = arguments_.data(), .y = output_.data()}, of_energy);
  layout.read(output_.data(), 1, energy_);
  return energy_;
}

SampleJudge::SampleJudge(SweptFunctions& f, const SampleMotion& motion) : balance(f.sweep.scene, f.layout) {
  balance.start(f.energies(motion, motion.x, commands_at(f.sweep, motion.start, 0)));
}

std::string SampleJudge::warning(const SceneSweep& sweep, long row) {
  const std::string of_steps = halves.warning(sweep, row);
  return of_steps.empty() ? balance.warning() : of_steps;
}

bool is_look(const SweptFunctions& functions, long step) { return step % functions.look_stride == 0; }
bool is_sample_time(const Scene& scene, long step) {
  return step % scene.stride() == 0 || step == scene.steps();
}

SampleMotion begin_of(SweptFunctions& f, long row) {
  SampleMotion motion{start_of(f.sweep, values_of(f.sweep, row)), row, 0, {}, {}, {}};
  motion.x = motion.start.x;
  const int nq = f.sweep.scene.robot.model.nq, nv = f.sweep.scene.robot.model.nv;
  const Energy& energy = f.energies(motion, motion.x, motion.start.u.col(0));
  motion.extremes = {motion.x.segment(nq, nv).cwiseAbs().maxCoeff(), energy.kinetic + energy.stored};
  return motion;
}

void advance(SweptFunctions& f, SampleMotion& motion, long step, SampleJudge* judge) {
  const Unwatched unwatched{f.stepper};
  const Scene& scene = f.sweep.scene;
  const int nq = scene.robot.model.nq, nv = scene.robot.model.nv;
  const WorkRule rule = work_rule(scene);
  VectorXd next(motion.x.size()), u;
  Eigen::MatrixXd work;
  if (judge && rule == WorkRule::kGauss) {
    f.stepper.watch([&](const double* x, double weight) {
      work += weight * f.energies(motion, Eigen::Map<const VectorXd>(x, motion.x.size()), u).power;
    });
  }
  while (motion.steps < step) {
    const double t = double(motion.steps) * scene.step;
    u = commands_at(f.sweep, motion.start, t);
    work.setZero(Eigen::Index(f.layout.flows.size()) + 1, Eigen::Index(f.layout.mechanisms.size()));
    std::string why;
    const bool done =
        f.stepper.step(t, scene.step, motion.x.data(), u.data(), motion.start.p.data(), next.data(), &why);
    if (done && !(next.squaredNorm() < kBeyond)) why = kUnbounded;
    if (!done || !(next.squaredNorm() < kBeyond)) {
      const std::string stiff =
          stability_trouble(scene_of(f.sweep, motion.row), motion.x.head(nq), motion.x.segment(nq, nv));
      motion.trouble = at_time(t) + (stiff.empty() ? why : stiff);
      return;
    }
    if (judge && rule == WorkRule::kSimpson) work = work_of_step(f, motion, t, u, next);
    if (judge && is_look(f, motion.steps) && !is_adaptive(scene.integrator))
      try_halves(f, motion, t, u, judge->halves, next);
    motion.x.swap(next);
    ++motion.steps;
    const bool is_sample = is_sample_time(scene, motion.steps);
    if (judge || is_sample) f.energies(motion, motion.x, u);
    const Energy& energy = f.latest();
    if (judge && rule == WorkRule::kCubic) judge->balance.step(energy);
    if (judge && rule != WorkRule::kCubic) judge->balance.step(energy, work);
    motion.extremes.v = std::max(motion.extremes.v, motion.x.segment(nq, nv).cwiseAbs().maxCoeff());
    if (is_sample) motion.extremes.energy = std::max(motion.extremes.energy, energy.kinetic + energy.stored);
  }
  // The last place where half steps are tried, of which the whole one is made for that alone.
  if (!judge || motion.steps < scene.steps() || !is_look(f, motion.steps) || is_adaptive(scene.integrator))
    return;
  const double end = double(motion.steps) * scene.step;
  u = commands_at(f.sweep, motion.start, end);
  if (f.stepper.step(end, scene.step, motion.x.data(), u.data(), motion.start.p.data(), next.data()))
    try_halves(f, motion, end, u, judge->halves, next);
}

}  // namespace dyntape
