// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/simulate.h>

#include <algorithm>
#include <chrono>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/check_forward_dynamics.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/stopwatch.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/run/simulate/accuracy_warnings.h>
#include <dyntape/interface/run/simulate/motion_account.h>
#include <dyntape/interface/run/simulate/scene_start.h>
#include <dyntape/interface/run/simulate/stability.h>
#include <dyntape/interface/system/assembly.h>

namespace dyntape {

namespace {

using Clock = std::chrono::steady_clock;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The beginning of a message about a key of the scene's file.
std::string told_of(const Scene& scene, const std::string& key) {
  return scene.places.at(key, "scene \"" + scene.name + "\"") + ": ";
}

// How functions are made, seen and stopped from outside.
CodegenOptions watched(const Scene& scene, const SimulationWatch& watch) {
  CodegenOptions options = scene.evaluation;
  options.stop = watch.stop;
  options.compiled_piece = [tell = watch.tell](std::size_t done, std::size_t of) {
    if (tell) tell("compiling: " + std::to_string(done) + " of " + std::to_string(of) + " pieces");
  };
  return options;
}

// One run of a scene, and an observer of it: samples, places where the steps are checked, progress.
class SceneRun {
 public:
  SceneRun(const Scene& scene, const SimulationWatch& watch)
      : scene_(scene),
        watch_(watch),
        steps_(stepper_of(scene, watched(scene, watch))),
        meter_(scene.robot, watched(scene, watch)),
        account_(scene, meter_.layout(), [this](const MatrixXd& work) { note_work(work); }),
        of_motion_(scene, meter_, steps_, account_),
        depth_(scene.robot, steps_, scene.step) {
    const SceneStart start = start_of(scene);
    motion_.assembled_by = start.assembled_by, motion_.slowed_by = start.slowed_by;
    try {
      steps_.start(start.x);
    } catch (const ArgumentError& e) {
      throw ArgumentError(told_of(scene, "start") + e.what());
    }
    for (const std::string& name : meter_.layout().flows) motion_.flows.push_back({name, {}, {}});
    if (!steps_.rigid()) return;
    for (const std::string& name : RigidAccount::names(scene.robot.constraints))
      motion_.flows.push_back({name, {}, {}});
  }

  SimulatedMotion result() {
    const auto begin = Clock::now();
    if (watch_.begin) watch_.begin();
    of_motion_.start(scene_.commands.at(0, steps_.x()));
    depth_.reached(0), reached(0);
    const auto commands = [this](const StepTime& s) { return scene_.commands.at(s.t + s.h / 2, steps_.x()); };
    const StepRange range{.to = scene_.steps(), .h = scene_.step};
    motion_.steps = run(steps_, range, commands, *this, of_motion_, depth_);
    if (motion_.steps < range.to) note_end(range.at(motion_.steps).t);
    motion_.balances = account_.finish();
    motion_.deepest = depth_.deepest();
    if (of_motion_.rigid()) motion_.impacts = of_motion_.rigid()->impacts();
    motion_.step_seconds = seconds_since(begin);
    motion_.warning = steps_.rigid() ? steps_.rigid()->undecided() : "";
    if (motion_.warning.empty()) motion_.warning = depth_.warning();
    if (motion_.warning.empty() && !motion_.was_stopped)
      motion_.warning = doubt_of_steps(scene_, steps_.stepper(), looks_);
    motion_.operations = steps_.stepper().report().step_operations;
    motion_.sources = steps_.stepper().report().sources;
    join_columns();
    return std::move(motion_);
  }

  bool goes_on(const StepTime& s) {
    motion_.was_stopped = watch_.stop.stop_requested();
    const long often = is_adaptive(scene_.integrator) ? 16 : 1024;
    if (watch_.tell && s.k % often == 0) {
      watch_.tell("t = " + io::with_digits(s.t, 4) + " of " +
                  io::with_digits(double(scene_.steps()) * scene_.step, 4) + " s");
    }
    return !motion_.was_stopped;
  }

  void after(const StepTime&, const VectorXd&) { motion_.effort += steps_.stepper().effort(); }

  void reached(long k) {
    if (is_look(scene_, k))
      looks_.push_back({k, steps_.x(), steps_.rigid() ? steps_.rigid()->forces() : VectorXd()});
    if (scene_.is_sample(k)) note_sample(double(k) * scene_.step, steps_.x());
  }

 private:
  // A step that is not made, unless somebody stopped the run.
  void note_end(double t) {
    if (motion_.was_stopped) return;
    motion_.effort += steps_.stepper().effort();
    motion_.was_stopped = watch_.stop.stop_requested();
    if (!motion_.was_stopped) motion_.trouble = trouble_of_step(scene_, t, steps_.x(), steps_.why());
  }

  void note_sample(double t, const VectorXd& x) {
    const VectorXd u = scene_.commands.at(t, x);
    const Energy& energy = meter_.at(x, u);
    motion_.t.push_back(t);
    motion_.kinetic.push_back(energy.kinetic);
    motion_.stored.push_back(energy.stored);
    motion_.loop_error =
        std::max(motion_.loop_error, loop_error(scene_.robot, x.head(scene_.robot.model.nq)));
    states_.push_back(x);
    drives_.push_back(drive_in(scene_, x, u));
    const VectorXd powers = energy.power.rowwise().sum();
    for (Eigen::Index i = 0; i < powers.size(); ++i) motion_.flows[std::size_t(i)].power.push_back(powers[i]);
    if (of_motion_.rigid()) reactions_.push_back(of_motion_.rigid()->reactions());
  }

  void note_work(const MatrixXd& work) {
    if (!scene_.is_sample(worked_++)) return;
    const VectorXd all = work.rowwise().sum();
    for (std::size_t i = 0; i < motion_.flows.size(); ++i)
      motion_.flows[i].work.push_back(all[Eigen::Index(i)]);
  }

  void join_columns() {
    const int nq = scene_.robot.model.nq, nv = scene_.robot.model.nv;
    const Eigen::Index n = motion_.samples(), n_u = n > 0 ? drives_.front().size() : 0;
    motion_.q.resize(nq, n), motion_.v.resize(nv, n), motion_.drive.resize(n_u, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      motion_.q.col(k) = states_[std::size_t(k)].head(nq);
      motion_.v.col(k) = states_[std::size_t(k)].segment(nq, nv);
      motion_.drive.col(k) = drives_[std::size_t(k)];
    }
    if (reactions_.empty()) return;
    motion_.reactions.resize(reactions_.front().size(), n);
    for (Eigen::Index k = 0; k < n; ++k) motion_.reactions.col(k) = reactions_[std::size_t(k)];
  }

  const Scene& scene_;
  const SimulationWatch& watch_;
  RobotStepper steps_;
  EnergyMeter meter_;
  EnergyAccount account_;
  MotionAccount of_motion_;
  PenetrationCheck depth_;
  long worked_ = 0;  // steps whose work is known
  std::vector<VectorXd> states_, drives_, reactions_;
  std::vector<Look> looks_;
  SimulatedMotion motion_;
};

// Where loops come open by more than a hundredth of the robot's length.
std::string doubt_of_loops(const Scene& scene, const SimulatedMotion& motion) {
  constexpr double kMost = 0.01;
  double length = 0;
  for (const auto& placement : scene.robot.model.X_PJ) length += placement.p.norm();
  if (length == 0 || !(motion.loop_error > kMost * length)) return "";
  return "the loops came open by " + io::significant(motion.loop_error, 2) +
         " m or rad; take shorter steps, or greater stiffness and damping of the loops";
}

}  // namespace

namespace {

// Joints that start beyond their hard limits.
void check_stops(const Scene& scene) {
  constexpr double kGrazes = 1e-6;  // as RigidStepper
  for (const dynamics::HardStop& stop : scene.robot.constraints.rigid.stops) {
    const double q = scene.q[stop.idx_q];
    if (!(stop.sign * (q - stop.limit) < -kGrazes)) continue;
    const auto& model = scene.robot.model;
    const dynamics::Joint<double>& joint = model.joints[std::size_t(model.joint_index(stop.name))];
    const dynamics::MimicRule* rule = rule_of(scene.robot, stop.name);
    const std::string unit = unit_of_state(model, stop.idx_q);
    const auto [lower, upper] = std::pair(joint.limits.lower, joint.limits.upper);
    throw ArgumentError(told_of(scene, "start.q." + (rule ? rule->leader : stop.name)) + "joint '" +
                        stop.name + "'" + (rule ? ", which follows '" + rule->leader + "'," : "") +
                        " starts at " + io::with_digits(q, 6) + unit + ", beyond its hard limit; expected " +
                        io::with_digits(lower, 6) + " to " + io::with_digits(upper, 6) + unit +
                        ", or no 'constraints.limits'" + other_unit(joint, q, lower, upper));
  }
}

}  // namespace

void check_start(const Scene& scene) {
  if (!scene.q.allFinite() || !scene.v.allFinite())
    throw ArgumentError(told_of(scene, "start") + "the state at the start is not finite");
  check_stops(scene);
  if (scene.robot.mimics.empty())  // the inertia of a follower may be that of its leader
    dynamics::check_forward_dynamics(scene.robot.model, scene.robot.effects.acting());
  const std::string trouble = stability_trouble(scene, scene.q, scene.v);
  if (!trouble.empty()) throw ArgumentError(told_of(scene, "simulation.step") + "at the start: " + trouble);
}

SimulatedMotion simulate(const Scene& scene, const SimulationWatch& watch) {
  check_start(scene);
  const auto begin = Clock::now();
  SceneRun run(scene, watch);
  const double build = seconds_since(begin);
  SimulatedMotion motion = run.result();
  motion.build_seconds = build;
  if (motion.warning.empty() && motion.trouble.empty()) motion.warning = doubt_of_loops(scene, motion);
  if (motion.warning.empty() && motion.trouble.empty()) motion.warning = doubt_of_energy(motion.balances);
  return motion;
}

}  // namespace dyntape
