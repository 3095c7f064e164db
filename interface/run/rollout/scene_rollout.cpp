// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/rollout/scene_rollout.h>

#include <algorithm>
#include <limits>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/run/threads.h>

namespace dyntape {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kDiverged = std::numeric_limits<double>::quiet_NaN();

// Several states in registers, of explicit schemes.
CodegenOptions options_of_rollout(const Scene& scene, const std::stop_token& stop) {
  CodegenOptions options = scene.evaluation;
  options.stop = stop;
  if (!RigidStepper::needs_jacobians(scene.integrator)) options.lanes = Lanes::kNative;
  if (options.route == Route::kAutomatic) options.route = Route::kTiered;  // begins at once
  return options;
}

void check_has_derivatives(const Scene& scene) {
  if (scene.robot.constraints.rigid.empty()) return;
  throw ArgumentError(
      "roll-out: scene \"" + scene.name +
      "\" has rigid contacts or hard limits, whose impacts have no derivatives here; expected a "
      "scene without them, or a roll-out without derivatives");
}

struct UntilStopped {
  bool goes_on(const StepTime&) const { return !stop.stop_requested(); }
  const std::stop_token& stop;
};

// Rows of worlds, whose ends are written to their places.  What fails is NaN from there on, in its own row.
struct RowSteps {
  bool step(const StepTime& s, const CommandRows& u) {
    StateRows rows;
    rows.count = at.count;
    rows.t = &s.t, rows.stride_t = 0;
    rows.x = at.x, rows.stride_x = at.stride;
    rows.u = u.u, rows.stride_u = u.stride;
    rows.x_next = end, rows.stride_next = of_world;
    stepper.steps(s.h, rows);
    return true;
  }
  void advance() {
    at.x = end, at.stride = of_world;
    end += stepper.nx();
  }

  Stepper& stepper;
  WorldRows at;
  double* end;
  std::size_t of_world;
};

// One world with the Jacobians of its steps, and the observer that keeps them; NaN from a step that failed on.
struct LinearSteps {
  LinearSteps(Stepper& stepper, const double* start, double* states, WorldSlopes& slopes)
      : stepper(stepper), x(VectorXd::Map(start, stepper.nx())), next(x), states(states), slopes(slopes) {}

  bool step(const StepTime& s, const double* u) {
    const Index n_t = stepper.nt(), n_u = stepper.n_u();
    goes_on = goes_on && stepper.jacobians(s.t, s.h, x.data(), u, nullptr, next.data(), A, B, P);
    if (goes_on) return true;
    next.setConstant(kDiverged), A.setConstant(n_t, n_t, kDiverged), B.setConstant(n_t, n_u, kDiverged);
    slopes.by_x.middleRows(s.k * n_u, n_u).setConstant(kDiverged);
    slopes.by_p.middleRows(s.k * n_u, n_u).setConstant(kDiverged);
    return true;
  }
  void advance() { x.swap(next); }

  void after(const StepTime& s, const double*) {
    const Index n_t = stepper.nt();
    VectorXd::Map(states + s.k * stepper.nx(), stepper.nx()) = next;
    slopes.A.middleRows(s.k * n_t, n_t) = A;
    slopes.B.middleRows(s.k * n_t, n_t) = B;
  }

  Stepper& stepper;
  VectorXd x, next;
  double* states;
  WorldSlopes& slopes;
  MatrixXd A, B, P;
  bool goes_on = true;
};

// States (q, v, motors with a lag) of all joints, and of the independent ones.
struct TiedStates {
  VectorXd all(const VectorXd& own) const {
    const auto nq = Index(ties.q_owners.size()), nv = Index(ties.v_owners.size());
    return joined(ties.all_q(VectorXd(own.head(nq))), ties.all_v(VectorXd(own.segment(nq, nv))),
                  own.tail(own.size() - nq - nv));
  }
  VectorXd own(const VectorXd& all) const {
    const auto nq = Index(ties.q.size()), nv = Index(ties.v.size());
    return joined(ties.own_q(VectorXd(all.head(nq))), ties.own_v(VectorXd(all.segment(nq, nv))),
                  all.tail(all.size() - nq - nv));
  }
  static VectorXd joined(const VectorXd& q, const VectorXd& v, const VectorXd& motors) {
    VectorXd x(q.size() + v.size() + motors.size());
    x << q, v, motors;
    return x;
  }
  const Ties& ties;
};

}  // namespace

WorldGradient gradient_of(const WorldSlopes& s, const CostSlopes& by_x, const CostSlopes& by_u,
                          bool has_policy) {
  const Index n_t = s.A.cols(), n_u = s.B.cols(), steps = s.A.rows() / n_t;
  WorldGradient gradient{VectorXd::Zero(n_t), VectorXd::Zero(s.by_p.cols()), MatrixXd(n_u, steps)};
  VectorXd& lambda = gradient.start;
  for (Index k = steps; k-- > 0;) {
    if (by_x.cols() > 0) lambda += by_x.col(k);
    VectorXd g = s.B.middleRows(k * n_t, n_t).transpose() * lambda;
    if (by_u.cols() > 0) g += by_u.col(k);
    gradient.commands.col(k) = g;
    lambda = (s.A.middleRows(k * n_t, n_t).transpose() * lambda).eval();
    if (!has_policy) continue;
    lambda += s.by_x.middleRows(k * n_u, n_u).transpose() * g;
    gradient.parameters += s.by_p.middleRows(k * n_u, n_u).transpose() * g;
  }
  return gradient;
}

SceneRollout::SceneRollout(const Scene& scene, bool with_jacobians, const std::stop_token& stop)
    : scene_(scene),
      state_model_(independent_model(scene.robot)),
      ties_(ties_of(scene.robot)),
      options_(options_of_rollout(scene, stop)) {
  const auto take_sizes = [this](int nv, const Stepper& stepper) {
    const int lagged = stepper.nt() - 2 * nv;
    n_x_ = state_model_.nq + state_model_.nv + lagged, n_t_ = 2 * state_model_.nv + lagged;
    n_u_ = stepper.n_u();
  };
  if (with_jacobians) {
    check_has_derivatives(scene_);
    take_sizes(state_model_.nv, *linear_.take([&] { return std::make_unique<Stepper>(stepper_of(true)); }));
  } else if (scene_.robot.constraints.rigid.empty()) {
    first_free_ = std::make_unique<Stepper>(stepper_of(false));
    take_sizes(state_model_.nv, *first_free_);
  } else {
    first_rigid_ =
        std::make_unique<RobotStepper>(scene_.robot, scene_.integrator, options_, scene_.tolerances);
    take_sizes(scene_.robot.model.nv, first_rigid_->stepper());
  }
}

Stepper SceneRollout::stepper_of(bool with_jacobians) const {
  return {
      independent_system_of(scene_.robot), scene_.integrator, options_, with_jacobians, 1, scene_.tolerances};
}

void SceneRollout::in_parts(std::size_t worlds,
                            const std::function<void(std::size_t, std::size_t)>& part) const {
  constexpr std::size_t kWorlds = 16;  // of a thread at a time: a multiple of all lanes
  const std::size_t most = first_free_ ? kWorlds : 1;
  codegen::run_tasks((worlds + most - 1) / most,
                     [&](std::size_t k) { part(k * most, std::min(most, worlds - k * most)); });
}

void SceneRollout::run(const WorldRows& starts, long steps, const Law& law, double* states,
                       const std::stop_token& stop) {
  const StepRange range{.to = steps, .h = scene_.step};
  if (first_rigid_) return run_rigid(starts, range, law, states, stop);
  const auto stepper = free_.take([&] { return std::make_unique<Stepper>(first_free_->twin()); });
  RowSteps rows{*stepper, starts, states, std::size_t(n_x_) * std::size_t(steps)};
  dyntape::run(
      rows, range, [&](const StepTime& s) { return law(s.k, rows.at); }, UntilStopped{stop});
}

void SceneRollout::run_rigid(const WorldRows& starts, const StepRange& range, const Law& law, double* states,
                             const std::stop_token& stop) {
  const auto motion = rigid_.take([&] { return first_rigid_->twin(); });
  const long steps = range.to;
  const std::size_t of_world = std::size_t(n_x_) * std::size_t(steps);
  const TiedStates tied{ties_};
  VectorXd u(n_u_), own(n_x_);
  const auto commands = [&](std::size_t world) {
    return [&, world](const StepTime& s) -> const VectorXd& {
      own = tied.own(motion->x());
      u = VectorXd::Map(law(s.k, {starts.first + world, 1, own.data(), 0}).u, n_u_);
      return u;
    };
  };
  for (std::size_t world = 0; world < starts.count; ++world) {
    auto of_world_states = MatrixXd::Map(states + world * of_world, n_x_, steps);
    struct Keep {
      void after(const StepTime& s, const VectorXd&) { states.col(s.k) = tied.own(motion.next()); }
      Eigen::Map<MatrixXd>& states;
      const RobotStepper& motion;
      const TiedStates& tied;
    } keep{of_world_states, *motion, tied};
    const VectorXd start = tied.all(VectorXd::Map(starts.x + world * starts.stride, n_x_));
    if (!start.allFinite()) {
      of_world_states.setConstant(kDiverged);
      continue;
    }
    try {
      motion->start(start);
    } catch (const ArgumentError& error) {
      throw ArgumentError("world " + std::to_string(starts.first + world) + ": " + error.what());
    }
    const long made = dyntape::run(*motion, range, commands(world), UntilStopped{stop}, keep);
    of_world_states.rightCols(steps - made).setConstant(kDiverged);
  }
}

void SceneRollout::run(const double* start, long steps, const LawOfOne& law, double* states,
                       WorldSlopes& slopes, const std::stop_token& stop) {
  const auto stepper = linear_.take([&] { return std::make_unique<Stepper>(stepper_of(true)); });
  LinearSteps motion(*stepper, start, states, slopes);
  const double* u = nullptr;
  const auto commands = [&](const StepTime& s) {
    if (motion.goes_on) u = law(s.k, motion.x.data());
    return u;
  };
  dyntape::run(motion, {.to = steps, .h = scene_.step}, commands, UntilStopped{stop}, motion);
}

}  // namespace dyntape
