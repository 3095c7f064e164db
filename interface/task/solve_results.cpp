// SPDX-License-Identifier: BSD-3-Clause
//
// The files of a solved task.
#include <cstdio>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/io/file.h>
#include <dyntape/interface/task/joint_values.h>
#include <dyntape/interface/task/pictures.h>
#include <dyntape/interface/task/solve.h>

namespace dyntape {

namespace {

constexpr const char *kTrajectory = "trajectory.csv", *kIterations = "iterations.csv",
                     *kEffective = "effective.info", *kReport = "report.json", *kCurves = "trajectory.svg",
                     *kMotion = "motion.svg";

io::CsvTable trajectory_table(const Task& task, const Trajectory& motion, const Curves& c) {
  std::vector<std::string> header = {"t"};
  const std::vector<std::string> joints = joint_names(task.scene.model);
  for (const char* prefix : {"q.", "v.", "a."}) {
    for (const std::string& joint : joints) header.push_back(prefix + joint);
  }
  for (const std::string& joint : driven_names(task)) header.push_back("tau." + joint);
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
  return {kTrajectory, kIterations, kEffective, kReport, kCurves, kMotion};
}

std::string write_results(const Task& task, const SolveReport& report, const std::string& folder) {
  const auto in = [&](const char* file) { return folder + "/" + file; };
  const Trajectory& motion = report.solution.motion;
  const Curves curves = curves_of(task, motion);
  const bool finite =
      curves.q.allFinite() && curves.v.allFinite() && curves.a.allFinite() && curves.tau.allFinite();
  const io::NonFinite policy = finite ? io::NonFinite::kRefuse : io::NonFinite::kAllow;
  io::write_csv(in(kTrajectory), trajectory_table(task, motion, curves), policy);
  io::write_csv(in(kIterations), iteration_table(report.solution.nlp), io::NonFinite::kAllow);
  io::write_file_atomically(in(kEffective), task.effective);
  io::write_file_atomically(in(kReport), report.json());
  if (report.interrupted) {  // who interrupts does not wait for gnuplot, and is not shown another motion
    for (const char* picture : {kCurves, kMotion}) std::remove(in(picture).c_str());
    return "";
  }
  try {
    io::draw(trajectory_plot(task, motion), in(kCurves));
    io::draw(motion_plot(task, motion), in(kMotion));
  } catch (const ToolError& e) {
    return e.what();
  }
  return "";
}

}  // namespace dyntape
