// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/solve.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

constexpr double kMargin =
    0.3;  // of what is demanded: intervals above are split together with those at fault
constexpr double kWorst =
    0.05;  // of the largest fault: what is far below it may be its consequence, as ringing is behind a switch
constexpr double kWorstPassed =
    0.3;  // likewise of what is passed: a control that rings behind a switch does so as long as its limit holds
constexpr double kMostCounted = 1e3;      // of faults
constexpr double kManyFaults = 0.25;      // of the intervals: then all are halved
constexpr double kAtFault = 2, kFar = 3;  // of what is demanded: such intervals are split into two, into four
constexpr double kNearlyFeasible = 0.02;  // of nominal values
constexpr int kMostOfLast = 3,
              kLeastIterations = 40;      // of the last mesh: a motion that leads further helps no more
constexpr double kSecondsAtLeast = 1e-3;  // a solver's limit has to be above zero
constexpr double kBesideInstant =
    1e-4;  // of the duration: the length of the interval in which a control jumps

int intervals_of(const Solution& s) {
  int sum = 0;
  for (const SolvedPhase& phase : s.phases) sum += phase.motion.intervals();
  return sum;
}

// What a coarse mesh may make of a motion that a finer one makes feasible.
bool is_nearly_feasible(const Solution& s) {
  const bool has_ended = s.converged() || s.nlp.status == SolveStatus::kLocallyInfeasible;
  return has_ended && !is_feasible(s.verification, s.demands) && s.verification.violation <= kNearlyFeasible;
}

// By defects and costs first: what is passed between points may be their consequence, as where a control rings behind a switch.
MeshFaults faults_of(const Solution& s) {
  MeshFaults faults;
  const Verification& whole = s.verification;
  const double errors = whole.cost_error / s.demands.cost_error;
  const bool by_passings = whole.worst_relative <= s.demands.integration_error && errors <= 1;
  for (const SolvedPhase& phase : s.phases) {
    const Verification& v = phase.verification;
    VectorXd own = v.relative_defect / s.demands.integration_error;
    if (by_passings && v.passings.of_intervals.size() == own.size()) {
      const double worst = whole.passings.worst();
      for (Eigen::Index i = 0; i < own.size(); ++i)
        if (v.passings.of_intervals[i] >= kWorstPassed * worst)
          own[i] = std::max(own[i], v.passings.of_intervals[i] / s.demands.between);
    }
    const double most = v.cost_errors.size() > 0 ? v.cost_errors.cwiseAbs().maxCoeff() : 0;
    if (errors > 1 && most > 0) own = own.cwiseMax(errors * v.cost_errors.cwiseAbs() / most);
    if (is_nearly_feasible(s)) own.setConstant(kAtFault);
    for (double& fault : own)
      if (std::isnan(fault)) fault = HUGE_VAL;
    faults.push_back(std::move(own));
  }
  return faults;
}

bool has_fault(const MeshFaults& faults) {
  return std::any_of(faults.begin(), faults.end(), [](const VectorXd& f) { return (f.array() > 1).any(); });
}

// How far the controls of two motions are apart in each interval of the finer one, relative to how far the controls move.
VectorXd changes_of_controls(const Problem& problem, const Trajectory& coarse, const Trajectory& fine) {
  constexpr int kLooks = 4;
  VectorXd changes = VectorXd::Zero(fine.intervals());
  if (fine.u.rows() == 0) return changes;
  const VectorXd range = (fine.u.rowwise().maxCoeff() - fine.u.rowwise().minCoeff()).cwiseMax(1e-300);
  const double scale = coarse.t[coarse.points() - 1] / fine.t[fine.points() - 1];
  std::vector<double> times;
  for (int k = 0; k < fine.intervals(); ++k) {
    const double begin = fine.t[fine.node(k)], h = fine.t[fine.node(k + 1)] - begin;
    for (int i = 0; i < kLooks; ++i)
      times.push_back(std::min((begin + h * (i + 0.5) / kLooks) * scale, coarse.t[coarse.points() - 1]));
  }
  const Trajectory before = resampled(problem, coarse, times);
  for (int k = 0; k < fine.intervals(); ++k) {
    for (int i = 0; i < kLooks; ++i) {
      const VectorXd off = fine.control(k, (i + 0.5) / kLooks) - before.u.col(k * kLooks + i);
      changes[k] = std::max(changes[k], off.cwiseAbs().cwiseQuotient(range).maxCoeff());
    }
  }
  return changes;
}

// Returns the node times of a phase with each interval split by its fault: those of the motion if no fault is large enough.
std::vector<double> split(const Trajectory& motion, const VectorXd& faults) {
  const double least = std::max(kMargin, kWorst * std::min(faults.maxCoeff(), kMostCounted));
  const auto bad = (faults.array() > least).count();
  const double share = double(bad) / double(faults.size());
  // Schemes of low order: on uneven meshes their optima lean on the points that the quadrature weighs least.  Of config/tasks/arm_effort.info, a
  // trapezoid, halving the intervals at fault took the defect from 1.3e-2 of the motion to 1.4e-3 and then to 1.0e-2; halving all to 4.7e-4.
  const bool all = share > kManyFaults || motion.scheme.order <= 2;
  if (bad == 0) return motion.nodes();
  std::vector<double> nodes;
  for (int k = 0; k < motion.intervals(); ++k) {
    const double from = motion.t[motion.node(k)], to = motion.t[motion.node(k + 1)];
    const int pieces = faults[k] > kFar && !all ? 4 : faults[k] > least || all ? 2 : 1;
    for (int i = 0; i < pieces; ++i) nodes.push_back(from + (to - from) * i / pieces);
  }
  nodes.push_back(motion.t[motion.points() - 1]);
  return nodes;
}

// What moves by rounding alone, beside others of its kind, stands still: nominal values are taken from a start.
void make_still(Eigen::Ref<Eigen::MatrixXd> values) {
  constexpr double kRounding = 1e-13;
  if (values.size() == 0) return;
  const double least = kRounding * values.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    const double first = std::abs(values(i, 0)) < least ? 0 : values(i, 0);
    if ((values.row(i).array() - first).abs().maxCoeff() < least) values.row(i).setConstant(first);
  }
}

class Refinement {
 public:
  Refinement(std::unique_ptr<StagedNlp>& program, Solution& solution, const RefineSteps& steps)
      : program_(program), solution_(solution), steps_(steps) {}

  void run() {
    for (int k = 0; k < steps_.refinements; ++k) {
      MeshFaults faults = next_faults();
      if (faults.empty()) return;
      if (solve_on(faults, From::kMotion)) continue;
      // A mesh may have no motion near the last one, where an obstacle stands between its points: all is halved, and then all is begun anew.
      for (VectorXd& f : faults) f.setConstant(kAtFault);
      const bool may_help = last_ != SolveStatus::kIterationLimit;
      if (!(may_help && solve_on(faults, From::kMotion)) && !solve_on(faults, From::kGuess)) return;
    }
  }

 private:
  // Empty where the mesh is good, or another one would not help.
  MeshFaults next_faults() {
    const Solution& s = solution_;
    const bool can_help = is_nearly_feasible(s) || (s.converged() && is_feasible(s.verification, s.demands));
    if (!can_help) return {};
    MeshFaults faults = faults_of(s);
    if (steps_.add_faults) steps_.add_faults(s, faults);
    if (has_fault(faults)) return faults;
    if (!std::isfinite(steps_.cost_change) || s.cost_change <= steps_.cost_change) return {};
    if (before_.empty()) {  // one mesh so far: all is looked at once more
      for (VectorXd& f : faults) f.setConstant(kAtFault);
      return faults;
    }
    double most = 0;
    MeshFaults changes;
    for (std::size_t i = 0; i < before_.size(); ++i) {
      changes.push_back(changes_of_controls(program_->problem(i), before_[i], s.phases[i].motion));
      if (changes.back().size() > 0) most = std::max(most, changes.back().maxCoeff());
    }
    for (VectorXd& f : changes)
      f = most > 0 ? VectorXd(f / (kMargin * most)) : VectorXd::Constant(f.size(), kAtFault);
    return changes;
  }

  enum class From { kMotion, kGuess };

  // False where the finer mesh is given up, and the coarser motion stays.
  bool solve_on(const MeshFaults& faults, From from) {
    solution_.refinement_trouble.clear();
    std::vector<Trajectory> motions;
    std::vector<std::vector<double>> nodes;
    int intervals = 0;
    for (std::size_t i = 0; i < solution_.phases.size(); ++i) {
      motions.push_back(solution_.phases[i].motion);
      nodes.push_back(split(motions.back(), faults[i]));
      intervals += int(nodes.back().size()) - 1;
    }
    if (intervals > steps_.most_intervals) return false;
    OptimiseOptions options = steps_.options();
    const bool by_other = solution_.nlp.is_by_other_method;  // which then solves the finer meshes as well
    if (by_other)
      options.solver.method =
          options.solver.method == NlpMethod::kIpopt ? NlpMethod::kRiccati : NlpMethod::kIpopt;
    options.cost_at_start = solution_.cost_at_start;
    if (from == From::kMotion) {
      const int most = kMostOfLast * std::max(solution_.nlp.iterations(), kLeastIterations);
      options.solver.max_iterations = std::min(options.solver.max_iterations, most);
    }
    if (options.solver.max_iterations == 0 || options.solver.stop.stop_requested()) return false;
    if (steps_.begin) steps_.begin(intervals);
    const std::string where = "the mesh of " + std::to_string(intervals) + " intervals: ";
    try {
      auto program = std::make_unique<StagedNlp>(discretize(program_->program(), nodes));
      if (steps_.prepare) steps_.prepare(*program);
      const std::vector<double> start =
          from == From::kMotion ? warm_start(motions, *program) : program->start();
      Solution fine = optimise(*program, start, options);
      fine.nlp.is_by_other_method = fine.nlp.is_by_other_method != by_other;
      take(std::move(program), std::move(fine), motions, where);
    } catch (const Error& e) {  // too large, or without a finite value at the start
      solution_.refinement_trouble = where + e.what();
    }
    return solution_.refinement_trouble.empty();
  }

  void take(std::unique_ptr<StagedNlp> program, Solution fine, const std::vector<Trajectory>& motions,
            const std::string& where) {
    fine.meshes = std::move(solution_.meshes);
    fine.meshes.push_back(round_of(fine));
    last_ = fine.nlp.status;
    if (steps_.solved) steps_.solved(fine);
    if (!fine.converged()) {
      solution_.meshes = std::move(fine.meshes);
      solution_.refinement_trouble = where + describe(fine.nlp.status);
      return;
    }
    const double size = std::max({std::abs(fine.cost()), fine.verification.cost_size, 1e-300});
    fine.cost_change = std::abs(fine.cost() - solution_.cost()) / size;
    fine.derivatives = solution_.derivatives;
    fine.check_seconds += solution_.check_seconds;
    fine.build_seconds = solution_.build_seconds;
    solution_ = std::move(fine);
    program_ = std::move(program);
    before_ = motions;
  }

  std::unique_ptr<StagedNlp>& program_;
  Solution& solution_;
  const RefineSteps& steps_;
  std::vector<Trajectory> before_;  // of the mesh before
  SolveStatus last_ = SolveStatus::kSolved;
};

// A control may jump where a constraint stands at an instant: an interval of little length behind it lets it.
std::vector<double> graded(const Problem& problem, const MeshOptions& mesh) {
  std::vector<double> nodes = node_times(problem, mesh);
  const double end = nodes.back();
  for (double share : instants_of(problem)) {
    const bool is_constrained =
        std::any_of(problem.terms.begin(), problem.terms.end(),
                    [&](const Term& term) { return is_constraint(term.role) && stands_at(term, share); });
    if (is_constrained && share > 0 && share < 1) nodes.push_back(end * (share + kBesideInstant));
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

// The mesh of a phase of an earlier solution, whose duration a free one begins with.  A fixed one may differ: nodes keep their shares.
MeshOptions mesh_of(const SolvedPhase& earlier, Problem& problem, MeshOptions mesh) {
  const Trajectory& motion = earlier.motion;
  if (motion.x.rows() != problem.n_x() || motion.u.rows() != problem.n_u())
    throw ArgumentError("solve: the earlier solution has " + std::to_string(motion.x.rows()) +
                        " states and " + std::to_string(motion.u.rows()) + " controls, \"" + problem.name +
                        "\" has " + std::to_string(problem.n_x()) + " and " + std::to_string(problem.n_u()));
  if (problem.free_time) problem.duration = earlier.duration();
  mesh.scheme = motion.scheme;
  mesh.nodes = motion.nodes();
  mesh.intervals = motion.intervals();
  if (problem.duration != earlier.duration()) {
    for (double& t : mesh.nodes) t *= problem.duration / earlier.duration();
    mesh.nodes.back() = problem.duration;
  }
  return mesh;
}

void check_phases(const Solution& earlier, std::size_t phases) {
  if (earlier.phases.size() == phases) return;
  throw ArgumentError("solve: the earlier solution has " + std::to_string(earlier.phases.size()) +
                      " phases, the problem has " + std::to_string(phases));
}

// The variables that a solve begins with: those of the guess, or of an earlier solution.
std::vector<double> start_of(const StagedNlp& program, SolveOptions& options) {
  if (!options.warm) return program.start();
  const NlpSolution& nlp = options.warm->nlp;
  const NlpShape& shape = program.shape();
  if (nlp.x.size() == shape.n() && nlp.lambda.size() == shape.m())
    options.solver.warm = std::shared_ptr<const NlpSolution>(options.warm, &nlp);
  std::vector<Trajectory> motions;
  for (std::size_t k = 0; k < program.phases(); ++k) {
    motions.push_back(options.warm->phases[k].motion);
    motions.back().t *= program.times(k).back() / options.warm->phases[k].duration();
  }
  return warm_start(motions, program);
}

Solution solve_program(std::unique_ptr<StagedNlp> program, double build_seconds, SolveOptions options) {
  const std::vector<double> start = start_of(*program, options);
  Solution solution = optimise(*program, start, options);
  if (options.warm) solution.cost_change = options.warm->cost_change;  // the mesh is as fine
  options.solver.warm = nullptr;
  solution.build_seconds = build_seconds;
  solution.meshes = {round_of(solution)};
  int iterations = solution.nlp.iterations();
  double seconds = solution.nlp.times.processor;
  RefineSteps steps;
  steps.refinements = options.verify ? options.refinements : 0;
  steps.most_intervals = options.most_intervals;
  steps.cost_change = options.cost_change;
  steps.options = [&] {
    OptimiseOptions next = options;
    next.solver.max_iterations = std::max(options.solver.max_iterations - iterations, 0);
    next.solver.max_seconds = std::max(options.solver.max_seconds - seconds, kSecondsAtLeast);
    next.check_derivatives = false;
    return next;
  };
  steps.solved = [&](const Solution& s) {
    iterations += s.nlp.iterations(), seconds += s.nlp.times.processor;
  };
  refine(program, solution, steps);
  return solution;
}

}  // namespace

MeshRound round_of(const Solution& s) {
  const Verification& v = s.verification;
  return {intervals_of(s),
          s.nlp.iterations(),
          s.check_seconds + s.nlp.times.total + s.verify_seconds,
          s.cost(),
          v.worst_relative,
          s.nlp.status,
          0,
          v.passings.worst(),
          v.cost_error};
}

std::vector<double> warm_start(const std::vector<Trajectory>& motions, const StagedNlp& program) {
  std::vector<Trajectory> finer;
  for (std::size_t k = 0; k < motions.size(); ++k) {
    const Problem& problem = program.problem(k);
    finer.push_back(resampled(problem, motions[k], program.times(k)));
    Trajectory& motion = finer.back();
    make_still(motion.x.topRows(problem.positions));
    make_still(motion.x.bottomRows(problem.n_x() - problem.positions));
    make_still(motion.a);
    make_still(motion.u);
  }
  std::vector<double> x = program.variables(finer);
  const NlpShape& shape = program.shape();
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::clamp(x[i], shape.x_lower[i], shape.x_upper[i]);
  return x;
}

void refine(std::unique_ptr<StagedNlp>& program, Solution& solution, const RefineSteps& steps) {
  Refinement(program, solution, steps).run();
}

Solution solve(const Problem& given_problem, const SolveOptions& given) {
  const auto begin = std::chrono::steady_clock::now();
  Problem problem = given_problem;
  SolveOptions options = given;
  if (options.warm) {
    check_phases(*options.warm, 1);
    options.mesh = mesh_of(options.warm->phases.front(), problem, options.mesh);
  } else if (options.is_graded) {
    options.mesh.nodes = graded(problem, options.mesh);
  }
  auto program = std::make_unique<StagedNlp>(discretize(problem, options.mesh));
  return solve_program(std::move(program), seconds_since(begin), std::move(options));
}

Solution solve(const Phases& given_phases, const SolveOptions& given) {
  const auto begin = std::chrono::steady_clock::now();
  Phases phases = given_phases;
  SolveOptions options = given;
  if (options.warm) {
    check_phases(*options.warm, phases.phases.size());
    options.meshes.clear();
    for (std::size_t k = 0; k < phases.phases.size(); ++k)
      options.meshes.push_back(mesh_of(options.warm->phases[k], phases.phases[k].problem, options.mesh));
  }
  if (options.meshes.empty()) options.meshes = {options.mesh};
  auto program = std::make_unique<StagedNlp>(discretize(phases, options.meshes));
  return solve_program(std::move(program), seconds_since(begin), std::move(options));
}

}  // namespace dyntape
