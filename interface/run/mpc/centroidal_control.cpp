// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/mpc/centroidal_control.h>

#include <dyntape/interface/run/mpc/centroidal_pictures.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

constexpr const char *kMassCurves = "closed_loop.svg", *kMassSupport = "support.svg";

io::CsvTable mass_table(const CentroidalTask& task, const ClosedLoop& loop) {
  std::vector<std::string> header = {"t"};
  for (const auto* names : {&task.problem.states, &task.problem.controls})
    header.insert(header.end(), names->begin(), names->end());
  for (const std::string& name : step_columns()) header.push_back(name);
  io::CsvTable table(header);
  const Eigen::MatrixXd forces = forces_on_floor(task, loop.motion);
  for (int p = 0; p < loop.motion.points(); ++p) {
    std::vector<double> row = {loop.motion.t[p]};
    for (double value : loop.motion.x.col(p)) row.push_back(value);
    for (double value : forces.col(p)) row.push_back(value);
    for (double value : step_values(loop, p)) row.push_back(value);
    table.append(row);
  }
  return table;
}

}  // namespace

ControlReport control_task(const CentroidalTask& task, const std::stop_token& stop,
                           const std::function<void(double t)>& watch) {
  ClosedLoopOptions options{.seconds = task.control.seconds,
                            .period = task.control.period,
                            .delay = task.control.delay,
                            .feedback = task.control.feedback,
                            .stop = stop,
                            .watch = watch};
  for (const Task::Control::Disturbance& push : task.control.disturbances) {
    VectorXd change = VectorXd::Zero(task.problem.n_x());
    change.segment<3>(3) = push.v;
    options.disturbances.push_back({push.at, change});
  }
  options.mpc.mesh = task.mesh;
  options.mpc.solver = task.solver;
  options.mpc.iterations = task.control.iterations;
  options.mpc.violation = task.control.violation;
  const auto off = [&](const Trajectory& motion, int point) {
    return (motion.x.col(point).head<3>() - wanted_mass(task, motion.t[point])).norm();
  };
  ControlReport report = report_loop(task.problem, options, {"the goal of the centre of mass", "m", off});
  report.task = task.name;
  report.most_late = task.control.late;
  return report;
}

std::vector<std::string> centroidal_files() {
  return {kLoopTable, kLoopReport, kMassCurves, kMassSupport, kLoopSteps, kLoopFeedback, kLoopPlayer};
}

void write_control(const CentroidalTask& task, ControlReport& report, const std::string& folder,
                   const std::stop_token& stop) {
  const Trajectory& motion = report.loop.motion;
  const auto pictures = [&] {
    return LoopPictures{{{kMassCurves, with_pushes(mass_plot(task, motion), report)},
                         {kMassSupport, support_plot(task, motion)}},
                        mass_player(task, motion, stop)};
  };
  write_loop(report, mass_table(task, report.loop), pictures, folder, stop);
}

}  // namespace dyntape
