// SPDX-License-Identifier: BSD-3-Clause
//
// Curves of a task's motion over time.
#include <cmath>

#include <dyntape/interface/report/joints/joint_panels.h>
#include <dyntape/interface/report/plot/curves.h>
#include <dyntape/interface/run/solve/curves.h>
#include <dyntape/interface/run/solve/pictures.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Where the task bounds something, its bounds; elsewhere the robot's.
Bounds or_else(const Bounds& bounds, const Bounds& robot) {
  const auto choose = [](const VectorXd& a, const VectorXd& b) {
    return VectorXd(a.array().isFinite().select(a, b));
  };
  return {choose(bounds.lower, robot.lower), choose(bounds.upper, robot.upper)};
}

// (nq + nv x points) What a controller draws states to, NaN where it does not; without rows where it knows none.
MatrixXd targets_of(const Task& task, const VectorXd& t) {
  if (!task.aim.state) return {};
  MatrixXd targets(task.scene.model.nq + task.scene.model.nv, t.size());
  for (Eigen::Index p = 0; p < t.size(); ++p) targets.col(p) = task.aim.state(t[p]);
  return targets;
}

// Of the frame that a controller draws to a place.
io::Panel place_panel(const Task& task, const Trajectory& motion) {
  const auto& model = task.scene.model;
  dynamics::Data<double> data(model);
  MatrixXd place(3, motion.points());
  for (int p = 0; p < motion.points(); ++p) {
    dynamics::forward_kinematics(model, data, VectorXd(motion.x.col(p).head(model.nq)));
    place.col(p) = frame_placement(model, data, model.frame_index(task.aim.frame)).p;
  }
  std::vector<std::string> names;
  for (const char* axis : {"x", "y", "z"}) names.push_back(axis + (" of " + task.aim.frame));
  io::Panel panel = io::over_time("place of " + task.aim.frame, "[m]", names, motion.t, place);
  add_targets(panel, names, motion.t, task.aim.place.replicate(1, motion.points()));
  return panel;
}

// Bounds of the task, else limits of the robot, each at the joint that has it.
struct DrawnBounds {
  Bounds x, u;
};
DrawnBounds drawn_bounds(const Task& task) {
  Problem robot = task.problem;  // with the robot's limits for bounds
  limit_positions(robot, task.scene);
  limit_velocities(robot, task.scene);
  limit_efforts(robot, task.scene, task.robot.unit);
  DrawnBounds drawn{or_else(task.problem.x, robot.x), or_else(task.problem.u, robot.u)};
  if (task.robot.unit != ControlUnit::kFraction) return drawn;
  const std::vector<int> driven = actuated_dofs(task.scene);
  for (std::size_t k = 0; k < driven.size(); ++k) {
    const double limit = effort_limit(task.scene.model, driven[k]);
    drawn.u.lower[long(k)] *= limit;
    drawn.u.upper[long(k)] *= limit;
  }
  return drawn;
}

io::Plot plot_of_curves(const Task& task, const Trajectory& motion, const MatrixXd& targets) {
  const Curves c = curves_of(task, motion);
  const auto& model = task.scene.model;
  const auto [x, u] = drawn_bounds(task);
  const Eigen::Index nq = targets.rows() > 0 ? model.nq : 0, nv = targets.rows() > 0 ? model.nv : 0;
  io::Plot plot{.title = task.name};
  add_positions(plot, model, motion.t,
                {c.q, x.lower.head(model.nq), x.upper.head(model.nq), targets.topRows(nq)});
  add_velocities(plot, model, motion.t,
                 {c.v, x.lower.tail(model.nv), x.upper.tail(model.nv), targets.bottomRows(nv)});
  const std::vector<int> driven = actuated_dofs(task.scene);
  const std::vector<std::string>& controls = task.problem.controls;
  add_efforts(plot, model, driven, motion.t, {c.tau, u.lower, u.upper},
              {controls.begin() + std::ptrdiff_t(driven.size()), controls.end()});
  arrange_limbs(plot, model);
  return plot;
}

}  // namespace

io::Plot trajectory_plot(const Task& task, const Trajectory& motion) {
  return plot_of_curves(task, motion, {});
}

io::Plot tracking_plot(const Task& task, const Trajectory& motion) {
  io::Plot plot = plot_of_curves(task, motion, targets_of(task, motion.t));
  if (!task.aim.frame.empty()) plot.panels.insert(plot.panels.begin(), place_panel(task, motion));
  return plot;
}

}  // namespace dyntape
