// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/scene/simulate.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/scene/energy.h>
#include <dyntape/interface/scene/quadrature.h>
#include <dyntape/interface/scene/stability.h>

namespace dyntape {

namespace {

using Clock = std::chrono::steady_clock;
using Eigen::VectorXd;

double elapsed_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

std::string at_time(double t) { return "at t = " + io::with_digits(t, 6) + " s: "; }

// How functions are made, seen and stopped from outside.
CodegenOptions watched(const Scene& scene, const SimulationWatch& watch) {
  CodegenOptions options = scene.evaluation;
  options.stop = watch.stop;
  options.compiled_piece = [tell = watch.tell](std::size_t done, std::size_t of) {
    if (tell) tell("compiling: " + std::to_string(done) + " of " + std::to_string(of) + " pieces");
  };
  return options;
}

// One run of a scene: the state that moves, and what is noted of it.
class SceneRun {
 public:
  SceneRun(const Scene& scene, const SimulationWatch& watch)
      : scene_(scene),
        watch_(watch),
        stepper_(system_of(scene.robot), scene.integrator, watched(scene, watch)),
        energy_(scene.robot, watched(scene, watch)),
        work_(scene.step, energy_.flows()),
        x_(stepper_.nx()),
        next_(stepper_.nx()) {
    const int nq = scene.robot.model.nq, nv = scene.robot.model.nv;
    x_.head(nq) = scene.q;
    x_.segment(nq, nv) = scene.v;
    const VectorXd u = scene.commands.at(0);
    for (Eigen::Index k = 0, m = nq + nv; k < scene.robot.lag.size(); ++k) {
      if (scene.robot.lag[k] > 0) x_[m++] = u[k];  // motors start where they are told to be
    }
    for (const std::string& name : energy_.names()) motion_.flows.push_back({name, {}, {}});
  }

  SimulatedMotion result() {
    const auto begin = Clock::now();
    const long steps = scene_.steps();
    note(0);
    for (long k = 0; k < steps && goes_on(k, steps); ++k) {
      if (!step(k)) break;
      ++motion_.steps;
      note(k + 1);
    }
    work_.finish([&](const VectorXd& work) { note_work(work); });
    motion_.step_seconds = elapsed_since(begin);
    motion_.doubt = doubt();
    motion_.operations = stepper_.report().step_operations;
    motion_.sources = stepper_.report().sources;
    join_columns();
    return std::move(motion_);
  }

 private:
  bool goes_on(long k, long steps) {
    constexpr long kOften = 1024;
    if (k % kOften != 0) return true;
    motion_.was_stopped = watch_.stop.stop_requested();
    if (watch_.tell) {
      watch_.tell("t = " + io::with_digits(double(k) * scene_.step, 4) + " of " +
                  io::with_digits(double(steps) * scene_.step, 4) + " s");
    }
    return !motion_.was_stopped;
  }

  bool step(long k) {
    const double t = double(k) * scene_.step;
    const VectorXd u = scene_.commands.at(t + scene_.step / 2);
    std::string why;
    if (stepper_.step(t, scene_.step, x_.data(), u.data(), nullptr, next_.data(), &why)) {
      x_.swap(next_);
      return true;
    }
    const int nq = scene_.robot.model.nq;
    const std::string stiff = stability_trouble(scene_, x_.head(nq), x_.segment(nq, scene_.robot.model.nv));
    motion_.trouble = at_time(t) + (stiff.empty() ? why : stiff);
    return false;
  }

  // A friction that is too stiff for the step makes the motion tremble, which no other check sees.
  std::string doubt() {
    const int nq = scene_.robot.model.nq, nv = scene_.robot.model.nv;
    for (const auto& [k, x] : looks_) {
      std::string stiff = stability_trouble(scene_, x.head(nq), x.segment(nq, nv));
      if (stiff.empty()) stiff = trouble_at_turns(double(k) * scene_.step, x);
      if (!stiff.empty()) return at_time(double(k) * scene_.step) + stiff;
    }
    return doubt_of_halves();
  }

  // Where a joint turns round within the step, its friction may be far stiffer than at both ends.
  std::string trouble_at_turns(double t, const VectorXd& x) {
    const dynamics::Model<double>& model = scene_.robot.model;
    dynamics::Data<double> data(model);
    dynamics::EffectTorques<double> torques(model);
    const VectorXd q = x.head(model.nq);
    const VectorXd tau = torques_at(actuated_dofs(scene_.robot), drive(x, scene_.commands.at(t)), model.nv);
    VectorXd v = x.segment(model.nq, model.nv);
    const VectorXd next = v + scene_.step * dynamics::forward_dynamics<double>(
                                                model, data, torques, scene_.robot.effects, q, v, tau);
    const auto turns = (v.array() * next.array() < 0).eval();
    if (!turns.any()) return "";
    v = turns.select(VectorXd::Zero(model.nv), v);
    return stability_trouble(scene_, q, v);
  }

  // Where half steps lead elsewhere again and again: friction that trembles, forces that come and go within a step.
  std::string doubt_of_halves() {
    constexpr double kElsewhere = 0.1, kOften = 0.25;
    const int nq = scene_.robot.model.nq, nv = scene_.robot.model.nv;
    const double h = scene_.step;
    std::vector<VectorXd> error;
    VectorXd whole(x_.size()), half(x_.size()), twice(x_.size());
    VectorXd most = VectorXd::Zero(nv);
    for (const auto& [k, x] : looks_) {
      const double t = double(k) * h;
      const VectorXd u = scene_.commands.at(t + h / 2);
      if (!stepper_.step(t, h, x.data(), u.data(), nullptr, whole.data())) continue;
      if (!stepper_.step(t, h / 2, x.data(), u.data(), nullptr, half.data())) continue;
      if (!stepper_.step(t + h / 2, h / 2, half.data(), u.data(), nullptr, twice.data())) continue;
      most = most.cwiseMax((twice - x).segment(nq, nv).cwiseAbs());
      error.push_back((twice - whole).segment(nq, nv).cwiseAbs());
    }
    long elsewhere = 0;
    for (const VectorXd& e : error) elsewhere += (e.array() > kElsewhere * most.array() + 1e-12).any();
    if (double(elsewhere) <= kOften * double(error.size()) || elsewhere < 3) return "";
    return "in " + std::to_string(elsewhere) + " of " + std::to_string(error.size()) +
           " places two steps of half the length lead elsewhere; take shorter steps, or smoother forces";
  }

  VectorXd drive(const VectorXd& x, const VectorXd& u) const {
    VectorXd drive = u;
    Eigen::Index m = scene_.robot.model.nq + scene_.robot.model.nv;
    for (Eigen::Index k = 0; k < scene_.robot.lag.size(); ++k) {
      if (scene_.robot.lag[k] > 0) drive[k] = x[m++];
    }
    return drive;
  }

  void note(long k) {
    const double t = double(k) * scene_.step;
    const VectorXd now = drive(x_, scene_.commands.at(t));
    const Energy& energy = energy_.at(x_, now);
    work_.append(energy.power, [&](const VectorXd& work) { note_work(work); });
    if (k % (1 + scene_.steps() / kLooks) == 0) looks_.emplace_back(k, x_);
    if (!is_sample(k)) return;
    motion_.t.push_back(t);
    motion_.kinetic.push_back(energy.kinetic);
    motion_.stored.push_back(energy.stored);
    states_.push_back(x_);
    drives_.push_back(now);
    for (std::size_t i = 0; i < motion_.flows.size(); ++i)
      motion_.flows[i].power.push_back(energy.power[Eigen::Index(i)]);
  }

  void note_work(const VectorXd& work) {
    if (is_sample(worked_++)) {
      for (std::size_t i = 0; i < motion_.flows.size(); ++i)
        motion_.flows[i].work.push_back(work[Eigen::Index(i)]);
    }
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
  }

  // Where a motion is looked at for steps that are too long, evenly in time, whatever is sampled.
  static constexpr long kLooks = 64;

  const Scene& scene_;
  const SimulationWatch& watch_;
  Stepper stepper_;
  EnergyMeter energy_;
  Quadrature work_;
  VectorXd x_, next_;
  long worked_ = 0;
  std::vector<VectorXd> states_, drives_;
  std::vector<std::pair<long, VectorXd>> looks_;
  SimulatedMotion motion_;
};

void check_start(const Scene& scene) {
  if (!scene.q.allFinite() || !scene.v.allFinite())
    throw ArgumentError("scene \"" + scene.name + "\": the state at the start is not finite");
  const std::string trouble = stability_trouble(scene, scene.q, scene.v);
  if (!trouble.empty()) throw ArgumentError("scene \"" + scene.name + "\", at the start: " + trouble);
}

}  // namespace

System system_of(const RobotScene& scene) {
  System system;
  system.name = scene.model.name;
  system.model = scene.model;
  const std::vector<int> dofs = actuated_dofs(scene);
  system.n_u = int(dofs.size());
  system.lag = scene.lag;
  system.acceleration = [scene, dofs](const SystemPoint<AD>& s) -> VectorXad {
    const dynamics::Model<AD> model = scene.model.cast<AD>();
    const dynamics::Effects<AD> effects = scene.effects.cast<AD>();
    dynamics::Data<AD> data(model);
    dynamics::EffectTorques<AD> torques(model);
    const VectorXad tau = torques_at(dofs, s.drive, model.nv);
    return dynamics::forward_dynamics<AD>(model, data, torques, effects, s.q, s.v, tau);
  };
  system.lagrangian = [acting = dynamics::acting_model(scene.model, scene.effects)](
                          const VectorXad& q, const VectorXad& v, const VectorXad&) -> AD {
    const dynamics::Model<AD> model = acting.cast<AD>();
    dynamics::Data<AD> data(model);
    const AD kinetic = dynamics::kinetic_energy<AD>(model, data, q, v);
    return kinetic - dynamics::potential_energy<AD>(model, data, q);
  };
  system.forces = [scene, dofs](const SystemPoint<AD>& s) -> VectorXad {
    const dynamics::Model<AD> model = scene.model.cast<AD>();
    dynamics::Data<AD> data(model);
    dynamics::EffectTorques<AD> torques(model);
    const dynamics::Effects<AD> effects = scene.effects.cast<AD>();
    const VectorXad command = torques_at(dofs, s.drive, model.nv);
    const VectorXad driven = dynamics::driving_torques<AD>(model, torques, effects, command);
    return driven + dynamics::effect_torques<AD>(model, data, torques, effects, s.q, s.v);
  };
  return system;
}

SimulatedMotion simulate(const Scene& scene, const SimulationWatch& watch) {
  check_start(scene);
  const auto begin = Clock::now();
  SceneRun run(scene, watch);
  const double build = elapsed_since(begin);
  SimulatedMotion motion = run.result();
  motion.build_seconds = build;
  return motion;
}

double SimulatedMotion::energy_error() const {
  double most = 0;
  for (int k = 0; k < samples(); ++k) {
    double work = 0;
    for (const EnergyFlow& flow : flows) {
      if (std::size_t(k) < flow.work.size()) work += flow.work[std::size_t(k)];
    }
    const double error = std::abs(kinetic[std::size_t(k)] - kinetic[0] - work);
    if (!(error <= most)) most = error;  // NaN as well
  }
  return most;
}

double SimulatedMotion::energy_scale() const {
  double most = 0;
  for (int k = 0; k < samples(); ++k) {
    most = std::max(most, kinetic[std::size_t(k)]);
    for (const EnergyFlow& flow : flows) {
      if (std::size_t(k) < flow.work.size()) most = std::max(most, std::abs(flow.work[std::size_t(k)]));
    }
  }
  return most;
}

}  // namespace dyntape
