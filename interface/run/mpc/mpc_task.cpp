// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/mpc/mpc_task.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/motion/robot_terms.h>
#include <dyntape/interface/motion/tied/tied_joints.h>
#include <dyntape/interface/run/simulate/scene_plant.h>
#include <dyntape/interface/run/solve/limits.h>
#include <dyntape/interface/run/solve/pictures.h>

namespace dyntape {

namespace {

constexpr const char *kLoopCurves = "closed_loop.svg", *kLoopMotion = "motion.svg";

io::CsvTable loop_table(const Task& task, const ClosedLoop& loop) {
  const Curves c = curves_of(task, loop.motion);
  io::CsvColumns table;
  table.add({"t"}, loop.motion.t.transpose());
  table.add(entry_names_of(task.scene.model, "q.", true), c.q);
  table.add(entry_names_of(task.scene.model, "v.", false), c.v);
  table.add(control_columns(task), c.tau);  // forces as planned
  add_steps(loop, table);
  return table.table();
}

// "", or where a floating base is that is below a height, or leans by more than 60 degrees.
std::string why_fallen(double t, const Eigen::VectorXd& x, double least) {
  const std::string fell = "the robot fell: at " + io::significant(t, 4) + " s its base ";
  const double upright = 1 - 2 * x.segment<2>(3).squaredNorm() / x.segment<4>(3).squaredNorm();
  if (x[2] < least)
    return fell + "is at a height of " + io::significant(x[2], 3) + " m, less than " +
           io::significant(least, 3) + " m";
  return upright < 0.5 ? fell + "leans by more than 60 degrees" : "";
}

// The change of the state by a change of all velocities (all joints).
Eigen::VectorXd own_change(const Task& task, const TiedJoints& tied, const Eigen::VectorXd& v) {
  const int nq = task.scene.model.nq;
  Eigen::VectorXd change = Eigen::VectorXd::Zero(task.problem.n_x());
  change.segment(nq, v.size()) = v;
  return tied.own_x(change);
}

// Null: the plan is the plant, or a stop request came first, so that the loop makes no step.
std::shared_ptr<ScenePlant> plant_of(const Task& task, const std::stop_token& stop) {
  if (!task.control.plant) return nullptr;
  try {
    return std::make_shared<ScenePlant>(*task.control.plant, task.problem.start, stop);
  } catch (const ToolError&) {
    if (!stop.stop_requested()) throw;
    return nullptr;
  }
}

}  // namespace

ControlReport control_task(const Task& task, const std::stop_token& stop,
                           const std::function<void(double t)>& watch) {
  if (!task.closing.empty())
    throw ArgumentError("task \"" + task.name +
                        "\": a controller does not support periodic motions ('periodic')");
  if (!task.phases.empty())
    throw ArgumentError("task \"" + task.name +
                        "\" has phases, which no controller knows; expected a task without, or a file with a "
                        "block 'centroidal'");
  if (task.simulated)
    throw ArgumentError(
        "task \"" + task.name +
        "\": its scene has rigid contacts, whose forces a controller would take for motors; expected a "
        "task without them, or `dyntape solve`");
  const TiedJoints tied(task.scene);
  ClosedLoopOptions options = loop_options(task.control, stop, watch);
  if (const auto plant = plant_of(task, stop)) {
    options.plant = [plant, &tied](Eigen::VectorXd& x, double from, double to, const auto& control) {
      Eigen::VectorXd all = tied.all_x(x);
      const auto moved = plant->move(all, from, to, control);
      x = tied.own_x(all);
      return moved;
    };
  }
  if (task.control.fallen > 0)
    options.is_over = [least = task.control.fallen](double t, const Eigen::VectorXd& x) {
      return why_fallen(t, x, least);
    };
  for (const Task::Control::Disturbance& push : task.control.disturbances) {
    if (!push.frame.empty()) {
      options.disturbances.push_back(
          {push.at, {}, [&task, &tied, push](const Eigen::VectorXd& x) {
             const Eigen::VectorXd q = tied.all_x(x).head(task.scene.model.nq);
             return own_change(task, tied, push.v + struck(task.scene, q, push.frame, push.impulse));
           }});
      continue;
    }
    options.disturbances.push_back({push.at, own_change(task, tied, push.v)});
  }
  options.mpc.mesh = task.optimise.mesh;
  // Along an arm that is stretched towards what it cannot reach, Gauss-Newton's Hessian has no curvature: what bends the
  // arm back is the residual times second derivatives.  Steps are then as long as the limits let them be.
  const bool wants_exact = task.is_out_of_reach && options.mpc.mesh.hessian == HessianKind::kGaussNewton;
  if (wants_exact) options.mpc.mesh.hessian = HessianKind::kExact;
  options.mpc.solver = task.optimise.solver;
  options.mpc.solver.tolerance = std::max(options.mpc.solver.tolerance, 1e-6);
  Off off = {task.aim.what, task.aim.unit, {}};
  if (task.aim.off)
    off.at = [&](const Trajectory& motion, int point) {
      return task.aim.off(motion.t[point], tied.all_x(motion.x.col(point)));
    };
  ControlReport report = report_loop(tracking_problem(task), options, off);
  report.loop.motion = tied.of_all(std::move(report.loop.motion));
  report.task = task.name, report.most_late = task.control.late;
  report.beyond.emplace();
  for (const LimitExcess& excess : limit_excesses(task, report.loop.motion))
    if (excess.of == LimitOf::kRobot) report.beyond->push_back(excess.text());
  if (wants_exact) report.note = "the exact Hessian in place of gauss_newton, as the goal is out of reach";
  return report;
}

std::vector<std::string> control_files() {
  return {kLoopTable, kLoopReport, kLoopCurves, kLoopSteps, kLoopFeedback, kLoopMotion, kLoopPlayer};
}

void write_control(const Task& task, ControlReport& report, const std::string& folder,
                   const std::stop_token& stop) {
  const Trajectory& motion = report.loop.motion;
  const auto pictures = [&] {
    return LoopPictures{{{kLoopCurves, with_pushes(tracking_plot(task, motion), report)},
                         {kLoopMotion, motion_plot(task, motion)}},
                        motion_player(task, motion, stop)};
  };
  write_loop(report, loop_table(task, report.loop), pictures, folder, stop);
}

Eigen::VectorXd struck(const RobotScene& scene, const Eigen::VectorXd& q, const std::string& frame,
                       const Eigen::Vector3d& impulse) {
  const dynamics::Model<double> model = dynamics::acting_model(scene.model, scene.effects);
  dynamics::Data<double> data(model);
  data.following = ties_of(scene).following<double>();
  dynamics::WrenchTorques<double> torques(model);
  std::vector<dynamics::Wrench<double>> push = {
      dynamics::wrench_at_frame<double>(model, moving_frame(model, frame), dynamics::FixedIn::kWorld, {})};
  push.front().value.linear = impulse;
  const Eigen::VectorXd tau = dynamics::wrench_torques<double>(model, data, torques, push, q);
  const Eigen::VectorXd still = Eigen::VectorXd::Zero(model.nv);
  auto weightless = model;
  weightless.gravity.setZero();
  return dynamics::aba<double>(weightless, data, q, still, tau);
}

}  // namespace dyntape
