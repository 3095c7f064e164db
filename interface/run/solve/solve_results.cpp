// SPDX-License-Identifier: BSD-3-Clause
//
// The files of a solved task.
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/result_folder.h>
#include <dyntape/interface/robot/robot_scene.h>
#include <dyntape/interface/run/solve/pictures.h>
#include <dyntape/interface/run/solve/solve.h>

namespace dyntape {

namespace {

constexpr const char *kTrajectory = "trajectory.csv", *kIterations = "iterations.csv",
                     *kEffective = "effective.info", *kReport = "report.json", *kCurves = "trajectory.svg",
                     *kMotion = "motion.svg", *kPlayer = "motion.html";

io::CsvTable trajectory_table(const Task& task, const Trajectory& motion) {
  const Curves c = curves_of(task, motion);
  const auto& model = task.scene.model;
  io::CsvColumns table;
  table.add({"t"}, motion.t.transpose());
  table.add(entry_names(model, "q"), c.q);
  table.add(entry_names(model, "v"), c.v);
  table.add(entry_names(model, "a"), c.a);
  table.add(control_columns(task), c.tau);
  return table.table();
}

io::CsvTable iteration_table(const NlpSolution& nlp) {
  io::CsvTable table({"iteration", "objective", "primal_infeasibility", "dual_infeasibility", "barrier",
                      "step_norm", "regularization", "dual_step", "primal_step", "trials", "restoration"});
  for (const IterationRecord& r : nlp.log) {
    table.append({double(r.iteration), r.objective, r.primal_infeasibility, r.dual_infeasibility, r.barrier,
                  r.step_norm, r.regularization, r.dual_step, r.primal_step, double(r.line_search_trials),
                  r.restoration ? 1.0 : 0.0});
  }
  return table;
}

}  // namespace

std::vector<std::string> result_files() {
  return {kTrajectory, kIterations, kEffective, kReport, kCurves, kMotion, kPlayer};
}

void write_results(const Task& task, SolveReport& report, const std::string& folder,
                   const std::stop_token& stop) {
  io::ResultFolder results(folder, report.unwritten);
  const Trajectory& motion = report.solution.motion;
  results.write_table(kTrajectory, trajectory_table(task, motion));
  results.write_table(kIterations, iteration_table(report.solution.nlp));
  const std::string found = "; duration found: " + io::shortest(report.duration()) + " s\n";
  results.write_text(kEffective, task.effective + (report.free_time ? found : ""));
  const auto picture = [&](const char* file, const auto& draw) {
    const std::size_t failures = report.unwritten.size();
    if (!report.interrupted && !stop.stop_requested()) results.write(file, draw);
    if (!report.interrupted && !stop.stop_requested()) return;
    report.interrupted = true;  // who interrupts does not wait for gnuplot
    report.unwritten.resize(failures);
    results.remove(file);
  };
  for (const auto& [file, plot] : {std::pair(kCurves, &trajectory_plot), std::pair(kMotion, &motion_plot)}) {
    picture(file, [&, plot = plot](const std::string& path) {
      io::draw(plot(task, motion), path, "gnuplot", stop);
    });
  }
  picture(kPlayer, [&](const std::string& path) { write_player(motion_player(task, motion, stop), path); });
  results.write_text(kReport, report.json());
}

}  // namespace dyntape
