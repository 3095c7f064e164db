// SPDX-License-Identifier: BSD-3-Clause
#include "advice.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/run/solve/refined_solve.h>

#include "task_program.h"

namespace dyntape::tools {
namespace {

constexpr double kCoarsest = 0.25, kFinest = 16, kFiner = 1.4;  // of the task's mesh, and of one to the next
constexpr double kShort = 0.3;                                  // s: of a solve that is timed several times
constexpr double kHopeless = 4;     // times the quickest: finer meshes of a scheme are not tried
constexpr int kIterations = 500;    // of one solve
constexpr double kElsewhere = 0.1;  // of how far the states move, at half the time: another optimum
constexpr double kSafety = 0.01;    // of the error: tolerances of the solver

struct Outcome {
  Solution solution;
  std::vector<Trajectory> motions;    // of the phases
  double seconds = NAN, error = NAN;  // of a solve; relative
  int intervals = 0;
  std::string trouble = {};
  Timed again = {};
  bool good() const { return trouble.empty(); }
};

Eigen::VectorXd halfway(const Trajectory& motion) {
  const double t = 0.5 * motion.t[motion.points() - 1];
  const Eigen::Index after = std::clamp<Eigen::Index>(
      std::lower_bound(motion.t.begin(), motion.t.end(), t) - motion.t.begin(), 1, motion.t.size() - 1);
  const double share = (t - motion.t[after - 1]) / std::max(motion.t[after] - motion.t[after - 1], 1e-300);
  return (1 - share) * motion.x.col(after - 1) + share * motion.x.col(after);
}

class Advisor {
 public:
  Advisor(const Task& task, const AdviceOptions& options)
      : task_(task), options_(options), allowed_(std::pow(10.0, -options.digits)) {
    Study& study = advice_.study;
    study.name = "advice";
    study.title = "How to solve " + task.name + " to " + std::to_string(options.digits) + " digits";
    study.question = "Which scheme, mesh, solver, Hessian, route and integrator, on this machine?";
    study.parts = {{.name = "meshes",
                    .title = "Schemes by mesh",
                    .x_label = "time of a solve [ms]",
                    .y_label = "error of cost or true defect, relative",
                    .x_scale = 1e3},
                   {.name = "solvers",
                    .title = "Solvers and Hessians on the chosen mesh",
                    .x_label = "time of a solve [ms]",
                    .y_label = "error of cost or true defect, relative",
                    .x_scale = 1e3},
                   {.name = "routes",
                    .title = "Routes: what compiling takes, and a solve then",
                    .x = StudyPart::kParameter,
                    .x_label = "compiling and loading [s]",
                    .y_label = "time of a solve [s]"}};
    study.methods = {
        "Each way but the reference, which starts from the motion of the task as it is, starts from the "
        "task's guess; times are those of the solve alone, the least of several of "
        "short ones. The "
        "parameter is the number of intervals; of routes the seconds of compiling, and there the value is "
        "the time of a solve.",
        "References: " +
            std::string("lobatto-5 on meshes halved until the cost stays, beside radau-4 on the finest.")};
    study.left_out = {
        "euler and runge-kutta-4, which hold controls over an interval: their optimum is another one, at "
        "order 1 to 2.",
        "Threads: one.", "Meshes that are not even: `solve` makes those of its own where a defect is large."};
  }

  Advice run() {
    solve_as_it_is();
    find_reference();
    judge_as_it_is();
    choose_mesh();
    choose_solver();
    choose_route();
    choose_integrator();
    write_keys();
    return std::move(advice_);
  }

 private:
  double elapsed() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }
  double left() const { return options_.seconds - elapsed(); }

  SolverOptions solver(NlpMethod method, double share) const {
    SolverOptions solver = task_.optimise.solver;
    solver.method = method;
    if (method == NlpMethod::kRiccati) solver.extra.clear();
    solver.tolerance = std::clamp(kSafety * allowed_, 1e-12, solver.tolerance);
    solver.bound_relaxation = std::min(solver.bound_relaxation, kSafety * allowed_);
    if (method == NlpMethod::kRiccati) solver.bound_relaxation = 0;
    solver.max_iterations = std::min(solver.max_iterations, kIterations);
    solver.max_seconds = std::min(solver.max_seconds, std::max(5.0, share * options_.seconds));
    solver.print_level = 0;
    solver.limited_memory = false;
    return solver;
  }

  // From the task's guess, or from motions of its phases.
  Outcome solved(const std::shared_ptr<const TaskProgram>& program, double fineness, NlpMethod method,
                 const std::vector<Trajectory>& from = {}) {
    Outcome outcome;
    outcome.intervals = program->intervals(fineness);
    try {
      const std::shared_ptr<StagedNlp> nlp = program->on(fineness, from);
      const SolverOptions how = solver(method, 0.25);
      const std::vector<double> start = from.empty() ? nlp->start() : warm_start(from, *nlp);
      Solution found = optimise(*nlp, start, {.solver = how, .check_derivatives = false});
      outcome.solution = std::move(found);
      for (const SolvedPhase& phase : outcome.solution.phases) outcome.motions.push_back(phase.motion);
      outcome.seconds = outcome.solution.nlp.times.total;
      outcome.again = [program, nlp, start, how] { return solve_nlp(*nlp, start, how).times.total; };
      for (int again = 0; again < 4 && outcome.seconds < kShort && from.empty(); ++again)
        outcome.seconds = std::min(outcome.seconds, outcome.again());
      judge(outcome, how);
    } catch (const Error& refused) {
      outcome.trouble = refused.what();
    }
    return outcome;
  }

  void judge(Outcome& outcome, const SolverOptions& how) const {
    const Solution& s = outcome.solution;
    const double stationarity = std::max(task_.demands.stationarity, 10 * how.tolerance);
    if (s.nlp.status != SolveStatus::kSolved)
      outcome.trouble = describe(s.nlp.status);
    else if (!(s.verification.violation <= std::max(task_.demands.violation, 10 * how.tolerance)))
      outcome.trouble = "constraints violated by " + io::scientific(s.verification.violation);
    else if (!(s.kkt.stationarity <= stationarity))
      outcome.trouble = "no optimum: stationarity " + io::scientific(s.kkt.stationarity);
    else if (!std::isfinite(s.verification.worst_relative))
      outcome.trouble = s.verification.trouble;
    else if (reference_ && elsewhere(s))
      outcome.trouble = "another optimum: its cost is " + io::with_digits(s.cost(), 7);
    if (reference_ && outcome.good())
      outcome.error =
          std::max(std::abs(s.cost() - advice_.reference) / scale(), s.verification.worst_relative);
  }

  double scale() const { return std::abs(advice_.reference) > 0 ? std::abs(advice_.reference) : 1; }
  bool elsewhere(const Solution& s) const {
    const Eigen::VectorXd there = halfway(reference_->motion);
    if (std::abs(s.cost() - advice_.reference) <= allowed_ * scale()) return false;
    const Eigen::MatrixXd& x = reference_->motion.x;
    const Eigen::VectorXd range = x.rowwise().maxCoeff() - x.rowwise().minCoeff();
    return (halfway(s.motion) - there).norm() > kElsewhere * range.norm();
  }

  TaskWay own_way() const {
    const MeshOptions& mesh = task_.optimise.mesh;
    return {mesh.scheme, 1, mesh.hessian, task_.optimise.solver.method, mesh.evaluation};
  }
  TaskWay way(const Scheme& scheme, double fineness = 1) const {
    TaskWay way = own_way();
    way.scheme = scheme, way.fineness = fineness, way.method = method_, way.hessian = HessianKind::kExact;
    return way;
  }

  // By stages, or where that finds none, by Ipopt, which then solves all else as well.
  void find_reference() {
    std::string trouble;
    for (NlpMethod method : {NlpMethod::kRiccati, NlpMethod::kIpopt}) {
      method_ = method;
      options_.watch(std::string("the reference, by ") + name_of(method));
      const auto program = std::make_shared<const TaskProgram>(task_, way(lobatto(5)));
      std::optional<Outcome> before;
      double fineness = 1, change = NAN;
      for (; fineness <= 8; fineness *= 2) {
        std::vector<Trajectory> near;
        if (before || as_it_is_.good()) near = before ? before->motions : as_it_is_.motions;
        Outcome now = solved(program, fineness, method, near);
        if (!now.good() && !before && !near.empty())
          now = solved(program, fineness, method);  // from the guess
        if (!now.good()) {
          trouble = now.trouble;
          break;
        }
        if (before) change = std::abs(now.solution.cost() - before->solution.cost());
        before = std::move(now);
        if (change <= 0.1 * kSafety * allowed_ * std::abs(before->solution.cost()) ||
            elapsed() > options_.seconds / 5)
          break;
      }
      if (!before) continue;
      advice_.reference = before->solution.cost();
      const auto other = std::make_shared<const TaskProgram>(task_, way(radau(4)));
      // On a mesh of its own: where a control jumps between points, all schemes on one mesh are off alike.
      const Outcome beside = solved(other, 0.8 * std::min(fineness, 8.0), method, before->motions);
      const double apart = beside.good() ? std::abs(beside.solution.cost() - advice_.reference) : HUGE_VAL;
      // Where the other family fails the last change is all that is known.
      const double off = std::isfinite(apart) && std::isfinite(change) ? std::max(apart, change)
                         : std::isfinite(apart)                        ? apart
                                                                       : change;
      advice_.known_to = off / scale();
      reference_ = std::move(before->solution);
      if (!std::isfinite(advice_.known_to)) break;
      allowed_ = std::max(allowed_, 3 * advice_.known_to);
      return;
    }
    throw NumericalError("task \"" + task_.name + "\": no reference is found, by lobatto-5 and radau-4: " +
                         (trouble.empty() ? "one mesh alone was solved in the time there is" : trouble));
  }

  void add_row(const std::string& part, const std::string& method, const Outcome& o) {
    StudyRow row{part, task_.name, method, double(o.intervals), o.seconds};
    if (o.good())
      row.value = o.error;
    else
      row.trouble = o.trouble;
    advice_.study.rows.push_back(row);
  }

  // Its optimum is the one that is meant: there may be others near.
  void solve_as_it_is() {
    options_.watch("the task as it is");
    try {
      as_it_is_ =
          solved(std::make_shared<const TaskProgram>(task_, own_way()), 1, task_.optimise.solver.method);
    } catch (const Error& refused) {
      as_it_is_.trouble = refused.what();
    }
  }

  void judge_as_it_is() {
    Outcome& outcome = as_it_is_;
    if (outcome.good()) judge(outcome, solver(task_.optimise.solver.method, 0.25));
    const std::string what = task_.optimise.mesh.scheme.name + " on " + std::to_string(outcome.intervals) +
                             " intervals, " + name_of(task_.optimise.solver.method) + ", " +
                             name_of(task_.optimise.mesh.hessian);
    add_row("meshes", "as it is", outcome);
    advice_.choices.push_back({"as it is", what, outcome.seconds, outcome.error});
    if (!outcome.good()) advice_.choices.back().measured = {outcome.trouble};
  }

  static bool is_quicker_again(const Outcome& a, const Outcome& b) {
    return is_quicker(a.seconds, b.seconds) && is_quicker(a.again, b.again);
  }

  // The quicker of what keeps the digits, else the more exact.
  bool better(const Outcome& a, const Outcome& b) const {
    const bool kept_a = a.error <= allowed_, kept_b = b.error <= allowed_;
    if (kept_a != kept_b) return kept_a;
    return kept_a ? is_quicker_again(a, b) : a.error < b.error;
  }

  void choose_mesh() {
    std::vector<Scheme> schemes = {hermite_simpson(), lobatto(4), trapezoid(), radau(3)};
    const Scheme& own = task_.optimise.mesh.scheme;
    if (!own.step && !own.spans_all &&
        std::none_of(schemes.begin(), schemes.end(), [&](const Scheme& s) { return s.name == own.name; }))
      schemes.push_back(own);
    std::vector<std::string> measured;
    for (const Scheme& scheme : schemes) {
      std::optional<Outcome> own_best;
      try {
        const auto program = std::make_shared<const TaskProgram>(task_, way(scheme));
        int last = 0;
        for (double fineness = kCoarsest; fineness <= kFinest && left() > 0.4 * options_.seconds;
             fineness *= kFiner) {
          if (program->intervals(fineness) == last) continue;
          last = program->intervals(fineness);
          options_.watch(scheme.name + " on " + std::to_string(last) + " intervals");
          const Outcome now = solved(program, fineness, method_);
          add_row("meshes", scheme.name, now);
          if (!now.good()) continue;
          if (!own_best || better(now, *own_best)) own_best = now;
          if (!best_ || better(now, *best_)) {
            best_ = now;
            best_way_ = way(scheme, fineness);
          }
          if (now.error <= allowed_ || (best_->error <= allowed_ && now.seconds > kHopeless * best_->seconds))
            break;
        }
      } catch (const Error& refused) {
        Outcome none;
        none.trouble = refused.what();
        add_row("meshes", scheme.name, none);
      }
      if (own_best)
        measured.push_back(scheme.name + " on " + std::to_string(own_best->intervals) + ": " +
                           io::scientific(own_best->error) + " in " + io::duration(own_best->seconds));
    }
    if (!best_)
      throw NumericalError("task \"" + task_.name +
                           "\": the reference is found, and its motion on no mesh of any scheme" +
                           (left() < 0 ? " in the " + io::shortest(options_.seconds) + " s that were given"
                                       : ": " + advice_.study.rows.back().trouble));
    advice_.reached = best_->error <= allowed_;
    advice_.study.parts[0].findings = measured;
    advice_.choices.push_back(
        {"scheme and mesh", best_way_->scheme.name + " on " + std::to_string(best_->intervals) + " intervals",
         best_->seconds, best_->error, measured});
  }

  void choose_solver() {
    std::vector<std::string> measured;
    Outcome best = *best_;
    for (HessianKind kind : {HessianKind::kExact, HessianKind::kGaussNewton, HessianKind::kLimitedMemory}) {
      TaskWay now = *best_way_;
      now.hessian = kind;
      std::shared_ptr<const TaskProgram> program;
      for (NlpMethod method : {NlpMethod::kRiccati, NlpMethod::kIpopt}) {
        const std::string name = std::string(name_of(method)) + ", " + name_of(kind);
        options_.watch(name);
        Outcome outcome;
        outcome.intervals = best_->intervals;
        now.method = method;
        if (left() < 0.25 * options_.seconds && !(method == method_ && kind == HessianKind::kExact)) {
          outcome.trouble = "not measured: no time was left";
        } else {
          try {
            if (!program) program = std::make_shared<const TaskProgram>(task_, now);
            outcome = solved(program, now.fineness, method);
          } catch (const Error& refused) {
            outcome.trouble = refused.what();
          }
        }
        add_row("solvers", name, outcome);
        measured.push_back(name + ": " +
                           (outcome.good() ? std::to_string(outcome.solution.nlp.iterations()) +
                                                 " iterations, " + io::duration(outcome.seconds)
                                           : outcome.trouble));
        if (outcome.good() && outcome.error <= std::max(allowed_, 1.1 * best_->error) &&
            is_quicker_again(outcome, best))
          best = outcome, best_way_ = now;
      }
    }
    best_ = best;
    advice_.study.parts[1].findings = measured;
    advice_.choices.push_back({"solver and Hessian",
                               std::string(name_of(best_way_->method)) + ", " + name_of(best_way_->hessian),
                               best.seconds, best.error, measured});
  }

  struct RouteKind {
    const char* name;
    Route route;
    Lanes lanes;
  };

  void choose_route() {
    static constexpr RouteKind kinds[] = {{"compiled", Route::kCompiled, Lanes::kNone},
                                          {"interpreter", Route::kInterpreter, Lanes::kNone},
                                          {"compiled, lanes", Route::kCompiled, Lanes::kNative}};
    const RouteKind* chosen = nullptr;
    double least = HUGE_VAL, longest = 0, interpreted = NAN, at_once = NAN, to_make = NAN;
    std::vector<std::string> measured;
    for (const RouteKind& kind : kinds) {
      options_.watch(kind.name);
      TaskWay now = *best_way_;
      now.evaluation.route = kind.route, now.evaluation.lanes = kind.lanes;
      now.evaluation.use_cache = false, now.evaluation.force_rebuild = false;
      Outcome outcome;
      double make = NAN;
      if (1.5 * longest > left()) {
        outcome.trouble = "not measured: compiling takes longer than there was time";
      } else {
        const double before = elapsed();
        try {
          const auto program = std::make_shared<const TaskProgram>(task_, now);
          make = program->build().seconds.total() - program->build().seconds.record;
          outcome = solved(program, now.fineness, now.method);
        } catch (const Error& refused) {
          outcome.trouble = refused.what();
        }
        longest = std::max(longest, elapsed() - before);
      }
      StudyRow row{"routes", task_.name, kind.name, make, outcome.seconds};
      if (outcome.good())
        row.value = outcome.seconds;
      else
        row.trouble = outcome.trouble;
      advice_.study.rows.push_back(row);
      measured.push_back(std::string(kind.name) + ": " +
                         (outcome.good() ? io::duration(outcome.seconds) + " after " + io::duration(make)
                                         : outcome.trouble));
      const double total = make + options_.solves * outcome.seconds;
      const bool kept = outcome.good() && outcome.error <= std::max(allowed_, 1.1 * best_->error);
      if (kept && kind.route == Route::kInterpreter) interpreted = outcome.seconds;
      if (!kept || !is_quicker(total, least)) continue;
      // Where compiling alone does not make the difference, solving has to.
      const bool by_solving =
          route_best_ && !is_quicker(make + options_.solves * route_best_->seconds, least);
      if (by_solving && !is_quicker(outcome.again, route_best_->again)) continue;
      least = total, chosen = &kind;
      route_best_ = outcome, at_once = outcome.seconds, to_make = make;
      best_way_->evaluation.route = kind.route == Route::kCompiled ? Route::kAutomatic : kind.route;
      best_way_->evaluation.lanes = kind.lanes;
    }
    if (!chosen) {
      advice_.choices.push_back({"route", "as it is", best_->seconds, best_->error, measured});
      return;
    }
    if (chosen->route != Route::kInterpreter && interpreted > at_once)
      measured.push_back("compiling has paid after " +
                         std::to_string(long(std::ceil(to_make / (interpreted - at_once)))) + " solves");
    advice_.study.parts[2].findings = measured;
    advice_.choices.push_back({"route", chosen->name, route_best_->seconds, route_best_->error, measured});
  }

  void choose_integrator() {
    options_.watch("integrators");
    advice_.choices.push_back(advise_integrator(
        advice_.study, {task_, best_->solution.motion, allowed_, std::max(2.0, left() / 5)}));
  }

  void write_keys() {
    const TaskWay& way = *best_way_;
    std::string& keys = advice_.keys;
    if (task_.phases.empty()) {
      keys += "horizon\n{\n  intervals " + std::to_string(best_->intervals) + "\n}\n";
    } else {
      keys += "phases\n{\n";
      for (const Task& phase : task_.parts)
        keys += "  phase " + phase.name + "\n  {\n    intervals " +
                std::to_string(std::max(1l, std::lround(way.fineness * phase.optimise.mesh.intervals))) +
                "\n  }\n";
      keys += "}\n";
    }
    keys +=
        "transcription\n{\n  scheme  " + way.scheme.name + "\n  hessian " + name_of(way.hessian) + "\n}\n";
    keys += "evaluation\n{\n  route   " + std::string(to_string(way.evaluation.route)) + "\n  lanes   " +
            (way.evaluation.lanes == Lanes::kNone ? "none" : "native") + "\n}\n";
    const SolverOptions how = solver(way.method, 1);
    keys += "solver\n{\n  method           " + std::string(to_string(way.method)) + "\n  tolerance        " +
            io::shortest(how.tolerance) + "\n  bound_relaxation " + io::shortest(how.bound_relaxation) +
            "\n}\n";
  }

  const Task& task_;
  const AdviceOptions& options_;
  double allowed_;
  Advice advice_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  NlpMethod method_ = NlpMethod::kRiccati;
  Outcome as_it_is_;
  std::optional<Solution> reference_;
  std::optional<Outcome> best_, route_best_;
  std::optional<TaskWay> best_way_;
};

}  // namespace

Advice advise(const Task& task, const AdviceOptions& options) {
  if (task.by_ddp)
    throw ArgumentError(
        "task \"" + task.name +
        "\" is solved by differential dynamic programming (solver.method ddp), which has no scheme, Hessian "
        "or solver to choose; expected method riccati or ipopt");
  return Advisor(task, options).run();
}

}  // namespace dyntape::tools
