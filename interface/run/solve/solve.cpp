// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/solve/solve.h>

#include <cstdio>
#include <thread>

#include <dyntape/interface/files/task/task_phases.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/run/simulate/effect_costs.h>
#include <dyntape/interface/run/solve/refined_solve.h>

namespace dyntape {

namespace {

MeshOptions mesh_of(const Task& task) {
  MeshOptions mesh = task.optimise.mesh;
  if (!task.models.model_folder.empty()) mesh.evaluation.cache_folder = task.models.model_folder;
  mesh.evaluation.force_rebuild = mesh.evaluation.force_rebuild || task.models.recompile_libraries;
  return mesh;
}

// Iterations start with machine code while functions are compiled, if the libraries were not requested.
// One core is reserved for the solver.
void begin_at_once(const Task& task, CodegenOptions& options) {
  if (options.route != Route::kAutomatic || options.force_rebuild || !task.models.model_folder.empty())
    return;
  options.route = Route::kTiered;
  const unsigned cores = std::thread::hardware_concurrency();
  if (options.jobs == 0 && cores > 1) options.jobs = cores - 1;
}

// For a solve that ends before its compiler, unless it ends at once.
void note_unfinished(SolveReport& report) {
  constexpr double kSoon = 2;  // s
  const SolveTimes times = report.times();
  const double evaluating = times.functions + times.jacobian + times.hessian;
  if (report.build.unfinished == 0 || !(evaluating > kSoon)) return;
  report.notes.push_back(
      "the solve ended before its functions were compiled, so they are not kept: where it is to be solved "
      "often, evaluation.route "
      "compiled compiles them first");
}

std::size_t dynamics_operations(const RobotScene& scene, const RobotProblemOptions& options) {
  return total_operations(dissolved(record_stage(robot_problem(scene, options)).node));
}

// The output of verboseCppAd.
void say(const Task& task, const BuildReport& build) {
  std::fprintf(stderr,
               "dyntape: task \"%s\": %d functions compiled in %.3f s, %d from the cache, %d as machine "
               "code, %d interpreted\n",
               task.name.c_str(), build.compiled, build.seconds.total() - build.seconds.record,
               build.from_cache, build.machine_code, build.interpreted);
  for (const std::string& source : build.sources) std::fprintf(stderr, "dyntape:   %s\n", source.c_str());
}

std::string program_text(const Task& task) {
  MeshOptions mesh = mesh_of(task);
  mesh.evaluation.route = Route::kInterpreter;  // counting needs no compilation
  const StagedNlp nlp = discretize(phases_of(task), meshes_of(task, mesh));
  const SolveSizes sizes = sizes_of(nlp.program(), nlp.shape());
  int intervals = 0;
  for (const Task* part : parts_of(task)) intervals += part->optimise.mesh.intervals;
  std::string text =
      "\nOne point with its costs and constraints: " + io::with_groups(sizes.operations) + " operations\n";
  text += "Program (" + task.optimise.mesh.scheme.name + ", " + std::to_string(intervals) + " intervals, " +
          io::with_groups(sizes.points) + " points): " + io::with_groups(sizes.variables) + " variables, " +
          io::with_groups(sizes.constraints) + " constraints, " + io::with_groups(sizes.jacobian) +
          " non-zeros of the Jacobian, " + io::with_groups(sizes.hessian) + " of the Hessian\n";
  return text;
}

std::string steps_text(const Task& task) {
  const std::size_t operations =
      total_operations(dissolved(record_shooting(tracking_problem(task), shooting_scheme(task)).step));
  return "\nDifferential dynamic programming: " + std::to_string(task.optimise.mesh.intervals) +
         " steps of " + io::with_groups(operations) + " operations with their costs\n";
}

// The operations that each effect adds to the dynamics with all effects.
std::string effects_text(const Task& task, std::size_t all) {
  io::TextTable table({{"effect"}, {"acts"}, {"operations it adds", "", io::Align::kRight}});
  RobotScene without = task.scene;
  dynamics::for_each_effect(without.effects, [&](auto& effect) {
    if (!effect) return table.append({dynamics::effect_name(effect), "no", "not recorded"});
    const auto kept = effect;
    effect.reset();
    const std::size_t added = all - dynamics_operations(without, task.robot);
    effect = kept;
    table.append({dynamics::effect_name(effect), "yes", io::with_groups(added)});
  });
  return table.text();
}

}  // namespace

SolveReport solve_task(const Task& task, const SolveWatch& watch) {
  MeshOptions mesh = mesh_of(task);
  begin_at_once(task, mesh.evaluation);
  SolveReport report = task.by_ddp ? solve_by_steps(task, mesh, watch) : solve_refined(task, mesh, watch);
  report.task = task.name;
  report.notes = task.notes;
  for (const std::string& sentence : unmet_demands(task))
    if (sentence != task.unreachable) report.notes.push_back(told_of(task) + ": " + sentence);
  note_unfinished(report);
  report.robot = task.scene.model.name;
  report.expected = task.expected;
  report.demands = task.demands;
  if (task.phases.empty()) report.free_time = task.problem.free_time;
  if (task.models.verbose) say(task, report.build);
  report.has_soft_goal = task.has_soft_goal;
  report.unreachable = task.unreachable;
  report.open_loop_unit = unit_of_state(task.scene.model, report.solution.verification.miss_index);
  // A stop request after the end changes nothing.
  report.interrupted = watch.stop.stop_requested() && !report.success();
  return report;
}

std::string explain(const Task& task) {
  const RobotScene& scene = task.scene;
  std::string text =
      "Task \"" + task.name + "\" (" + task.file + ")\n" + robot_text(scene, task.urdf, task.notes);
  const std::size_t all = dynamics_operations(scene, task.robot);
  text += "\nDynamics, " + std::string(task.robot.form == DynamicsForm::kForward ? "forward" : "inverse") +
          " form: " + io::with_groups(all) + " operations\n\n";
  text += effects_text(task, all);
  text += task.by_ddp ? steps_text(task) : program_text(task);
  text += "\nThe task as it was understood:\n\n" + task.effective;
  return text;
}

}  // namespace dyntape
