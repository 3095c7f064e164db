// SPDX-License-Identifier: BSD-3-Clause
//
// The files of a solved task.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/csv.h>
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
  std::vector<std::string> header = {"t"};
  for (const char* block : {"q", "v", "a"}) {
    const std::vector<std::string> names = entry_names(task.scene.model, block);
    header.insert(header.end(), names.begin(), names.end());
  }
  for (const std::string& control : task.problem.controls)  // torques "u.elbow", forces "f.rotor"
    header.push_back(control.starts_with("u.") ? "tau." + control.substr(2) : control);
  io::CsvTable table(header);
  std::vector<double> row;
  for (int p = 0; p < motion.points(); ++p) {
    row.assign(1, motion.t[p]);
    for (const Eigen::MatrixXd* part : {&c.q, &c.v, &c.a, &c.tau}) {
      for (Eigen::Index i = 0; i < part->rows(); ++i) row.push_back((*part)(i, p));
    }
    table.append(row);
  }
  return table;
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
  const auto csv = [&](const char* file, const io::CsvTable& table) {
    results.write(file, [&](const std::string& path) { io::write_csv(path, table, io::NonFinite::kAllow); });
  };
  const auto text = [&](const char* file, const std::string& text) {
    results.write(file, [&](const std::string& path) { write_file_atomically(path, text); });
  };
  const Trajectory& motion = report.solution.motion;
  csv(kTrajectory, trajectory_table(task, motion));
  csv(kIterations, iteration_table(report.solution.nlp));
  const std::string found = "; duration found: " + io::shortest(report.duration()) + " s\n";
  text(kEffective, task.effective + (report.free_time ? found : ""));
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
  text(kReport, report.json());
}

}  // namespace dyntape
