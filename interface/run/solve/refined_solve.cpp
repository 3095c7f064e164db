// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/solve/refined_solve.h>

#include <algorithm>
#include <cmath>
#include <set>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/nlp/scaled_nlp.h>
#include <dyntape/interface/files/task/task_phases.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/run/solve/solve_rounds.h>

namespace dyntape {

namespace {

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

// Of footholds below the floor.
std::vector<LimitExcess> sunken(const Task& task, const Solution& solution) {
  std::vector<LimitExcess> excesses;
  for (const SunkenFoothold& foot : sunken_footholds(task)) {
    LimitExcess excess{"foothold", foot.frame, "m", foot.z, foot.floor, solution.phases[foot.phase].begin};
    excess.of = LimitOf::kFloor;
    excesses.push_back(excess);
  }
  return excesses;
}

// The worst of all phases for each joint and quantity, then footholds below the floor.  Violations of the task's rows
// between points count too.
std::vector<LimitExcess> excesses_of(const Task& task, const Solution& solution) {
  std::vector<LimitExcess> all;
  const std::vector<const Task*> parts = parts_of(task);
  const auto beyond = [](const LimitExcess& e) { return std::abs(e.value - e.limit); };
  const auto is_same = [](const LimitExcess& a, const LimitExcess& b) {
    return a.quantity == b.quantity && a.joint == b.joint;
  };
  for (std::size_t k = 0; k < parts.size(); ++k) {
    for (LimitExcess excess : limit_excesses(*parts[k], solution.phases[k].motion)) {
      excess.time += solution.phases[k].begin;
      const auto before =
          std::find_if(all.begin(), all.end(), [&](const LimitExcess& e) { return is_same(e, excess); });
      if (before == all.end())
        all.push_back(excess);
      else if (beyond(excess) > beyond(*before))
        *before = excess;
    }
  }
  const std::vector<LimitExcess> feet = sunken(task, solution);
  all.insert(all.end(), feet.begin(), feet.end());
  return all;
}

// Names of variables and rows at a bound.
std::vector<std::string> active_names(StagedNlp& nlp, const NlpSolution& solution) {
  ScaledNlp scaled(nlp, solution.units);
  const ActiveBounds active = active_bounds(scaled, scaled.in_scaled_units(solution));
  std::vector<std::string> names;
  std::set<std::string> seen;
  for (std::size_t i : active.variables) {  // a free duration is one variable a point
    const std::string name = nlp.variable_name(i);
    if (seen.insert(name).second) names.push_back(name);
  }
  for (std::size_t j : active.rows) names.push_back(nlp.constraint_name(j));
  return names;
}

class Rounds : SolveRounds {
 public:
  Rounds(const Task& task, const SolveWatch& watch) : SolveRounds(task, watch) {}

  SolveReport run(const MeshOptions& mesh) {
    build(mesh);
    if (task_.simulated)
      solve_continued();
    else
      solve_from(program_->start());
    report_.solution.meshes = report_.meshes;
    refine(program_, report_.solution, steps());
    report_.build = build_report();
    report_.sizes = sizes_of(program_->program(), program_->shape());
    report_.active = active_names(*program_, report_.solution.nlp);
    report_.refinement_trouble = report_.solution.refinement_trouble;
    report_.solution = of_all_joints(std::move(report_.solution));
    return std::move(report_);
  }

 private:
  void solve_from(const std::vector<double>& start) {
    take(optimise(*program_, start, options()));
    if (report_.solution.nlp.log.empty()) check_not_stopped();
    note(report_.solution);
  }

  // Rigid contacts with decreasing relaxation.  A failed solve may still lead to the next.
  void solve_continued() {
    std::vector<double> from = program_->start();
    for (const Parameters& now : contact_continuation(task_.problem, task_.continuation)) {
      program_->set_parameters(now);
      relaxation_ = now.find(kContactRelaxation)(program_->problem().stage(0, {}, {}, {}))[0];
      solve_from(from);
      const bool is_spent = iterations_ >= task_.optimise.solver.max_iterations ||
                            processor_seconds_ >= task_.optimise.solver.max_seconds;
      if (is_spent || watch_.stop.stop_requested()) return;
      from = report_.solution.nlp.x;
    }
  }

  void build(const MeshOptions& mesh) {
    std::vector<MeshOptions> meshes = meshes_of(task_, mesh);
    moment_.intervals = 0;
    for (const MeshOptions& own : meshes)
      moment_.intervals += own.nodes.empty() ? own.intervals : int(own.nodes.size()) - 1;
    for (MeshOptions& own : meshes) watch_compilers(own.evaluation);
    tell(SolveStage::kRecording);
    try {
      program_ = std::make_unique<StagedNlp>(discretize(phases_of(task_), meshes));
      if (task_.simulated) check_contacts_at_start(task_, watch_.stop);
    } catch (const ToolError&) {
      if (!watch_.stop.stop_requested()) throw;
    }
    check_not_stopped();
    record_seconds_ = program_->build().seconds.record;
  }

  // The functions at the end, on any mesh.
  BuildReport build_report() const {
    BuildReport report = program_->build();
    report.seconds.record = record_seconds_;
    return report;
  }

  // Limits of iterations and time hold for all meshes together.
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
    options.solver.max_seconds = seconds_left(options.solver, processor_seconds_);
    options.solver.stop_when_settled = task_.demands.refinements > 0 && !task_.simulated;
    options.demands = task_.demands;
    options.check_derivatives = options.check_derivatives && report_.meshes.empty();
    return options;
  }

  void take(Solution solution) {
    report_.solution = std::move(solution);
    look_at(report_.solution);
  }

  // Of a fine mesh the limits between points take seconds: who interrupts does not wait for them.
  void look_at(const Solution& solution) {
    report_.are_limits_checked = !watch_.stop.stop_requested();
    report_.excesses.clear();
    if (!report_.are_limits_checked) return;
    const Solution all = of_all_joints(solution);
    report_.excesses = excesses_of(task_, all);
    if (task_.simulated) report_.simulated = simulate_contacts(task_, all.motion, relaxation_, watch_.stop);
  }

  void note(const Solution& s) {
    processor_seconds_ += s.nlp.times.processor;
    SolveRounds::note(s, s.check_seconds + s.nlp.times.total + s.verify_seconds, relaxation_);
  }

  // With shorter steps contacts come closer before they touch, and forces act longer at a distance.
  void shrink_relaxation(StagedNlp& finer) {
    constexpr double kPart = 0.25;
    relaxation_ *= kPart;
    Parameters now = finer.problem().parameters;
    now.set(kContactRelaxation, relaxation_);
    finer.set_parameters(now);
  }

  RefineSteps steps() {
    RefineSteps steps;
    steps.refinements = task_.demands.refinements;
    steps.most_intervals = kMostIntervals;
    steps.options = [this] { return options(); };
    steps.add_faults = [this](const Solution& s, MeshFaults& faults) { add_faults(s, faults); };
    if (task_.simulated) steps.prepare = [this](StagedNlp& finer) { shrink_relaxation(finer); };
    steps.begin = [this](int intervals) { ++moment_.refinement, moment_.intervals = intervals; };
    steps.solved = [this](const Solution& s) {
      note(s);
      if (s.converged() || s.nlp.status == SolveStatus::kSettled) look_at(s);
    };
    return steps;
  }

  // Limits and clearances exceeded between points, and contacts that the scene's simulation does not confirm.
  void add_faults(const Solution& s, MeshFaults& faults) const {
    if (!report_.simulates())
      for (Eigen::VectorXd& of_phase : faults) of_phase.setConstant(kAtFault);
    if (!task_.demands.limits || report_.excesses.empty()) return;
    const auto between = [](const LimitExcess& excess) { return excess.between_points; };
    if (!std::all_of(report_.excesses.begin(), report_.excesses.end(), between)) return;
    for (const LimitExcess& excess : report_.excesses) {
      for (std::size_t k = 0; k < s.phases.size(); ++k) {
        const SolvedPhase& phase = s.phases[k];
        const std::vector<double> nodes = phase.motion.nodes();
        const double t = excess.time - phase.begin;
        if (t < 0 || t > phase.duration()) continue;
        const auto next = std::upper_bound(nodes.begin(), nodes.end(), t);
        const auto interval =
            std::clamp<std::ptrdiff_t>(next - nodes.begin() - 1, 0, phase.motion.intervals() - 1);
        faults[k][interval] = std::max(faults[k][interval], kAtFault);
      }
    }
  }

  static constexpr int kMostIntervals = 100000;
  static constexpr double kAtFault = 2;  // relative to the demand: the interval is halved

  std::unique_ptr<StagedNlp> program_;
  double processor_seconds_ = 0, record_seconds_ = 0, relaxation_ = 0;
};

// "compiling piece 3 of 12, about 8 s left".
std::string compiling_text(const SolveMoment& at) {
  std::string text = "compiling";
  if (at.of > 0)
    text += " piece " + std::to_string(std::min(at.done + 1, at.of)) + " of " + std::to_string(at.of);
  if (at.seconds_left >= 1) text += ", about " + io::with_groups(std::size_t(at.seconds_left)) + " s left";
  return text;
}

}  // namespace

std::vector<const Task*> parts_of(const Task& task) {
  std::vector<const Task*> parts;
  for (const Task& phase : task.parts) parts.push_back(&phase);
  if (parts.empty()) parts.push_back(&task);
  return parts;
}

SolveSizes sizes_of(const StagedProgram& program, const NlpShape& shape) {
  SolveSizes sizes{shape.n(), shape.m(), shape.jacobian.nnz(), shape.hessian.nnz()};
  for (const StagedPhase& phase : program.phases) {
    sizes.points += phase.points;
    sizes.operations = std::max(sizes.operations, total_operations(dissolved(phase.stage.node)));
  }
  return sizes;
}

std::string SolveMoment::text() const {
  const std::string mesh = " on " + std::to_string(intervals) + " intervals" +
                           (refinement ? " (refinement " + std::to_string(refinement) + ")" : "");
  switch (stage) {
    case SolveStage::kRecording:
      return "recording and deriving";
    case SolveStage::kCompiling:
      return compiling_text(*this);
    case SolveStage::kChecking:
      return "checking the derivatives" + mesh;
    case SolveStage::kSolving:
      break;
    case SolveStage::kVerifying:
      return "verifying the motion" + mesh;
  }
  if (!now) return "solving" + mesh;
  return "solving" + mesh + ": iteration " + std::to_string(now->iteration) + ", cost " +
         io::significant(now->objective, 7) + ", violation " + io::scientific(now->primal_infeasibility) +
         (done < of ? "; " + compiling_text(*this) : "");
}

SolveReport solve_refined(const Task& task, const MeshOptions& mesh, const SolveWatch& watch) {
  return Rounds(task, watch).run(mesh);
}

}  // namespace dyntape
