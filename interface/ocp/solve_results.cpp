// SPDX-License-Identifier: BSD-3-Clause
//
// The files and pictures of a solved task.
#include <algorithm>
#include <cmath>
#include <set>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/io/file.h>
#include <dyntape/interface/io/picture.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/ocp/joint_values.h>
#include <dyntape/interface/ocp/solve.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;

// Positions, velocities, accelerations and driving torques in physical units, (joints or controls x points).
struct Curves {
  MatrixXd q, v, a, tau;
};

Curves curves_of(const Task& task, const Trajectory& motion) {
  const int n = task.scene.model.nv;
  Curves c{motion.x.topRows(n), motion.x.bottomRows(n), MatrixXd(n, motion.points()), motion.u};
  for (int p = 0; p < motion.points(); ++p) {
    c.a.col(p) = task.problem.ode(Stage<double>{motion.t[p], motion.x.col(p), {}, motion.u.col(p)}).tail(n);
  }
  if (task.robot.unit == ControlUnit::kPhysical) return c;
  const std::vector<int> dofs = actuated_dofs(task.scene);
  for (std::size_t k = 0; k < dofs.size(); ++k) {
    c.tau.row(long(k)) *= task.scene.model.joints[std::size_t(dofs[k])].limits.effort;
  }
  return c;
}

std::vector<std::string> driven_names(const Task& task) {
  std::vector<std::string> names;
  for (int dof : actuated_dofs(task.scene)) names.push_back(task.scene.model.joints[std::size_t(dof)].name);
  return names;
}

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
    for (const MatrixXd* part : {&c.q, &c.v, &c.a, &c.tau}) {
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

// "rad", "m" or "rad, m".
std::string unit(const Task& task, const std::vector<int>& dofs, const char* rotation,
                 const char* translation) {
  bool turns = false, slides = false;
  for (int dof : dofs) {
    const bool prismatic = task.scene.model.joints[std::size_t(dof)].type == dynamics::JointType::kPrismatic;
    (prismatic ? slides : turns) = true;
  }
  if (turns && slides) return std::string(rotation) + ", " + translation;
  return turns ? rotation : translation;
}

// Limits that the curves come near to; far ones would only squeeze the picture.
std::vector<io::ReferenceLine> near_limits(const MatrixXd& curves,
                                           const std::vector<std::pair<double, double>>& limits) {
  std::set<double> shown;
  for (Eigen::Index i = 0; i < curves.rows(); ++i) {
    const auto& [lower, upper] = limits[std::size_t(i)];
    if (!std::isfinite(lower) || !std::isfinite(upper)) continue;
    if (curves.row(i).maxCoeff() > lower + 0.75 * (upper - lower)) shown.insert(upper);
    if (curves.row(i).minCoeff() < upper - 0.75 * (upper - lower)) shown.insert(lower);
  }
  std::vector<io::ReferenceLine> lines;
  for (double value : shown) lines.push_back({value, lines.empty() ? "limit" : ""});
  return lines;
}

io::Panel panel(const std::string& title, const std::string& y_label, const std::vector<std::string>& names,
                const Trajectory& motion, const MatrixXd& curves, std::vector<io::ReferenceLine> lines) {
  io::Panel p{.title = title, .x_label = "time [s]", .y_label = y_label, .horizontal = std::move(lines)};
  const std::vector<double> t(motion.t.begin(), motion.t.end());
  for (Eigen::Index i = 0; i < curves.rows(); ++i) {
    io::Series series{.name = names[std::size_t(i)], .x = t};
    const Eigen::VectorXd row = curves.row(i);
    series.y.assign(row.begin(), row.end());
    p.series.push_back(std::move(series));
  }
  return p;
}

io::Plot trajectory_plot(const Task& task, const Trajectory& motion, const Curves& c) {
  const std::vector<std::string> joints = joint_names(task.scene.model);
  const std::vector<int> driven = actuated_dofs(task.scene);
  std::vector<int> all;
  std::vector<std::pair<double, double>> positions, velocities, efforts;
  for (const auto& joint : task.scene.model.joints) {
    all.push_back(joint.idx_v);
    positions.emplace_back(joint.limits.lower, joint.limits.upper);
    velocities.emplace_back(-joint.limits.velocity, joint.limits.velocity);
  }
  for (int dof : driven) {
    const double limit = task.scene.model.joints[std::size_t(dof)].limits.effort;
    efforts.emplace_back(-limit, limit);
  }
  const std::string angle = unit(task, all, "rad", "m"), speed = unit(task, all, "rad/s", "m/s");
  const std::string torque = unit(task, driven, "N m", "N");
  io::Plot plot;
  plot.title = task.name;
  plot.panels = {
      panel("position", "q [" + angle + "]", joints, motion, c.q, near_limits(c.q, positions)),
      panel("velocity", "v [" + speed + "]", joints, motion, c.v, near_limits(c.v, velocities)),
      panel("drive", "tau [" + torque + "]", driven_names(task), motion, c.tau, near_limits(c.tau, efforts))};
  return plot;
}

// World to picture.  Oblique: z upwards, x to the right, y backwards at half length.
std::array<double, 2> project(View view, const Eigen::Vector3d& p) {
  switch (view) {
    case View::kXz:
      return {p.x(), p.z()};
    case View::kXy:
      return {p.x(), p.y()};
    case View::kYz:
      return {p.y(), p.z()};
    case View::kOblique:
      break;
  }
  const double depth = 0.5 * std::sqrt(0.5);
  return {p.x() + depth * p.y(), p.z() + depth * p.y()};
}

// Bones of the robot: from each body's origin to the joints and frames that it carries.
std::vector<io::Polyline> bones(const Task& task, const dynamics::Data<double>& data) {
  const auto& model = task.scene.model;
  std::vector<io::Polyline> parts;
  const auto add = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    if ((to - from).norm() > 1e-6) parts.push_back({project(task.view, from), project(task.view, to)});
  };
  for (int i = 0; i < model.njoints(); ++i) {
    const int parent = model.parent[std::size_t(i)];
    // A slider on the world stands for its rail, which is no part of the robot.
    if (parent < 0 && model.joints[std::size_t(i)].type == dynamics::JointType::kPrismatic) continue;
    const Eigen::Vector3d origin = data.X_WB[std::size_t(i)].p;
    add(parent < 0 ? Eigen::Vector3d::Zero() : data.X_WB[std::size_t(parent)].p, origin);
  }
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    const int body = model.frames[f].body;
    if (body < 0) continue;
    add(data.X_WB[std::size_t(body)].p, frame_placement(model, data, int(f)).p);
  }
  return parts;
}

io::Plot motion_plot(const Task& task, const Trajectory& motion) {
  const auto& model = task.scene.model;
  dynamics::Data<double> data(model);
  constexpr std::pair<const char*, const char*> kAxes[] = {
      {"x [m]", "z [m]"}, {"x [m]", "y [m]"}, {"y [m]", "z [m]"}, {"x, y aslant [m]", "z [m]"}};
  io::Motion picture{.title = task.name};
  picture.x_label = kAxes[int(task.view)].first;
  picture.y_label = kAxes[int(task.view)].second;
  for (const std::string& name : task.traces) picture.traces.push_back({name, {}});
  for (int p = 0; p < motion.points(); ++p) {
    dynamics::forward_kinematics(model, data, Eigen::VectorXd(motion.x.col(p).head(model.nv)));
    picture.frames.push_back({motion.t[p], bones(task, data)});
    for (io::Trace& trace : picture.traces) {
      const int frame = model.frame_index(trace.name);
      trace.points.push_back(project(task.view, frame_placement(model, data, frame).p));
    }
  }
  io::Plot plot;
  plot.panels = {io::motion_panel(picture)};
  return plot;
}

}  // namespace

std::string write_results(const Task& task, const SolveReport& report, const std::string& folder) {
  const Trajectory& motion = report.solution.motion;
  const Curves curves = curves_of(task, motion);
  const bool finite =
      curves.q.allFinite() && curves.v.allFinite() && curves.a.allFinite() && curves.tau.allFinite();
  const io::NonFinite policy = finite ? io::NonFinite::kRefuse : io::NonFinite::kAllow;
  io::write_csv(folder + "/trajectory.csv", trajectory_table(task, motion, curves), policy);
  io::write_csv(folder + "/iterations.csv", iteration_table(report.solution.nlp), io::NonFinite::kAllow);
  io::write_file_atomically(folder + "/effective.info", task.effective);
  io::write_file_atomically(folder + "/report.json", report.json());
  try {
    io::draw(trajectory_plot(task, motion, curves), folder + "/trajectory.svg");
    io::draw(motion_plot(task, motion), folder + "/motion.svg");
  } catch (const ToolError& e) {
    return e.what();
  }
  return "";
}

}  // namespace dyntape
