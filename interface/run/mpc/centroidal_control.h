// SPDX-License-Identifier: BSD-3-Clause
//
// Runs the closed loop of a centroidal task, and writes its results.
//
//   const CentroidalTask task = read_centroidal_task("config/control/solo12_pushed.info");
//   ControlReport report = control_task(task);
//   write_control(task, report, "out");
//
// write_control writes: closed_loop.csv (t, c.*, v.*, k.*, f.* with the actual contact forces, and for each step ms,
// iterations, usable), report.json, closed_loop.svg, support.svg (paths of the centre of mass, capture point and
// centre of pressure over the support polygons), steps.svg, motion.html (the robot with this centre of mass, by
// standing.h).
//
// Errors.  Those of close_loop.
#pragma once

#include <dyntape/interface/files/task/centroidal_task.h>
#include <dyntape/interface/run/mpc/control_report.h>

namespace dyntape {

ControlReport control_task(const CentroidalTask& task, const std::stop_token& stop = {},
                           const std::function<void(double t)>& watch = {});

std::vector<std::string> centroidal_files();
void write_control(const CentroidalTask& task, ControlReport& report, const std::string& folder,
                   const std::stop_token& stop = {});

}  // namespace dyntape
