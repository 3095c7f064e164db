// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/optimise.h>

#include <chrono>
#include <cmath>
#include <cstdio>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/control/nlp/scaled_nlp.h>
#include <dyntape/interface/control/solve/free_motion.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

namespace {

constexpr double kOfStart = 1e-3;  // OptimiseOptions::cost_at_start

[[noreturn]] void report(const std::string& problem, const DerivativeCheck& check) {
  std::string message = "problem \"" + problem + "\": the derivatives are not those of the functions:";
  for (std::size_t k = 0; k < std::min<std::size_t>(3, check.mismatches.size()); ++k) {
    const DerivativeMismatch& m = check.mismatches[k];
    char numbers[96];
    std::snprintf(numbers, sizeof numbers, " is %.9g, differences give %.9g", m.given, m.difference);
    message += (k == 0 ? " " : "; ") + m.row + " by " + m.variable + numbers;
  }
  throw NumericalError(message +
                       "; a kink (abs, max, select) near the start can look like this: then switch "
                       "check_derivatives off");
}

// The largest, in units of the states behind the link; NaN where one is no number.
double link_violation(const StagedProgram& program, const std::vector<SolvedPhase>& phases,
                      const NlpScaling& scaling) {
  double worst = 0;
  for (const StagedLink& link : program.links) {
    const Eigen::VectorXd last = phases[link.from].motion.x.rightCols(1),
                          first = phases[link.to].motion.x.col(0);
    const Problem& before = program.phases[link.from].asked;
    const Eigen::VectorXd next =
        link.change.empty() ? last : link.change(before.stage(link.time, last, {}, {}));
    for (Eigen::Index i = 0; i < first.size(); ++i) {
      const double unit =
          scaling.x.empty() ? 1 : scaling.x[program.phases[link.to].variable + std::size_t(i)];
      const double lacks = std::abs(first[i] - next[i]) / unit;
      if (!std::isnan(worst) && !(lacks <= worst)) worst = lacks;
    }
  }
  return worst;
}

// Measures the error of a cost by no less than this.
void measure_cost_by(double least, Verification& v) {
  if (!(v.cost_size < least)) return;
  v.cost_errors *= v.cost_size / least, v.cost_error *= v.cost_size / least;
  v.cost_size = least;
}

void verify_phases(const StagedNlp& nlp, const NlpScaling& scaling, const OptimiseOptions& options,
                   Solution& solution) {
  double begin = 0;
  std::vector<std::vector<std::string>> controls;
  for (std::size_t k = 0; k < nlp.phases(); ++k) {
    SolvedPhase phase{nlp.phase(k).name, begin, nlp.trajectory(solution.nlp.x, k), {}};
    begin += phase.duration();
    if (options.verify)
      phase.verification =
          verify(nlp.problem(k), phase.motion, nlp.of_motion(scaling, k), options.solver.stop);
    measure_cost_by(kOfStart * solution.cost_at_start, phase.verification);
    controls.push_back(nlp.problem(k).controls);
    solution.phases.push_back(std::move(phase));
  }
  solution.motion = whole_motion(solution.phases, controls, nlp.program().controls);
  if (!options.verify) return;
  solution.link_violation = link_violation(nlp.program(), solution.phases, scaling);
  solution.verification = whole_verification(solution.phases, solution.link_violation);
}

template <class Make>
Solution optimise_program(const Make& make, const OptimiseOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  StagedNlp nlp = make();
  const double build_seconds = seconds_since(begin);
  Solution solution = optimise(nlp, nlp.start(), options);
  solution.build_seconds = build_seconds;
  return solution;
}

}  // namespace

VerifyOptions allowing(VerifyOptions demands, const SolverOptions& solver) {
  demands.stationarity = std::max(demands.stationarity, 10 * solver.tolerance);
  return demands;
}

DerivativeCheck checked_start(Nlp& nlp, const std::string& problem, const std::vector<double>& start,
                              bool with_derivatives) {
  if (start.size() != nlp.shape().n()) {
    throw ArgumentError("problem \"" + problem + "\": the start has " + std::to_string(start.size()) +
                        " entries, the program has " + std::to_string(nlp.shape().n()) + " variables");
  }
  for (std::size_t i = 0; i < start.size(); ++i) {
    if (std::isfinite(start[i])) continue;
    throw ArgumentError("problem \"" + problem + "\": the start of " + nlp.variable_name(i) + " is " +
                        io::shortest(start[i]) + ", expected a number");
  }
  nlp.check_finite(start);
  if (!with_derivatives) return {};
  DerivativeCheck check = check_derivatives(nlp, start);
  if (!check.good()) report(problem, check);
  return check;
}

Solution optimise(StagedNlp& nlp, const std::vector<double>& start, const OptimiseOptions& options) {
  Solution solution;
  solution.demands = allowing(options.demands, options.solver);
  const auto enter = [&](OptimiseStep step) {
    if (options.enter) options.enter(step);
  };
  enter(OptimiseStep::kChecking);
  auto begin = std::chrono::steady_clock::now();
  solution.derivatives = checked_start(nlp, nlp.program().name, start, options.check_derivatives);
  solution.check_seconds = seconds_since(begin);
  enter(OptimiseStep::kSolving);
  solution.nlp = solve_or_let_go(nlp, start, options.solver, [&]() -> std::optional<std::vector<double>> {
    if (nlp.phases() > 1) return std::nullopt;  // others begin where links lead
    const std::optional<Trajectory> motion = free_motion(nlp);
    if (!motion) return std::nullopt;
    return nlp.variables(*motion);
  });
  solution.nlp.x = without_turns(nlp, std::move(solution.nlp.x), solution.nlp.units);
  solution.cost_at_start = options.cost_at_start;
  if (!solution.nlp.log.empty() && std::isfinite(solution.nlp.log.front().objective))
    solution.cost_at_start = std::max(solution.cost_at_start, std::abs(solution.nlp.log.front().objective));
  enter(OptimiseStep::kVerifying);
  begin = std::chrono::steady_clock::now();
  ScaledNlp scaled(nlp, solution.nlp.units);
  solution.kkt = kkt_residuals(scaled, scaled.in_scaled_units(solution.nlp));
  verify_phases(nlp, scaled.units(), options, solution);
  solution.verify_seconds = seconds_since(begin);
  return solution;
}

Solution optimise(const Problem& problem, const OptimiseOptions& options) {
  return optimise_program([&] { return discretize(problem, options.mesh); }, options);
}

Solution optimise(const Phases& phases, const OptimiseOptions& options) {
  const std::vector<MeshOptions> for_all{options.mesh};
  return optimise_program(
      [&] { return discretize(phases, options.meshes.empty() ? for_all : options.meshes); }, options);
}

}  // namespace dyntape
