// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/mpc/centroidal_control.h>

#include <dyntape/interface/run/mpc/centroidal_pictures.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

constexpr const char *kMassCurves = "closed_loop.svg", *kMassSupport = "support.svg";

io::CsvTable mass_table(const CentroidalTask& task, const ClosedLoop& loop) {
  io::CsvColumns table;
  table.add({"t"}, loop.motion.t.transpose());
  table.add(task.problem.states, loop.motion.x);
  table.add(task.problem.controls, forces_on_floor(task, loop.motion));
  add_steps(loop, table);
  return table.table();
}

}  // namespace

ControlReport control_task(const CentroidalTask& task, const std::stop_token& stop,
                           const std::function<void(double t)>& watch) {
  ClosedLoopOptions options = loop_options(task.control, stop, watch);
  for (const Task::Control::Disturbance& push : task.control.disturbances) {
    VectorXd change = VectorXd::Zero(task.problem.n_x());
    change.segment<3>(3) = push.impulse / task.body.mass;
    options.disturbances.push_back({push.at, change});
  }
  options.mpc.mesh = task.optimise.mesh;
  options.mpc.solver = task.optimise.solver;
  const auto off = [&](const Trajectory& motion, int point) {
    return (motion.x.col(point).head<3>() - wanted_mass(task, motion.t[point])).norm();
  };
  ControlReport report = report_loop(task.problem, options, {"the goal of the centre of mass", "m", off});
  report.task = task.name, report.most_late = task.control.late;
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
