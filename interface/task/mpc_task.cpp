// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/task/mpc_task.h>

#include <nlohmann/json.hpp>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/result_folder.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/scene/joint_values.h>
#include <dyntape/interface/task/pictures.h>

namespace dyntape {

namespace {

constexpr const char *kLoop = "closed_loop.csv", *kLoopReport = "report.json",
                     *kLoopCurves = "closed_loop.svg", *kSteps = "steps.svg", *kLoopMotion = "motion.svg",
                     *kLoopPlayer = "motion.html";

// Without what has to be so at the end of the horizon.
Problem endless(const Task& task) {
  Problem problem = task.problem;
  const auto draws = [](const Term& term) { return term.name.find("tracking") != std::string::npos; };
  if (std::none_of(problem.terms.begin(), problem.terms.end(), draws))
    throw ArgumentError(
        "task \"" + task.name +
        "\": nothing draws it to its goal, which a controller does not demand; expected weights in "
        "costs.tracking");
  problem.goal.setConstant(Problem::kFree);
  std::erase_if(problem.terms, [](const Term& term) {
    return term.where == Where::kTerminal && (term.role == Role::kEquality || term.role == Role::kInequality);
  });
  return problem;
}

double distance_to_goal(const Task& task, const Eigen::VectorXd& x) {
  const Eigen::VectorXd away = (x - task.problem.goal).head(task.scene.model.nv);
  return away.array().isNaN().select(0, away).norm();
}

io::CsvTable loop_table(const Task& task, const ClosedLoop& loop) {
  const Curves c = curves_of(task, loop.motion);
  std::vector<std::string> header = {"t"};
  const std::vector<std::string> joints = joint_names(task.scene.model);
  for (const char* prefix : {"q.", "v."}) {
    for (const std::string& joint : joints) header.push_back(prefix + joint);
  }
  for (const std::string& joint : driven_names(task.scene)) header.push_back("tau." + joint);
  for (const char* name : {"step_ms", "iterations", "usable"}) header.push_back(name);
  io::CsvTable table(header);
  for (int p = 0; p < loop.motion.points(); ++p) {
    std::vector<double> row = {loop.motion.t[p]};
    for (const Eigen::MatrixXd* part : {&c.q, &c.v, &c.tau}) {
      for (Eigen::Index i = 0; i < part->rows(); ++i) row.push_back((*part)(i, p));
    }
    const bool has_step = std::size_t(p) < loop.steps.size();
    const ClosedLoop::Step step = has_step ? loop.steps[std::size_t(p)] : ClosedLoop::Step{};
    row.insert(row.end(), {1e3 * step.seconds, double(step.iterations), has_step && step.usable ? 1.0 : 0.0});
    table.append(row);
  }
  return table;
}

io::Plot steps_plot(const ControlReport& report, const std::string& name) {
  io::Series taken{.name = "a step", .mark = io::Mark::kPoints};
  for (std::size_t k = 1; k < report.loop.steps.size(); ++k) {
    taken.x.push_back(report.loop.steps[k].t);
    taken.y.push_back(1e3 * report.loop.steps[k].seconds);
  }
  io::Plot plot;
  plot.title = name + ": what a step takes";
  plot.panels = {{.title = "from the measured state to the plan",
                  .x_label = "time [s]",
                  .y_label = "[ms]",
                  .series = {taken},
                  .horizontal = {{1e3 * report.deadline, "period"}},
                  .log_y = true}};
  return plot;
}

}  // namespace

ControlReport control_task(const Task& task, const std::stop_token& stop,
                           const std::function<void(double t)>& watch) {
  ClosedLoopOptions options{.seconds = task.control.seconds,
                            .period = task.control.period,
                            .delay = task.control.delay,
                            .stop = stop,
                            .watch = watch};
  for (const Task::Control::Push& push : task.control.pushes) {
    Eigen::VectorXd change = Eigen::VectorXd::Zero(task.problem.n_x());
    change.segment(task.scene.model.nq, push.v.size()) = push.v;
    options.pushes.push_back({push.at, change});
  }
  options.mpc.mesh = task.optimise.mesh;
  options.mpc.solver = task.optimise.solver;
  options.mpc.solver.tolerance = std::max(options.mpc.solver.tolerance, 1e-6);
  options.mpc.iterations = task.control.iterations;
  ControlReport report;
  report.deadline = task.control.period;
  report.loop = close_loop(endless(task), options);
  const Trajectory& motion = report.loop.motion;
  report.off_begin = distance_to_goal(task, motion.x.col(0));
  report.off_end = distance_to_goal(task, motion.x.col(motion.points() - 1));
  return report;
}

std::string ControlReport::text(const Task& task) const {
  const auto ms = [](double seconds) { return io::significant(1e3 * seconds, 3) + " ms"; };
  io::TextTable table({{"closed loop"}, {""}});
  table.append({"task", task.name});
  table.append({"simulated", io::significant(loop.motion.t[loop.motion.points() - 1], 4) + " s, " +
                                 std::to_string(loop.steps.size()) + " steps"});
  table.append({"from the goal", io::significant(off_begin, 3) + " at the beginning, " +
                                     io::significant(off_end, 3) + " at the end (norm over the joints)"});
  table.append({"first step", loop.steps.empty() ? "" : ms(loop.steps.front().seconds) + ", solved"});
  table.append({"later steps", "median " + ms(loop.latency(0.5)) + ", 99 % " + ms(loop.latency(0.99)) +
                                   ", longest " + ms(loop.latency(1))});
  table.append({"longer than the period", std::to_string(loop.missed(deadline))});
  table.append({"plans not usable", std::to_string(loop.unusable())});
  if (!loop.trouble.empty()) table.append({"ended early", loop.trouble});
  return table.text();
}

std::string ControlReport::json(const Task& task) const {
  nlohmann::ordered_json steps = nlohmann::ordered_json::array();
  for (const ClosedLoop::Step& step : loop.steps)
    steps.push_back({{"t", step.t},
                     {"ms", 1e3 * step.seconds},
                     {"iterations", step.iterations},
                     {"status", to_string(step.status)},
                     {"usable", step.usable}});
  const nlohmann::ordered_json report = {{"task", task.name},
                                         {"success", success()},
                                         {"trouble", loop.trouble},
                                         {"seconds", loop.motion.t[loop.motion.points() - 1]},
                                         {"from_goal", {{"begin", off_begin}, {"end", off_end}}},
                                         {"step_ms",
                                          {{"median", 1e3 * loop.latency(0.5)},
                                           {"p99", 1e3 * loop.latency(0.99)},
                                           {"longest", 1e3 * loop.latency(1)}}},
                                         {"missed_deadlines", loop.missed(deadline)},
                                         {"unusable_plans", loop.unusable()},
                                         {"steps", steps}};
  return report.dump(2) + "\n";
}

std::vector<std::string> control_files() {
  return {kLoop, kLoopReport, kLoopCurves, kSteps, kLoopMotion, kLoopPlayer};
}

void write_control(const Task& task, ControlReport& report, const std::string& folder,
                   const std::stop_token& stop) {
  io::ResultFolder results(folder, report.unwritten);
  results.write(kLoop, [&](const std::string& path) {
    io::write_csv(path, loop_table(task, report.loop), io::NonFinite::kAllow);
  });
  const Trajectory& motion = report.loop.motion;
  if (motion.points() > 2) {
    const auto picture = [&](const char* file, const io::Plot& plot) {
      results.write(file, [&](const std::string& path) { io::draw(plot, path, "gnuplot", stop); });
    };
    picture(kLoopCurves, trajectory_plot(task, motion));
    picture(kSteps, steps_plot(report, task.name));
    picture(kLoopMotion, motion_plot(task, motion));
    results.write(kLoopPlayer,
                  [&](const std::string& path) { write_player(motion_player(task, motion), path); });
  }
  results.write(kLoopReport,
                [&](const std::string& path) { write_file_atomically(path, report.json(task)); });
}

}  // namespace dyntape
