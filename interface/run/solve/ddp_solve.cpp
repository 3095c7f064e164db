// SPDX-License-Identifier: BSD-3-Clause
//
// Solves a task by differential dynamic programming, and on shorter steps if re-simulation does not reproduce the
// motion.
#include <algorithm>
#include <chrono>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/solve/ddp.h>
#include <dyntape/interface/control/solve/shooting_steps.h>
#include <dyntape/interface/io/stopwatch.h>
#include <dyntape/interface/run/solve/refined_solve.h>
#include <dyntape/interface/run/solve/solve_rounds.h>

namespace dyntape {

namespace {

std::vector<std::string> controls_at_limits(const Problem& problem, const Trajectory& motion) {
  std::vector<std::string> names;
  for (int k = 0; k < motion.intervals(); ++k) {
    for (int i = 0; i < problem.n_u(); ++i) {
      const double u = motion.u(i, k);
      if (u <= problem.u.lower[i] || u >= problem.u.upper[i])
        names.push_back(problem.controls[std::size_t(i)] + " at node " + std::to_string(k));
    }
  }
  return names;
}

// The final distance from the goal: of the given states, and of its frame.
void look_at_goal(const Task& task, const Trajectory& motion, DdpFacts& facts) {
  double squares = 0;
  const auto note = [&](double away, double moved, const std::string& what) {
    squares += away * away;
    const double share = away == 0 ? 0 : away / moved;
    if (!(share <= facts.goal_miss)) facts.goal_miss = share, facts.missed = what;
  };
  const Problem& problem = task.problem;
  const int last = motion.points() - 1;
  const Eigen::VectorXd extents = extents_of(problem, motion);
  for (Eigen::Index i = 0; i < problem.goal.size(); ++i) {
    if (std::isnan(problem.goal[i])) continue;
    note(std::abs(motion.x(i, last) - problem.goal[i]), extents[i], problem.states[std::size_t(i)]);
  }
  const auto at = [&](int p) {
    return problem.stage(motion.t[p], motion.x.col(p), motion.a.col(p), motion.u.col(p));
  };
  for (const Term& term : problem.terms) {
    if (term.where != Where::kTerminal || term.role != Role::kEquality) continue;
    note(term.function(at(last)).norm(), term.function(at(0)).norm(), term.name);
  }
  facts.off_goal = std::sqrt(squares);
}

class DdpRounds : SolveRounds {
 public:
  DdpRounds(const Task& task, const SolveWatch& watch)
      : SolveRounds(task, watch), problem_(tracking_problem(task)) {
    is_exact_ = task.optimise.mesh.hessian != HessianKind::kGaussNewton;
  }

  SolveReport run(const MeshOptions& mesh) {
    moment_.intervals = mesh.intervals;
    for (;;) {
      Solution solution = solve(mesh);
      if (is_for_exact(solution)) {
        is_exact_ = true;
        begin_at(solution.motion);
        Solution by_exact = solve(mesh);
        by_exact.nlp.is_by_other_method = true;
        if (by_exact.converged()) solution = std::move(by_exact);
      }
      const bool is_first = moment_.refinement == 0;
      if (!is_first && !solution.converged()) {
        report_.refinement_trouble = "the mesh of " + std::to_string(moment_.intervals) +
                                     " intervals: " + describe(solution.nlp.status);
        break;
      }
      take(std::move(solution));
      if (moment_.refinement >= task_.demands.refinements || !is_too_coarse() || watch_.stop.stop_requested())
        break;
      ++moment_.refinement, moment_.intervals *= 2;
      begin_at(report_.solution.motion);
    }
    report_.solution = of_all_joints(std::move(report_.solution));
    return std::move(report_);
  }

 private:
  // All steps have one length and are halved.
  bool is_too_coarse() const {
    const Solution& s = report_.solution;
    if (!s.converged() || !is_feasible(s.verification, s.demands)) return false;
    if (!is_accurate(s.verification, s.demands)) return true;
    const auto between = [](const LimitExcess& excess) { return excess.between_points; };
    return task_.demands.limits && !report_.excesses.empty() &&
           std::all_of(report_.excesses.begin(), report_.excesses.end(), between);
  }

  void begin_at(const Trajectory& at) {
    problem_.guess = [motion = at](double t) {
      const double share = t / motion.t[motion.points() - 1] * motion.intervals();
      const int k = std::clamp(int(share + 1e-9), 0, motion.intervals() - 1);
      return Stage<double>{t, motion.x.col(k), {}, motion.u.col(k)};
    };
  }

  // If the true curvature differs much from the squares of the costs, Gauss-Newton steps do not get shorter, or too
  // slowly.  A few Newton steps then finish the solve.
  bool is_for_exact(const Solution& solution) const {
    const SolverOptions& asked = task_.optimise.solver;
    const SolveStatus status = solution.nlp.status;
    return !is_exact_ && asked.try_other_method && (is_stuck(status) || status == SolveStatus::kAcceptable) &&
           asked.max_iterations > iterations_ && asked.max_seconds > seconds_ &&
           !watch_.stop.stop_requested();
  }

  DdpOptions options(const MeshOptions& mesh) {
    const SolverOptions& asked = task_.optimise.solver;
    DdpOptions options;
    options.intervals = moment_.intervals;
    options.scheme = shooting_scheme(task_);
    options.hessian = is_exact_ ? DdpHessian::kExact : DdpHessian::kGaussNewton;
    options.tolerance = asked.tolerance;
    options.max_iterations = std::max(asked.max_iterations - iterations_, 0);
    options.max_seconds = asked.max_seconds - seconds_;
    options.evaluation = mesh.evaluation;
    options.evaluation.lanes = Lanes::kNative;
    watch_compilers(options.evaluation);
    options.verify = false;
    options.stop = watch_.stop;
    options.watch = [this](const DdpIteration& at) {
      now_.push_back(record_of(at, int(now_.size())));
      moment_.now = &now_.back();
      tell(SolveStage::kSolving);
      moment_.now = nullptr;
    };
    return options;
  }

  static IterationRecord record_of(const DdpIteration& at, int iteration) {
    return {iteration, at.cost, at.gap, at.slope, 0, 0, at.shift, 0, at.length, 0, false};
  }

  Solution solve(const MeshOptions& mesh) {
    tell(SolveStage::kRecording);
    now_.clear();
    std::optional<DdpSolver> solver;
    try {
      solver.emplace(problem_, options(mesh));
    } catch (const ToolError&) {
      check_not_stopped();
      throw;
    }
    tell(SolveStage::kSolving);
    const DdpSolution found = solver->solve();
    report_.build = solver->build();
    if (found.iterations.empty()) check_not_stopped();
    Solution solution;
    solution.demands = task_.demands;
    solution.nlp.status = found.status;
    solution.nlp.objective = found.cost;
    solution.nlp.log = now_;
    solution.nlp.times.total = found.seconds;
    seconds_ += found.seconds;
    solution.motion = held_motion(problem_, found.t, found.x, found.u);
    tell(SolveStage::kVerifying);
    const auto begin = std::chrono::steady_clock::now();
    solution.verification = verify_steps(problem_, solution.motion, found.cost, watch_.stop);
    solution.verify_seconds = seconds_since(begin);
    note(solution, solution.nlp.times.total + solution.verify_seconds);
    facts_ = {};
    facts_.slope = found.iterations.empty() ? std::nan("") : found.iterations.back().slope;
    look_at_goal(task_, tied_.of_all(solution.motion), facts_);
    if (found.is_saddle) solution.nlp.stationary_point = StationaryPoint::kNotMinimum;
    if (is_exact_ && found.converged()) {
      facts_.is_minimum = found.is_minimum;
      solution.nlp.stationary_point =
          found.is_minimum ? StationaryPoint::kMinimum : StationaryPoint::kNotMinimum;
    }
    return solution;
  }

  void take(Solution solution) {
    report_.solution = std::move(solution);
    report_.excesses = limit_excesses(task_, tied_.of_all(report_.solution.motion));
    report_.ddp = facts_;
    report_.active = controls_at_limits(problem_, report_.solution.motion);
    report_.sizes.points = std::size_t(report_.solution.motion.points());
    report_.sizes.variables = std::size_t(moment_.intervals * problem_.n_u());
    report_.sizes.operations =
        total_operations(dissolved(record_shooting(problem_, shooting_scheme(task_)).step));
  }

  Problem problem_;
  DdpFacts facts_;
  std::vector<IterationRecord> now_;
  bool is_exact_;  // the Hessian
  double seconds_ = 0;
};

}  // namespace

ShootingScheme shooting_scheme(const Task& task) {
  const Scheme& scheme = task.optimise.mesh.scheme;
  if (scheme.step) return *scheme.step;
  return scheme.name == "euler" ? ShootingScheme::kEuler : ShootingScheme::kRungeKutta4;
}

SolveReport solve_by_steps(const Task& task, const MeshOptions& mesh, const SolveWatch& watch) {
  return DdpRounds(task, watch).run(mesh);
}

}  // namespace dyntape
