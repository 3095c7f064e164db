// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/optimise_phases.h>

#include <algorithm>
#include <chrono>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/nlp/scaled_nlp.h>
#include <dyntape/interface/control/solve/free_motion.h>
#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

namespace {

// The largest, in units of the states behind the link; NaN where one is no number.
double link_violation(const Phases& phases, const std::vector<Trajectory>& motions,
                      const PhasedCollocation& nlp, const NlpScaling& scaling) {
  double worst = 0;
  for (const PhaseLink& link : links_of(phases)) {
    const Problem& before = phases.phases[link.from].problem;
    const Eigen::VectorXd last = motions[link.from].x.rightCols(1), first = motions[link.to].x.col(0);
    const Eigen::VectorXd next =
        link.change->empty() ? last : (*link.change)(before.stage(before.duration, last, {}, {}));
    const NlpScaling own = nlp.of_phase(link.to, scaling);
    for (Eigen::Index i = 0; i < first.size(); ++i) {
      const double unit = own.x.empty() ? 1 : own.x[std::size_t(i)];
      const double lacks = std::abs(first[i] - next[i]) / unit;
      if (!(lacks <= worst)) worst = lacks;
    }
  }
  return worst;
}

}  // namespace

bool PhasedSolution::success() const {
  if (!converged() || !is_optimal(kkt, nlp.stationary_point, demands)) return false;
  const auto is_good = [&](const Verification& v) {
    return is_feasible(v, demands) && is_accurate(v, demands);
  };
  return link_violation <= demands.violation &&
         std::all_of(verifications.begin(), verifications.end(), is_good);
}

double PhasedSolution::begin(std::size_t phase) const {
  if (phase >= motions.size())
    throw ArgumentError("there is no phase " + std::to_string(phase) + ", expected a number below " +
                        std::to_string(motions.size()));
  double t = 0;
  for (std::size_t k = 0; k < phase; ++k) t += motions[k].t[motions[k].points() - 1];
  return t;
}

PhasedSolution::States PhasedSolution::states() const {
  States all{Eigen::VectorXd(0), Eigen::MatrixXd(motions.front().x.rows(), 0)};
  for (std::size_t k = 0; k < motions.size(); ++k) {
    const Trajectory& motion = motions[k];
    if (motion.x.rows() != all.x.rows())
      throw ArgumentError("phase " + std::to_string(k) + " has " + std::to_string(motion.x.rows()) +
                          " states, those before have " + std::to_string(all.x.rows()));
    const Eigen::Index more = motion.points(), n = all.t.size() + more;
    all.t.conservativeResize(n), all.x.conservativeResize(Eigen::NoChange, n);
    all.t.tail(more) = motion.t.array() + begin(k);
    all.x.rightCols(more) = motion.x;
  }
  return all;
}

PhasedSolution optimise(PhasedCollocation& nlp, const Phases& phases, const std::vector<double>& start,
                        const OptimiseOptions& options) {
  PhasedSolution solution;
  solution.demands = allowing(options.demands, options.solver);
  const auto enter = [&](OptimiseStep step) {
    if (options.enter) options.enter(step);
  };
  enter(OptimiseStep::kChecking);
  auto begin = std::chrono::steady_clock::now();
  solution.derivatives = checked_start(nlp, phases.name, start, options.check_derivatives);
  solution.check_seconds = seconds_since(begin);
  enter(OptimiseStep::kSolving);
  solution.nlp = solve_or_let_go(nlp, start, options.solver, [&]() -> std::optional<std::vector<double>> {
    if (nlp.phases() > 1) return std::nullopt;  // others begin where links lead
    const std::optional<Trajectory> motion = free_motion(nlp.phase(0));
    if (!motion) return std::nullopt;
    return nlp.variables({*motion});
  });
  enter(OptimiseStep::kVerifying);
  begin = std::chrono::steady_clock::now();
  solution.motions = nlp.trajectories(solution.nlp.x);
  ScaledNlp scaled(nlp, solution.nlp.units);
  solution.kkt = kkt_residuals(scaled, scaled.in_scaled_units(solution.nlp));
  if (options.verify) {
    for (std::size_t k = 0; k < nlp.phases(); ++k) {
      const NlpScaling own = nlp.phase(k).of_motion(nlp.of_phase(k, scaled.units()));
      solution.verifications.push_back(
          verify(phases.phases[k].problem, solution.motions[k], own, options.solver.stop));
    }
    solution.link_violation = link_violation(phases, solution.motions, nlp, scaled.units());
  }
  solution.verify_seconds = seconds_since(begin);
  return solution;
}

PhasedSolution optimise(const Phases& phases, const PhasedOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  PhasedCollocation nlp(phases, options.meshes);
  const double build_seconds = seconds_since(begin);
  PhasedSolution solution = optimise(nlp, phases, nlp.start(),
                                     {.solver = options.solver,
                                      .check_derivatives = options.check_derivatives,
                                      .verify = options.verify,
                                      .demands = options.demands});
  solution.build_seconds = build_seconds;
  return solution;
}

}  // namespace dyntape
