// SPDX-License-Identifier: BSD-3-Clause
//
// What the Hessian is worth: iterations, time and the optimum that is found, by kind of Hessian and by solver.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/solve/ddp.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>

#include "measure.h"
#include "study.h"

namespace dyntape::tools {
namespace {

constexpr double kWeights[] = {0, 1, 10};
constexpr const char* kDrawn = "goal that draws";
constexpr int kIterations = 500;
constexpr double kLong = 0.2;   // s: a solve that is timed once
constexpr double kNear = 1e-3;  // of the best optimum's cost

struct Outcome {
  double cost = 0, iterations = 0, seconds = 0;
  SolveStatus status = SolveStatus::kSolverError;
  bool found() const { return status == SolveStatus::kSolved || status == SolveStatus::kAcceptable; }
};

using Guess = std::function<Stage<double>(double t)>;
using Solve = std::function<Outcome(const Guess& guess)>;

std::string label_of(double weight) { return "goal demanded, w = " + io::shortest(weight); }

// The task's guess and three waves upon each position, their slopes upon its velocities.
Guess disturbed(const Problem& problem, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const Eigen::Index positions = problem.positions;
  Eigen::MatrixXd waves(positions, 3);
  for (double& wave : waves.reshaped()) wave = normal(random);
  return [guess = problem.guess, waves, T = problem.duration](double t) {
    Stage<double> s = guess(t);
    for (Eigen::Index j = 0; j < waves.cols(); ++j) {
      const double rate = double(j + 1) * std::numbers::pi / T;
      s.x.head(waves.rows()) += std::sin(rate * t) * waves.col(j);
      s.x.tail(waves.rows()) += rate * std::cos(rate * t) * waves.col(j);
    }
    return s;
  };
}

class Measured {
 public:
  Measured(Study& study, const StudyOptions& options) : study_(study), options_(options) {}

  // From the task's guess, and where asked for from random ones, which are the same for each method.
  void add(const std::string& subject, double weight, const std::string& method, const Problem& problem,
           const Solve& solve, bool from_random) {
    options_.watch(subject + ", " + method);
    StudyRow row{"iterations", subject, method, weight};
    try {
      std::vector<double> seconds;
      Outcome outcome;
      for (int run = 0; run < 3 && (run == 0 || seconds.back() < kLong); ++run) {
        outcome = solve(problem.guess);
        seconds.push_back(outcome.seconds);
      }
      row.seconds = median(seconds);
      row.value = outcome.iterations;
      if (outcome.status != SolveStatus::kSolved)
        row.trouble =
            std::string(to_string(outcome.status)) + ", its cost is " + io::with_digits(outcome.cost, 9);
      cost_[subject + method] = outcome.cost;
      std::mt19937_64 random(options_.seed);
      for (int k = 0; k < starts() && from_random; ++k)
        from_random_[subject][method].push_back(solve(disturbed(problem, random)));
    } catch (const Error& refused) {
      row.trouble = refused.what();
    }
    weight_[subject] = weight;
    study_.rows.push_back(row);
  }

  void refused(const std::string& subject, double weight, const std::string& method, const std::string& why) {
    study_.rows.push_back(
        {.part = "iterations", .subject = subject, .method = method, .parameter = weight, .trouble = why});
  }

  int starts() const { return options_.quick ? 10 : 200; }

  // How many of them end near the best of all.
  void add_shares() {
    for (const auto& [subject, methods] : from_random_) {
      double best = HUGE_VAL;
      for (const auto& [method, outcomes] : methods)
        for (const Outcome& o : outcomes)
          if (o.found()) best = std::min(best, o.cost);
      best_[subject] = best;
      for (const auto& [method, outcomes] : methods) {
        std::vector<double> seconds;
        int near = 0;
        for (const Outcome& o : outcomes) {
          seconds.push_back(o.seconds);
          near += o.found() && std::abs(o.cost - best) <= kNear * std::abs(best);
        }
        study_.rows.push_back({.part = "starts",
                               .subject = subject,
                               .method = method,
                               .parameter = weight_[subject],
                               .seconds = median(seconds),
                               .value = near / double(outcomes.size())});
      }
    }
  }

  double best(const std::string& subject) const { return best_.at(subject); }
  double cost(const std::string& subject, const std::string& method) const {
    return cost_.at(subject + method);
  }
  // Of those that end at some optimum: their costs.
  std::vector<double> found(const std::string& subject, const std::string& method) const {
    std::vector<double> costs;
    for (const Outcome& o : from_random_.at(subject).at(method))
      if (o.found()) costs.push_back(o.cost);
    return costs;
  }

 private:
  Study& study_;
  const StudyOptions& options_;
  std::map<std::string, std::map<std::string, std::vector<Outcome>>> from_random_;
  std::map<std::string, double> best_, weight_, cost_;
};

struct Kind {
  HessianKind hessian;
  const char* name;
};
constexpr Kind kKinds[] = {{HessianKind::kExact, "exact"},
                           {HessianKind::kGaussNewton, "Gauss-Newton"},
                           {HessianKind::kLimitedMemory, "limited memory"}};
struct Solver {
  NlpMethod method;
  const char* name;
};
constexpr Solver kSolvers[] = {{NlpMethod::kIpopt, "Ipopt"}, {NlpMethod::kRiccati, "stages"}};

std::string name_of(const Solver& solver, const Kind& kind) {
  return std::string(solver.name) + ", " + kind.name;
}

Solve solve_of(StagedNlp& program, const Solver& solver) {
  return [&program, method = solver.method](const Guess& guess) {
    Problem now = program.problem();
    now.guess = guess;
    program.set_values(now);
    const NlpSolution s =
        solve_nlp(program, program.start(), {.method = method, .max_iterations = kIterations});
    return Outcome{s.objective, double(s.iterations()), s.times.total, s.status};
  };
}

// Where both solvers take the same steps, ours stands for both, being the quicker; the other is asked once.
bool randomly(const Solver& solver, const Kind& kind, double weight) {
  if (solver.method == NlpMethod::kRiccati) return kind.hessian != HessianKind::kLimitedMemory;
  return weight == 0 && kind.hessian != HessianKind::kGaussNewton;
}

// All that is asked of one problem by collocation; a subject is a name and w, or NaN of a problem without parameter "tracking".
void measure(Measured& measured, const Problem& problem, const Scheme& scheme, int intervals,
             const std::vector<std::pair<std::string, double>>& subjects) {
  for (const Kind& kind : kKinds) {
    std::optional<StagedNlp> program;
    std::string why;
    try {
      program.emplace(discretize(
          problem, MeshOptions{.scheme = scheme, .intervals = intervals, .hessian = kind.hessian}));
    } catch (const ArgumentError& refused) {
      why = refused.what();
    }
    for (const auto& [subject, weight] : subjects) {
      Problem now = problem;
      if (!std::isnan(weight)) now.parameters.set("tracking", std::sqrt(weight));
      if (program) program->set_values(now);
      for (const Solver& solver : kSolvers) {
        if (program)
          measured.add(subject, weight, name_of(solver, kind), now, solve_of(*program, solver),
                       randomly(solver, kind, weight));
        else
          measured.refused(subject, weight, name_of(solver, kind), why);
      }
    }
  }
}

void measure_ddp(Measured& measured, const Problem& problem, int intervals) {
  for (const DdpHessian hessian : {DdpHessian::kExact, DdpHessian::kGaussNewton}) {
    DdpSolver solver(
        problem, {.intervals = intervals, .hessian = hessian, .start = DdpStart::kNodes, .verify = false});
    const bool exact = hessian == DdpHessian::kExact;
    measured.add(
        kDrawn, std::nan(""), exact ? "ddp, exact" : "ddp, Gauss-Newton", problem,
        [&](const Guess& guess) {
          Problem now = solver.problem();
          now.guess = guess;
          solver.set_values(now);
          const DdpSolution s = solver.solve();
          return Outcome{s.cost, double(s.iterations.size()), s.seconds, s.status};
        },
        true);
  }
}

std::string percent(double share) { return io::with_digits(100 * share, 3) + " %"; }

// "stages, exact: 14 in 2.2 ms"
std::string one_solve(const Measured& measured, const StudyRow& row, double usual_cost) {
  const double cost = measured.cost(row.subject, row.method);
  std::string text = row.method + ": " + io::shortest(row.value) + " in " + io::duration(row.seconds);
  if (!row.trouble.empty()) text += ", short of the tolerance";
  if (std::abs(cost - usual_cost) > kNear * std::abs(usual_cost))
    text += ", cost " + io::with_digits(cost, 7);
  return text;
}

// "stages, exact: 44 %, the median ends at 58.8076, 0.5 % at no optimum"
std::string one_share(const Measured& measured, const StudyRow& row) {
  const std::vector<double> costs = measured.found(row.subject, row.method);
  std::string text = row.method + ": " + percent(row.value);
  if (!costs.empty()) text += ", the median ends at " + io::with_digits(median(costs), 6);
  const double lost = 1 - double(costs.size()) / measured.starts();
  return text + (lost > 0 ? ", " + percent(lost) + " at no optimum" : "");
}

void append(std::string& list, const std::string& text) { list += (list.empty() ? "" : "; ") + text; }

void add_findings(Study& study, const Measured& measured) {
  const auto subject_findings = [&](const std::string& subject, const std::vector<std::string>& methods) {
    const double cost = measured.cost(subject, methods.front());
    std::string solves, shares;
    for (const std::string& method : methods) {
      const StudyRow& row = point(study, "iterations", subject, method);
      if (std::isnan(row.value)) continue;
      append(solves, one_solve(measured, row, cost));
      for (const StudyRow& share : curve(study, "starts", subject, method))
        append(shares, one_share(measured, share));
    }
    study.parts[0].findings.push_back(subject + ", cost " + io::with_digits(cost, 9) +
                                      ", iterations: " + solves + ".");
    study.parts[1].findings.push_back(
        subject + ": from " + std::to_string(measured.starts()) + " random starts the best optimum, " +
        io::with_digits(measured.best(subject), 9) + ", is reached by " + shares + ".");
  };
  std::vector<std::string> methods;
  for (const Solver& solver : kSolvers)
    for (const Kind& kind : kKinds) methods.push_back(name_of(solver, kind));
  for (const double weight : kWeights) subject_findings(label_of(weight), methods);
  methods.insert(methods.end(), {"ddp, exact", "ddp, Gauss-Newton"});
  subject_findings(kDrawn, methods);
}

}  // namespace

Study outline_of_hessians() {
  Study study{.name = "hessians",
              .title = "Hessians: what the curvature is worth",
              .question = "Which Hessian, and which solver, for a swing-up?"};
  study.parts = {{.name = "iterations",
                  .title = "Iterations from the straight line",
                  .x_label = "time of a solve [ms]",
                  .y_label = "iterations",
                  .x_scale = 1e3,
                  .mark = io::Mark::kPoints},
                 {.name = "starts",
                  .title = "Random starts that end at the best optimum",
                  .x_label = "median time of a solve [ms]",
                  .y_label = "share of the starts [1]",
                  .x_scale = 1e3,
                  .mark = io::Mark::kPoints}};
  return study;
}

Study study_hessians(const StudyOptions& options) {
  Study study = outline_of_hessians();
  Measured measured(study, options);
  Problem demanded = read_task(options.config + "/tasks/cart_pole_swing_up.info").problem;
  const Parameter root = demanded.parameters.add("tracking", 0.0);
  demanded.add(running_squares("tracking", [root, goal = demanded.goal](const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    return (root(s)[0] * (s.x - goal.template cast<T>())).eval();
  }));
  std::vector<std::pair<std::string, double>> subjects;
  for (const double weight : kWeights) subjects.emplace_back(label_of(weight), weight);
  measure(measured, demanded, hermite_simpson(), 40, subjects);

  const Task task = read_task(options.config + "/tasks/cart_pole_ddp.info");
  const Problem drawn = tracking_problem(task);
  const int steps = task.optimise.mesh.intervals;
  measure(measured, drawn, runge_kutta_4(1), steps, {{kDrawn, std::nan("")}});
  measure_ddp(measured, drawn, steps);
  measured.add_shares();

  study.left_out = {
      "Random starts by Ipopt, but where the goal is demanded and w = 0, and there all but Gauss-Newton: "
      "from "
      "the line both solvers take nearly the same steps with the same Hessian, and ours takes less time.",
      "Differential dynamic programming where the goal is demanded: it knows costs that draw, no demands."};
  study.methods = {
      "config/tasks/cart_pole_swing_up.info, Hermite-Simpson on 40 intervals, w |x - goal|^2 added to u^2; "
      "the "
      "parameter in the table is w. Where the goal draws: config/tasks/cart_pole_ddp.info, " +
          std::to_string(steps) + " steps of Runge-Kutta 4, the force held, one program for all methods.",
      "Compiled functions; the time of the solve alone, median of three, or of all random starts. Default "
      "tolerances; no more than " +
          std::to_string(kIterations) + " iterations.",
      "A random start: the line, on each position three sine waves of normal amplitude (1 m, 1 rad), their "
      "slopes on the velocities, no force; ddp starts from the same states (DdpStart::kNodes). Reached is "
      "what "
      "ends within 0.1 % of the least cost to which any of them leads, at the acceptable tolerance or "
      "better."};
  add_findings(study, measured);
  return study;
}

}  // namespace dyntape::tools
