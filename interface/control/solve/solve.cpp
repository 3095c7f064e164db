// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/solve.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

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
constexpr double kMostCounted = 1e3;      // of faults
constexpr double kManyFaults = 0.25;      // of the intervals: then all are halved
constexpr double kAtFault = 2, kFar = 3;  // of what is demanded: such intervals are split into two, into four
constexpr double kNearlyFeasible = 0.02;  // of nominal values
constexpr double kSettledCost = 1e-3;     // most that a cost moves while it counts as settled (settling.h)
constexpr double kSameControls = 0.01;    // of how far they move
constexpr double kBarrierOfCost = 1e-2;   // the first barrier on a finer mesh, all logarithms together
constexpr int kMostOfLast = 3,
              kLeastIterations = 40;  // of the last mesh: a motion that leads further helps no more
constexpr double kBesideInstant =
    1e-4;  // of the duration: the length of the interval in which a control jumps

int intervals_of(const Solution& s) {
  int sum = 0;
  for (const SolvedPhase& phase : s.phases) sum += phase.motion.intervals();
  return sum;
}

// A first barrier for a start near a solution.  A barrier of 0.1 for each bound would outweigh the cost on a fine mesh, and the
// solve would leave the solution that it starts from.
double first_barrier(const NlpShape& shape) {
  double bounds = 1;
  const auto count = [&](const std::vector<double>& lower, const std::vector<double>& upper) {
    for (std::size_t i = 0; i < lower.size(); ++i)
      if (lower[i] < upper[i]) bounds += std::isfinite(lower[i]) + std::isfinite(upper[i]);
  };
  count(shape.x_lower, shape.x_upper);
  count(shape.g_lower, shape.g_upper);
  return kBarrierOfCost / bounds;
}

// What a coarse mesh may make of a motion that a finer one makes feasible.
bool is_nearly_feasible(const Solution& s) {
  const bool has_ended = s.converged() || s.nlp.status == SolveStatus::kLocallyInfeasible;
  return has_ended && !is_feasible(s.verification, s.demands) && s.verification.violation <= kNearlyFeasible;
}

// By defects and costs first: what is passed between points may be their consequence, as where a control rings behind a switch.
// `cost_error`: largest error of the quadrature.
MeshFaults faults_of(const Solution& s, double cost_error) {
  MeshFaults faults;
  const Verification& whole = s.verification;
  const double errors = whole.cost_error / cost_error;
  const bool by_passings = whole.worst_relative <= s.demands.integration_error && errors <= 1;
  for (const SolvedPhase& phase : s.phases) {
    const Verification& v = phase.verification;
    VectorXd own = v.relative_defect / s.demands.integration_error;
    if (by_passings && v.passings.of_intervals.size() == own.size()) {
      const double worst = whole.passings.worst();
      for (Eigen::Index i = 0; i < own.size(); ++i)
        if (v.passings.of_intervals[i] >= kWorst * worst)
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

// What moves by no more than a solver's tolerance, beside others of its kind, stands still: nominal values are taken from a start, and rows in units
// of noise cannot be met.
void make_still(Eigen::Ref<Eigen::MatrixXd> values) {
  constexpr double kNoise = 1e-8;
  if (values.size() == 0) return;
  const double least = kNoise * values.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    const double first = std::abs(values(i, 0)) < least ? 0 : values(i, 0);
    if ((values.row(i).array() - first).abs().maxCoeff() < least) values.row(i).setConstant(first);
  }
}

// What was found on a mesh.
struct EarlierMesh {
  double cost;
  std::vector<Trajectory> motions;  // a phase
};

bool is_settled(const Solution& s) { return s.nlp.status == SolveStatus::kSettled; }

class Refinement {
 public:
  Refinement(std::unique_ptr<StagedNlp>& program, Solution& solution, const RefineSteps& steps)
      : program_(program),
        solution_(solution),
        steps_(steps),
        is_compared_(std::isfinite(solution.cost_change)) {}

  void run() {
    int k = 0;
    do {
      for (; k < steps_.refinements; ++k) {
        MeshFaults faults = next_faults();
        if (faults.empty()) break;
        if (solve_on(split_by(faults), steps_.prepare ? From::kMotion : From::kNear)) continue;
        // A mesh may have no motion near the last one, where an obstacle stands between its points: all is halved, and then all is begun anew.
        for (VectorXd& f : faults) f.setConstant(kAtFault);
        const bool may_help = last_ != SolveStatus::kIterationLimit;
        if (!(may_help && solve_on(split_by(faults), From::kMotion)) &&
            !solve_on(split_by(faults), From::kGuess))
          break;
      }
    } while (is_settled(solution_) && finish_mesh());
  }

 private:
  // Empty where the mesh is good, or another one would not help.
  MeshFaults next_faults() {
    const Solution& s = solution_;
    const bool can_help =
        is_settled(s) || is_nearly_feasible(s) || (s.converged() && is_feasible(s.verification, s.demands));
    if (!can_help) return {};
    MeshFaults faults = faults_of(s, s.demands.cost_error);
    if (steps_.add_faults) steps_.add_faults(s, faults);
    if (has_fault(faults)) return faults;
    if (!std::isfinite(steps_.cost_change)) return {};
    const double most = is_settled(s) ? std::max(kSettledCost, steps_.cost_change) : steps_.cost_change;
    if (is_compared_ && s.cost_change <= most) {
      // A jump of the cost between a node and the first point behind it changes no mesh's cost.
      faults = faults_of(s, std::min(s.demands.cost_error, steps_.cost_change));
      return has_fault(faults) ? faults : MeshFaults();
    }
    const std::optional<EarlierMesh> before = std::exchange(coarser_, EarlierMesh{s.cost(), motions()});
    is_compared_ = true;
    if (before) {
      for (std::size_t i = 0; i < faults.size(); ++i)
        faults[i] =
            changes_of_controls(program_->problem(i), before->motions[i], s.phases[i].motion) / kSameControls;
    }
    if (!before || !has_fault(faults))
      for (VectorXd& f : faults) f.setConstant(kAtFault);
    return faults;
  }

  // kNear: from the last motion with a small first barrier; kMotion: with the usual one; kGuess: from the problem's guess.
  enum class From { kNear, kMotion, kGuess };
  using Nodes = std::vector<std::vector<double>>;  // of each phase

  Nodes split_by(const MeshFaults& faults) const {
    Nodes nodes;
    for (std::size_t i = 0; i < solution_.phases.size(); ++i)
      nodes.push_back(split(solution_.phases[i].motion, faults[i]));
    return nodes;
  }

  std::vector<Trajectory> motions() const {
    std::vector<Trajectory> all;
    for (const SolvedPhase& phase : solution_.phases) all.push_back(phase.motion);
    return all;
  }

  // Options of the next solve, by the method that solved last; nothing where no iterations are left.
  std::optional<OptimiseOptions> next_options() const {
    OptimiseOptions options = steps_.options();
    if (solution_.nlp.is_by_other_method) options.solver.method = solution_.nlp.method;
    options.cost_at_start = solution_.cost_at_start;
    if (options.solver.max_iterations == 0 || options.solver.stop.stop_requested()) return {};
    return options;
  }

  // Solves the mesh to the end whose cost has settled: with its multipliers, and if that fails without.  False where both fail: the solution
  // says how.
  bool finish_mesh() {
    const std::vector<double> start = solution_.nlp.x;
    const auto settled = std::make_shared<const NlpSolution>(solution_.nlp);
    for (const std::shared_ptr<const NlpSolution>& from : {settled, std::shared_ptr<const NlpSolution>()}) {
      std::optional<OptimiseOptions> options = next_options();
      if (!options) return give_up();
      options->solver.stop_when_settled = false;
      options->solver.warm = from;
      solution_.refinement_trouble.clear();
      take(nullptr, optimise(*program_, start, *options), "");
      if (solution_.converged()) return true;
    }
    return false;
  }

  // Returns true if the next solve starts with multipliers of the coarser mesh.  Only kRiccati estimates those of equations.  Those of schemes
  // that use the first point of an interval, such as Hermite-Simpson, oscillate along arcs at a limit.
  bool takes_multipliers(const SolverOptions& options) const {
    const NlpMethod method = options.method == NlpMethod::kAutomatic ? solution_.nlp.method : options.method;
    return method == NlpMethod::kRiccati &&
           std::none_of(solution_.phases.begin(), solution_.phases.end(),
                        [](const SolvedPhase& phase) { return phase.motion.scheme.uses_first_point(); });
  }

  // The mesh stays unfinished: what ended the solve is the caller's limit.
  bool give_up() {
    const bool is_stopped = steps_.options().solver.stop.stop_requested();
    solution_.nlp.status = is_stopped ? SolveStatus::kStopped : SolveStatus::kIterationLimit;
    return false;
  }

  // False if the finer mesh failed, and the coarser motion stays.
  bool solve_on(const Nodes& nodes, From from) {
    solution_.refinement_trouble.clear();
    int intervals = 0;
    for (const std::vector<double>& of_phase : nodes) intervals += int(of_phase.size()) - 1;
    if (intervals > steps_.most_intervals) return false;
    std::optional<OptimiseOptions> options = next_options();
    if (!options) return false;
    if (from != From::kGuess) {
      const int most = kMostOfLast * std::max(solution_.nlp.iterations(), kLeastIterations);
      options->solver.max_iterations = std::min(options->solver.max_iterations, most);
    }
    if (steps_.begin) steps_.begin(intervals);
    const std::string where = "the mesh of " + std::to_string(intervals) + " intervals: ";
    try {
      auto program = std::make_unique<StagedNlp>(discretize(program_->program(), nodes));
      if (steps_.prepare) steps_.prepare(*program);
      const std::vector<double> start =
          from == From::kGuess ? program->start() : warm_start(motions(), *program);
      if (from == From::kNear) options->solver.first_barrier = first_barrier(program->shape());
      if (from == From::kNear && takes_multipliers(options->solver))
        options->solver.warm = std::make_shared<const NlpSolution>(
            with_multipliers_of(*program_, solution_.nlp, *program, start));
      Solution fine = optimise(*program, start, *options);
      take(std::move(program), std::move(fine), where);
    } catch (const Error& e) {  // too large, or without a finite value at the start
      solution_.refinement_trouble = where + e.what();
    }
    return solution_.refinement_trouble.empty();
  }

  // `program`: null where the mesh is the same.
  void take(std::unique_ptr<StagedNlp> program, Solution next, const std::string& where) {
    next.nlp.is_by_other_method = next.nlp.is_by_other_method != solution_.nlp.is_by_other_method;
    next.meshes = std::move(solution_.meshes);
    next.meshes.push_back(round_of(next));
    last_ = next.nlp.status;
    if (steps_.solved) steps_.solved(next);
    if (program && !next.converged() && !is_settled(next)) {
      solution_.meshes = std::move(next.meshes);
      solution_.refinement_trouble = where + describe(next.nlp.status);
      return;
    }
    next.derivatives = solution_.derivatives;
    next.check_seconds += solution_.check_seconds;
    next.build_seconds = solution_.build_seconds;
    next.cost_change = solution_.cost_change;
    if (program) {
      const double size = std::max({std::abs(next.cost()), next.verification.cost_size, 1e-300});
      next.cost_change = std::abs(next.cost() - (coarser_ ? coarser_->cost : solution_.cost())) / size;
      program_ = std::move(program);
    }
    solution_ = std::move(next);
  }

  std::unique_ptr<StagedNlp>& program_;
  Solution& solution_;
  const RefineSteps& steps_;
  // The cost is compared with this one: since, all was split in which controls changed.
  std::optional<EarlierMesh> coarser_;
  bool is_compared_;  // or was, in the earlier solution that the solve began with
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
  options.solver.stop_when_settled = options.verify && options.refinements > 0;
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
    next.solver.max_seconds = seconds_left(options.solver, seconds);
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
          v.cost_error,
          s.nlp.times,
          s.verify_seconds};
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
