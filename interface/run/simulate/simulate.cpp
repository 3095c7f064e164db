// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/simulate.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/check_forward_dynamics.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/stopwatch.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/run/simulate/accuracy_warnings.h>
#include <dyntape/interface/run/simulate/motion_work.h>
#include <dyntape/interface/run/simulate/rigid_account.h>
#include <dyntape/interface/run/simulate/stability.h>
#include <dyntape/interface/system/assembly.h>
#include <dyntape/interface/system/energy.h>
#include <dyntape/interface/system/scene_system.h>

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

std::vector<std::string> names_of(const std::vector<Mechanism>& mechanisms) {
  std::vector<std::string> names;
  for (const Mechanism& mechanism : mechanisms) names.push_back(mechanism.name);
  return names;
}

// One run of a scene: the state that moves, and what is noted of it.
class SceneRun {
 public:
  SceneRun(const Scene& scene, const SimulationWatch& watch)
      : scene_(scene),
        watch_(watch),
        stepper_(system_of(scene.robot), scene.integrator, watched(scene, watch),
                 !scene.robot.constraints.rigid.empty() && RigidStepper::needs_jacobians(scene.integrator), 1,
                 scene.tolerances),
        energy_(scene.robot, watched(scene, watch)),
        balances_(names_of(energy_.mechanisms())),
        x_(stepper_.nx()),
        next_(stepper_.nx()) {
    const int nq = scene.robot.model.nq, nv = scene.robot.model.nv;
    VectorXd q = scene.q, v = scene.v;
    motion_.assembled_by = close_loops(scene.robot, q, v);
    motion_.slowed_by = (v - scene.v).cwiseAbs().maxCoeff();
    x_.head(nq) = q;
    x_.segment(nq, nv) = v;
    const VectorXd u = scene.commands.at(0, x_);
    for (Eigen::Index k = 0, m = nq + nv; k < scene.robot.lag.size(); ++k) {
      if (scene.robot.lag[k] > 0) x_[m++] = u[k];  // motors start where they are told to be
    }
    for (const std::string& name : energy_.names()) motion_.flows.push_back({name, {}, {}});
    if (scene.robot.constraints.rigid.empty()) {
      work_.emplace(scene, energy_, stepper_, [this](const MatrixXd& work) { note_work(work); });
      return;
    }
    rigid_.emplace(scene.robot, stepper_, scene.integrator, watched(scene, watch));
    rigid_->start(x_);
    account_.emplace(scene, energy_);
    for (const std::string& name : RigidAccount::names(scene.robot.constraints))
      motion_.flows.push_back({name, {}, {}});
  }

  SimulatedMotion result() {
    const auto begin = Clock::now();
    const long steps = scene_.steps();
    note(0);
    if (work_) work_->start(x_);
    if (account_) note_work(account_->work());
    for (long k = 0; k < steps && goes_on(k, steps); ++k) {
      if (!step(k)) break;
      ++motion_.steps;
      note(k + 1);
      if (work_) work_->after_step(double(k) * scene_.step, next_, x_);  // x_ and next_ have changed places
      if (account_) note_work(account_->work());
    }
    if (work_) work_->finish();
    if (account_) motion_.impacts = account_->impacts();
    motion_.balances = balances_.all();
    motion_.step_seconds = seconds_since(begin);
    motion_.warning = rigid_ ? rigid_->undecided() : "";
    if (motion_.warning.empty()) motion_.warning = doubt_of_steps(scene_, stepper_, looks_);
    motion_.operations = stepper_.report().step_operations;
    motion_.sources = stepper_.report().sources;
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

  bool step(long k) {
    const double t = double(k) * scene_.step;
    const VectorXd u = scene_.commands.at(t + scene_.step / 2, x_);
    std::string why;
    const bool done = advance(t, u, &why);
    motion_.effort += stepper_.effort();
    if (done && next_.squaredNorm() < kBeyond) {
      x_.swap(next_);
      return true;
    }
    if (done) why = kUnbounded;
    motion_.was_stopped = watch_.stop.stop_requested();
    if (motion_.was_stopped) return false;
    const int nq = scene_.robot.model.nq;
    const std::string stiff = stability_trouble(scene_, x_.head(nq), x_.segment(nq, scene_.robot.model.nv));
    motion_.trouble = at_time(t) + (stiff.empty() ? why : stiff);
    return false;
  }

  bool advance(double t, const VectorXd& u, std::string* why) {
    if (!rigid_) {
      work_->before_step(u);
      return stepper_.step(t, scene_.step, x_.data(), u.data(), nullptr, next_.data(), why);
    }
    if (!rigid_->step(t, scene_.step, x_, u, next_, why)) return false;
    account_->add(*rigid_, u, scene_.step);
    return true;
  }

  void note(long k) {
    const double t = double(k) * scene_.step;
    const VectorXd now = drive_in(scene_, x_, scene_.commands.at(t, x_));
    const Energy& energy = energy_.at(x_, now);
    waiting_.push_back(energy);
    if (k % (1 + scene_.steps() / kLooks) == 0)
      looks_.push_back({k, x_, rigid_ ? rigid_->forces() : VectorXd()});
    if (!is_sample(k)) return;
    motion_.t.push_back(t);
    motion_.kinetic.push_back(energy.kinetic);
    motion_.stored.push_back(energy.stored);
    motion_.loop_error =
        std::max(motion_.loop_error, loop_error(scene_.robot, x_.head(scene_.robot.model.nq)));
    states_.push_back(x_);
    drives_.push_back(now);
    const VectorXd powers = energy.power.rowwise().sum();
    for (Eigen::Index i = 0; i < energy_.flows(); ++i)
      motion_.flows[std::size_t(i)].power.push_back(powers[i]);
    if (!account_) return;
    reactions_.push_back(account_->reactions());
    motion_.deepest = std::max(motion_.deepest, -rigid_->functions().near(x_).gap.minCoeff());
  }

  // Of the first step whose energy waits for its work.
  void note_work(const MatrixXd& work) {
    balances_.add(waiting_.front(), work);
    waiting_.pop_front();
    if (!is_sample(worked_++)) return;
    const VectorXd all = work.rowwise().sum();
    for (std::size_t i = 0; i < motion_.flows.size(); ++i)
      motion_.flows[i].work.push_back(all[Eigen::Index(i)]);
    motion_.released.push_back(all[all.size() - 1]);
  }

  bool is_sample(long k) const { return k % scene_.stride() == 0 || k == scene_.steps(); }

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

  // Where a motion is looked at for steps that are too long, evenly in time, whatever is sampled.
  static constexpr long kLooks = 64;

  const Scene& scene_;
  const SimulationWatch& watch_;
  Stepper stepper_;
  EnergyMeter energy_;
  EnergyBalances balances_;
  std::optional<MotionWork> work_;     // without,
  std::optional<RigidStepper> rigid_;  // and with rigid contacts or stops
  std::optional<RigidAccount> account_;
  VectorXd x_, next_;
  std::deque<Energy> waiting_;  // for the work until then
  long worked_ = 0;             // steps whose work is known
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
