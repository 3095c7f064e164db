// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/optimise.h>

#include <chrono>
#include <cmath>
#include <cstdio>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/nlp/scaled_nlp.h>
#include <dyntape/interface/control/solve/free_motion.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

namespace {

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

}  // namespace

bool is_optimal(const KktResiduals& kkt, StationaryPoint order, const VerifyOptions& demands) {
  return kkt.stationarity <= demands.stationarity && kkt.complementarity <= demands.complementarity &&
         order != StationaryPoint::kNotMinimum;
}
bool is_feasible(const Verification& verification, const VerifyOptions& demands) {
  return verification.violation <= demands.violation;
}
bool is_accurate(const Verification& verification, const VerifyOptions& demands) {
  return verification.worst_relative <= demands.integration_error && verification.trouble.empty();
}

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

Solution optimise(Collocation& nlp, const std::vector<double>& start, const OptimiseOptions& options) {
  Solution solution;
  solution.demands = allowing(options.demands, options.solver);
  const auto enter = [&](OptimiseStep step) {
    if (options.enter) options.enter(step);
  };
  enter(OptimiseStep::kChecking);
  auto begin = std::chrono::steady_clock::now();
  solution.derivatives = checked_start(nlp, nlp.problem().name, start, options.check_derivatives);
  solution.check_seconds = seconds_since(begin);
  enter(OptimiseStep::kSolving);
  solution.nlp = solve_or_let_go(nlp, start, options.solver, [&]() -> std::optional<std::vector<double>> {
    const std::optional<Trajectory> motion = free_motion(nlp);
    if (!motion) return std::nullopt;
    return nlp.variables(*motion);
  });
  enter(OptimiseStep::kVerifying);
  begin = std::chrono::steady_clock::now();
  solution.motion = nlp.trajectory(solution.nlp.x);
  ScaledNlp scaled(nlp, solution.nlp.units);
  solution.kkt = kkt_residuals(scaled, scaled.in_scaled_units(solution.nlp));
  if (options.verify)
    solution.verification =
        verify(nlp.problem(), solution.motion, nlp.of_motion(scaled.units()), options.solver.stop);
  solution.verify_seconds = seconds_since(begin);
  return solution;
}

Solution optimise(const Problem& problem, const OptimiseOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  Collocation nlp(problem, options.mesh);
  const double build_seconds = seconds_since(begin);
  Solution solution = optimise(nlp, nlp.start(), options);
  solution.build_seconds = build_seconds;
  return solution;
}

}  // namespace dyntape
