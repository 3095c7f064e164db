// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/solve/refined_solve.h>

#include <algorithm>
#include <chrono>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/solve/refine.h>
#include <dyntape/interface/files/task/task_phases.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/run/solve/whole_motion.h>

namespace dyntape {

namespace {

constexpr double kLeastSecondsLeft = 1e-3;  // a limit of the solver has to be above zero

SolveStage stage_of(OptimiseStep step) {
  switch (step) {
    case OptimiseStep::kChecking:
      return SolveStage::kChecking;
    case OptimiseStep::kSolving:
      return SolveStage::kSolving;
    case OptimiseStep::kVerifying:
      break;
  }
  return SolveStage::kVerifying;
}

// Infeasible by no more than what a coarse mesh makes of a motion that keeps all limits, but barely.
bool is_nearly_feasible(const Solution& solution) {
  constexpr double kLittle = 0.02;  // of nominal values
  return solution.nlp.status == SolveStatus::kLocallyInfeasible && solution.verification.violation <= kLittle;
}

// What moves by rounding alone, beside others of its kind, stands still: nominal values are taken from a start.
void still(Eigen::Ref<Eigen::MatrixXd> values) {
  constexpr double kRounding = 1e-13;
  if (values.size() == 0) return;
  const double least = kRounding * values.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    const double first = std::abs(values(i, 0)) < least ? 0 : values(i, 0);
    if ((values.row(i).array() - first).abs().maxCoeff() < least) values.row(i).setConstant(first);
  }
}

class Rounds {
 public:
  Rounds(const Task& task, const SolveWatch& watch) : task_(task), phases_(phases_of(task)), watch_(watch) {}

  RefinedSolve run(const MeshOptions& mesh) {
    build(mesh);
    take(optimise(*result_.program, phases_, result_.program->start(), options()));
    if (result_.solution.nlp.log.empty()) check_not_stopped();
    note(result_.solution);
    while (moment_.refinement < task_.demands.refinements &&
           is_too_coarse(result_.solution, result_.excesses, task_) && !watch_.stop.stop_requested()) {
      if (!refine()) break;
    }
    return std::move(result_);
  }

 private:
  void tell(SolveStage stage) {
    moment_.stage = stage;
    if (watch_.tell) watch_.tell(moment_);
  }

  void check_not_stopped() const {
    if (watch_.stop.stop_requested())
      throw Interrupted("interrupted before the first iteration: there is no motion yet");
  }

  void build(const MeshOptions& mesh) {
    std::vector<MeshOptions> meshes = meshes_of(task_, mesh);
    moment_.intervals = 0;
    for (const MeshOptions& own : meshes)
      moment_.intervals += own.nodes.empty() ? own.intervals : int(own.nodes.size()) - 1;
    for (MeshOptions& own : meshes) watch(own);
    tell(SolveStage::kRecording);
    try {
      result_.program = std::make_unique<PhasedCollocation>(phases_, meshes);
    } catch (const ToolError&) {
      if (!watch_.stop.stop_requested()) throw;
    }
    check_not_stopped();
    result_.build = result_.program->build();
  }

  void watch(MeshOptions& mesh) {
    mesh.evaluation.stop = watch_.stop;
    // Outlives this object within the program, so it holds what it needs.
    mesh.evaluation.compiled_piece = [tell = watch_.tell, intervals = moment_.intervals](std::size_t done,
                                                                                         std::size_t of) {
      if (tell) tell({SolveStage::kCompiling, intervals, 0, done, of});
    };
  }

  // Iterations and time are limited for all meshes together.
  OptimiseOptions options() {
    OptimiseOptions options = task_.optimise;
    options.solver.stop = watch_.stop;
    options.solver.watch = [this](const IterationRecord& record) {
      moment_.now = &record;
      tell(SolveStage::kSolving);
      moment_.now = nullptr;
    };
    options.enter = [this](OptimiseStep step) { tell(stage_of(step)); };
    options.solver.max_iterations = std::max(options.solver.max_iterations - iterations_, 0);
    options.solver.max_seconds = std::max(options.solver.max_seconds - processor_seconds_, kLeastSecondsLeft);
    options.demands = task_.demands;
    options.check_derivatives = options.check_derivatives && moment_.refinement == 0;
    return options;
  }

  void take(PhasedSolution solution) {
    found_ = std::move(solution);
    result_.solution = whole(task_, found_);
    result_.excesses = excesses_of(task_, found_);
    result_.phases.clear();
    for (std::size_t k = 0; k < task_.phases.size(); ++k) {
      const Eigen::VectorXd& t = found_.motions[k].t;
      result_.phases.push_back({task_.phases[k].name, found_.begin(k), t[t.size() - 1]});
    }
  }

  void note(const Solution& s) {
    iterations_ += s.nlp.iterations();
    processor_seconds_ += s.nlp.times.processor;
    result_.meshes.push_back({moment_.intervals, s.nlp.iterations(),
                              s.check_seconds + s.nlp.times.total + s.verify_seconds, s.cost(),
                              s.verification.worst_relative, s.nlp.status});
  }

  // False where the finer mesh is given up, and the coarser motion stays.
  bool refine() {
    const PhasedSolution& coarse = found_;
    std::vector<std::vector<double>> nodes;
    ++moment_.refinement;
    moment_.intervals = 0;
    for (const Trajectory& motion : coarse.motions) {
      nodes.push_back(halved(motion));
      moment_.intervals += int(nodes.back().size()) - 1;
    }
    const std::string where = "the mesh of " + std::to_string(moment_.intervals) + " intervals: ";
    try {
      auto program = std::make_unique<PhasedCollocation>(*result_.program, phases_, nodes);
      PhasedSolution fine = optimise(*program, phases_, warm_start(coarse.motions, *program), options());
      note(whole(task_, fine));
      if (!fine.converged()) {
        result_.trouble = where + describe(fine.nlp.status);
        return false;
      }
      fine.derivatives = coarse.derivatives;
      fine.check_seconds += coarse.check_seconds;
      take(std::move(fine));
      result_.program = std::move(program);
    } catch (const Error& e) {  // too large, or without a finite value at the start
      result_.trouble = where + e.what();
      return false;
    }
    return true;
  }

  const Task& task_;
  const Phases phases_;
  const SolveWatch& watch_;
  PhasedSolution found_;
  RefinedSolve result_;
  SolveMoment moment_{SolveStage::kRecording};
  int iterations_ = 0;
  double processor_seconds_ = 0;
};

std::string share(std::size_t done, std::size_t of) {
  return of == 0 ? "" : " piece " + std::to_string(std::min(done + 1, of)) + " of " + std::to_string(of);
}

}  // namespace

std::vector<double> warm_start(const std::vector<Trajectory>& motions, const PhasedCollocation& program) {
  std::vector<Trajectory> finer;
  for (std::size_t k = 0; k < motions.size(); ++k) {
    const Problem& problem = program.phase(k).problem();
    finer.push_back(resampled(problem, motions[k], program.phase(k).times()));
    Trajectory& motion = finer.back();
    still(motion.x.topRows(problem.positions));
    still(motion.x.bottomRows(problem.n_x() - problem.positions));
    still(motion.a);
    still(motion.u);
  }
  std::vector<double> x = program.variables(finer);
  const NlpShape& shape = program.shape();
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::clamp(x[i], shape.x_lower[i], shape.x_upper[i]);
  return x;
}

std::string SolveMoment::text() const {
  const std::string mesh = " on " + std::to_string(intervals) + " intervals" +
                           (refinement ? " (refinement " + std::to_string(refinement) + ")" : "");
  switch (stage) {
    case SolveStage::kRecording:
      return "recording and deriving";
    case SolveStage::kCompiling:
      return "compiling" + share(done, of);
    case SolveStage::kChecking:
      return "checking the derivatives" + mesh;
    case SolveStage::kSolving:
      break;
    case SolveStage::kVerifying:
      return "verifying the motion" + mesh;
  }
  if (!now) return "solving" + mesh;
  return "solving" + mesh + ": iteration " + std::to_string(now->iteration) + ", cost " +
         io::significant(now->objective, 7) + ", violation " + io::scientific(now->primal_infeasibility);
}

bool is_too_coarse(const Solution& solution, const std::vector<LimitExcess>& excesses, const Task& task) {
  const Verification& v = solution.verification;
  if (is_nearly_feasible(solution)) return true;
  if (!solution.converged() || !(v.violation <= task.demands.violation)) return false;
  if (!(v.worst_relative <= task.demands.integration_error)) return true;
  if (!task.demands.limits) return false;
  const auto between = [](const LimitExcess& excess) { return excess.between_points; };
  return !excesses.empty() && std::all_of(excesses.begin(), excesses.end(), between);
}

RefinedSolve solve_refined(const Task& task, const MeshOptions& mesh, const SolveWatch& watch) {
  return Rounds(task, watch).run(mesh);
}

}  // namespace dyntape
