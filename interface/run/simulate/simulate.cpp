// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/simulate.h>

#include <algorithm>
#include <chrono>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/check_forward_dynamics.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/stopwatch.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/run/simulate/accuracy_warnings.h>
#include <dyntape/interface/run/simulate/rigid_account.h>
#include <dyntape/interface/run/simulate/scene_stepper.h>
#include <dyntape/interface/run/simulate/stability.h>
#include <dyntape/interface/system/assembly.h>

namespace dyntape {

namespace {

using Clock = std::chrono::steady_clock;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// How functions are made, seen and stopped from outside.
CodegenOptions watched(const Scene& scene, const SimulationWatch& watch) {
  CodegenOptions options = scene.evaluation;
  options.stop = watch.stop;
  options.compiled_piece = [tell = watch.tell](std::size_t done, std::size_t of) {
    if (tell) tell("compiling: " + std::to_string(done) + " of " + std::to_string(of) + " pieces");
  };
  return options;
}

// How far rigid contacts and stops may be passed: a thousandth of the robot's length, of joints that turn 1e-3 rad.
VectorXd most_penetrations(const RobotScene& scene) {
  constexpr double kShare = 1e-3;
  double length = 0, reach = 0;
  for (const auto& placement : scene.model.X_PJ) length += placement.p.norm();
  for (const auto& contact : scene.constraints.rigid.contacts)
    reach = std::max(reach, contact.X_BF.p.norm() + contact.radius);
  VectorXd most = VectorXd::Constant(Eigen::Index(scene.constraints.rigid.size()), kShare * (length + reach));
  Eigen::Index row = Eigen::Index(scene.constraints.rigid.contacts.size());
  for (const auto& stop : scene.constraints.rigid.stops) {
    for (const auto& joint : scene.model.joints) {
      if (joint.idx_v == stop.idx_v && dynamics::traits(joint.type).has_angle) most[row] = kShare;
    }
    ++row;
  }
  return most;
}

// One run of a scene: the state that moves, and what is noted of it.
class SceneRun {
 public:
  SceneRun(const Scene& scene, const SimulationWatch& watch)
      : scene_(scene),
        watch_(watch),
        steps_(scene, watched(scene, watch)),
        meter_(scene.robot, watched(scene, watch)),
        account_(scene, meter_.layout(), [this](const MatrixXd& work) { note_work(work); }) {
    const SceneStart start = start_of(scene);
    motion_.assembled_by = start.assembled_by, motion_.slowed_by = start.slowed_by;
    x_ = next_ = start.x;
    steps_.start(x_);
    for (const std::string& name : meter_.layout().flows) motion_.flows.push_back({name, {}, {}});
    if (!steps_.rigid) {
      work_.emplace(scene, meter_, steps_.stepper);
      return;
    }
    of_rigid_.emplace(scene, meter_);
    most_penetrations_ = most_penetrations(scene.robot);
    for (const std::string& name : RigidAccount::names(scene.robot.constraints))
      motion_.flows.push_back({name, {}, {}});
  }

  SimulatedMotion result() {
    const auto begin = Clock::now();
    const long steps = scene_.steps();
    note(0);
    while (motion_.steps < steps && goes_on(motion_.steps, steps) && step()) note(motion_.steps);
    motion_.balances = account_.finish();
    if (of_rigid_) motion_.impacts = of_rigid_->impacts();
    motion_.step_seconds = seconds_since(begin);
    motion_.warning = steps_.rigid ? steps_.rigid->undecided() : "";
    if (motion_.warning.empty()) motion_.warning = penetration_;
    if (motion_.warning.empty()) motion_.warning = doubt_of_steps(scene_, steps_.stepper, looks_);
    motion_.operations = steps_.stepper.report().step_operations;
    motion_.sources = steps_.stepper.report().sources;
    join_columns();
    return std::move(motion_);
  }

 private:
  bool goes_on(long k, long steps) {
    const long often = is_adaptive(scene_.integrator) ? 16 : 1024;
    if (k % often != 0) return true;
    motion_.was_stopped = watch_.stop.stop_requested();
    if (watch_.tell) {
      watch_.tell("t = " + io::with_digits(double(k) * scene_.step, 4) + " of " +
                  io::with_digits(double(steps) * scene_.step, 4) + " s");
    }
    return !motion_.was_stopped;
  }

  bool step() {
    const double t = double(motion_.steps) * scene_.step;
    const VectorXd u = scene_.commands.at(t + scene_.step / 2, x_);
    std::string why;
    if (work_) work_->before_step(u);
    const bool done = steps_.step(t, scene_.step, x_, u, next_, &why);
    motion_.effort += steps_.stepper.effort();
    if (done && next_.squaredNorm() < kBeyond) {
      if (of_rigid_) of_rigid_->add(*steps_.rigid, u, scene_.step);
      if (work_) of_step_ = work_->after_step(t, x_, next_);
      x_.swap(next_);
      ++motion_.steps;
      return true;
    }
    motion_.was_stopped = watch_.stop.stop_requested();
    if (!motion_.was_stopped) motion_.trouble = trouble_of_step(scene_, t, x_, done ? kUnbounded : why);
    return false;
  }

  void note(long k) {
    const double t = double(k) * scene_.step;
    const VectorXd u = scene_.commands.at(t, x_);
    const Energy& energy = meter_.at(x_, u);
    if (is_look(scene_, k)) looks_.push_back({k, x_, steps_.rigid ? steps_.rigid->forces() : VectorXd()});
    note_sample(k, t, u, energy);
    if (of_rigid_) {
      note_penetration(t);
      return account_.reach(energy, of_rigid_->work());
    }
    if (k == 0) return account_.start(energy);
    account_.add(energy, of_step_);
  }

  void note_sample(long k, double t, const VectorXd& u, const Energy& energy) {
    if (!scene_.is_sample(k)) return;
    motion_.t.push_back(t);
    motion_.kinetic.push_back(energy.kinetic);
    motion_.stored.push_back(energy.stored);
    motion_.loop_error =
        std::max(motion_.loop_error, loop_error(scene_.robot, x_.head(scene_.robot.model.nq)));
    states_.push_back(x_);
    drives_.push_back(drive_in(scene_, x_, u));
    const VectorXd powers = energy.power.rowwise().sum();
    for (Eigen::Index i = 0; i < powers.size(); ++i) motion_.flows[std::size_t(i)].power.push_back(powers[i]);
    if (!of_rigid_) return;
    reactions_.push_back(of_rigid_->reactions());
  }

  void note_penetration(double t) {
    const VectorXd& gap = steps_.rigid->functions().near(x_).gap;
    motion_.deepest = std::max(motion_.deepest, -gap.minCoeff());
    const auto& rigid = scene_.robot.constraints.rigid;
    for (Eigen::Index i = 0; i < gap.size() && penetration_.empty(); ++i) {
      if (!(-gap[i] > most_penetrations_[i])) continue;
      const bool is_contact = std::size_t(i) < rigid.contacts.size();
      penetration_ = "at t = " + io::with_digits(t, 6) + " s " +
                     (is_contact ? "the contact at '" : "joint '") + rigid.name(std::size_t(i)) + "' is " +
                     io::with_digits(-gap[i], 2) +
                     (is_contact ? " m below its ground" : " beyond its limit") + ", more than " +
                     io::with_digits(most_penetrations_[i], 2) + "; take shorter steps";
    }
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
  SceneStepper steps_;
  EnergyMeter meter_;
  EnergyAccount account_;
  std::optional<MotionWork> work_;        // without,
  std::optional<RigidAccount> of_rigid_;  // and with rigid contacts or stops
  VectorXd x_, next_;
  MatrixXd of_step_;  // J
  VectorXd most_penetrations_;
  std::string penetration_;  // the first that was beyond them
  long worked_ = 0;          // steps whose work is known
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

void check_start(const Scene& scene) {
  if (!scene.q.allFinite() || !scene.v.allFinite())
    throw ArgumentError("scene \"" + scene.name + "\": the state at the start is not finite");
  dynamics::check_forward_dynamics(scene.robot.model, scene.robot.effects.acting());
  const std::string trouble = stability_trouble(scene, scene.q, scene.v);
  if (!trouble.empty()) throw ArgumentError("scene \"" + scene.name + "\", at the start: " + trouble);
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
