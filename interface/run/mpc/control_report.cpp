// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/mpc/control_report.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include <dyntape/interface/io/facts.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/result_folder.h>
#include <dyntape/interface/report/player/player.h>

namespace dyntape {

namespace {

// Of a quantity at times from `after` on.
std::pair<double, double> most_and_typical(const std::vector<double>& t, const std::vector<double>& off,
                                           double after) {
  double most = 0, squares = 0;
  int count = 0;
  for (std::size_t k = 0; k < t.size(); ++k) {
    if (t[k] < after) continue;
    most = std::max(most, off[k]), squares += off[k] * off[k], ++count;
  }
  return {most, count > 0 ? std::sqrt(squares / count) : 0};
}

std::vector<double> off_of(const Trajectory& motion, const Off& off) {
  std::vector<double> all;
  for (int k = 0; k < motion.points(); ++k) all.push_back(off.at(motion, k));
  return all;
}

double median_gain_ms(const ClosedLoop& loop) {
  std::vector<double> ms;
  for (const ClosedLoop::Step& step : loop.steps) ms.push_back(1e3 * step.gain_seconds);
  if (ms.empty()) return 0;
  std::nth_element(ms.begin(), ms.begin() + std::ptrdiff_t(ms.size() / 2), ms.end());
  return ms[ms.size() / 2];
}

io::Plot feedback_plot(const ControlReport& report) {
  const ControlReport::Feedback& of = *report.feedback;
  io::Plot plot;
  plot.title = report.task + ": what feedback between plans is worth";
  plot.panels = {{.title = "distance from " + report.off_of,
                  .x_label = "time [s]",
                  .y_label = "[" + report.unit + "]",
                  .series = {{.name = "with the plan's gains", .x = of.t, .y = of.with},
                             {.name = "without", .x = of.t, .y = of.without}}}};
  return plot;
}

// What the feedback is worth: the loop without it.
std::optional<ControlReport::Feedback> feedback_of(const Problem& problem, const ClosedLoopOptions& options,
                                                   const Off& off, const ControlReport& report) {
  const Trajectory& motion = report.loop.motion;
  ClosedLoopOptions plain = options;
  plain.feedback = 0, plain.watch = {};
  const ClosedLoop without = close_loop(problem, plain);
  if (without.motion.points() != motion.points()) return {};  // one of them ended early
  ControlReport::Feedback of;
  of.t.assign(motion.t.begin(), motion.t.end());
  of.with = report.off, of.without = off_of(without.motion, off);
  const auto first = std::min_element(options.disturbances.begin(), options.disturbances.end(),
                                      [](const Disturbance& a, const Disturbance& b) { return a.at < b.at; });
  of.after = first->at;
  std::tie(of.most_with, of.typical_with) = most_and_typical(of.t, of.with, of.after);
  std::tie(of.most_without, of.typical_without) = most_and_typical(of.t, of.without, of.after);
  return of;
}

}  // namespace

ClosedLoopOptions loop_options(const Task::Control& control, const std::stop_token& stop,
                               const std::function<void(double t)>& watch) {
  ClosedLoopOptions options{.seconds = control.seconds,
                            .period = control.period,
                            .delay = control.delay,
                            .feedback = control.feedback,
                            .stop = stop,
                            .watch = watch};
  options.mpc.iterations = control.iterations;
  options.mpc.violation = control.violation;
  return options;
}

ControlReport report_loop(const Problem& problem, const ClosedLoopOptions& options, const Off& off) {
  ControlReport report;
  report.deadline = options.period;
  report.loop = close_loop(problem, options);
  const Trajectory& motion = report.loop.motion;
  for (const Disturbance& push : options.disturbances) report.pushes.push_back(push.at);
  if (!off.at) return report;
  report.off_of = off.what, report.unit = off.unit;
  report.off = off_of(motion, off);
  report.off_begin = report.off.front();
  report.off_end = report.off.back();
  if (options.feedback > 0 && !options.disturbances.empty() && !options.stop.stop_requested())
    report.feedback = feedback_of(problem, options, off, report);
  return report;
}

io::Plot with_pushes(io::Plot curves, const ControlReport& report) {
  const Eigen::VectorXd& t = report.loop.motion.t;
  if (!report.off.empty()) {
    curves.panels.push_back(
        {.title = "distance from " + report.off_of,
         .x_label = "time [s]",
         .y_label = "[" + report.unit + "]",
         .series = {{.name = "distance", .x = {t.begin(), t.end()}, .y = report.off, .color = "#111111"}}});
  }
  for (io::Panel& panel : curves.panels)
    for (const double at : report.pushes)
      if (at <= t[t.size() - 1])
        panel.vertical.push_back({at, &panel == &curves.panels.front() ? "push" : ""});
  return curves;
}

io::Plot steps_plot(const ControlReport& report) {
  io::Series taken{.name = "a step", .mark = io::Mark::kPoints};
  for (std::size_t k = 1; k < report.loop.steps.size(); ++k) {
    taken.x.push_back(report.loop.steps[k].t);
    taken.y.push_back(1e3 * report.loop.steps[k].seconds);
  }
  io::Plot plot;
  plot.title = report.task + ": what a step takes";
  plot.panels = {{.title = "from the measured state to the plan",
                  .x_label = "time [s]",
                  .y_label = "[ms]",
                  .series = {taken},
                  .horizontal = {{1e3 * report.deadline, "period"}},
                  .log_y = true}};
  return plot;
}

void write_loop(ControlReport& report, const io::CsvTable& table,
                const std::function<LoopPictures()>& pictures, const std::string& folder,
                const std::stop_token& stop) {
  io::ResultFolder results(folder, report.unwritten);
  results.write_table(kLoopTable, table);
  results.remove(kLoopFeedback);
  if (report.loop.motion.points() > 2) {
    const LoopPictures drawn = pictures();
    const auto draw = [&](const std::string& file, const io::Plot& plot) {
      if (stop.stop_requested()) return results.remove(file.c_str());
      results.write(file.c_str(), [&](const std::string& path) { io::draw(plot, path, "gnuplot", stop); });
    };
    for (const auto& [file, plot] : drawn.plots) draw(file, plot);
    draw(kLoopSteps, steps_plot(report));
    if (report.feedback) draw(kLoopFeedback, feedback_plot(report));
    results.write(kLoopPlayer, [&](const std::string& path) { write_player(drawn.player, path); });
  }
  results.write_text(kLoopReport, report.json());
}

void add_steps(const ClosedLoop& loop, io::CsvColumns& table) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3, loop.motion.points());
  for (std::size_t k = 0; k < loop.steps.size() && Eigen::Index(k) < rows.cols(); ++k) {
    const ClosedLoop::Step& step = loop.steps[k];
    rows.col(Eigen::Index(k)) << 1e3 * step.seconds, double(step.iterations), step.usable ? 1.0 : 0.0;
  }
  table.add({"step_ms", "iterations", "usable"}, rows);
}

double ControlReport::late_share() const {
  return loop.steps.size() < 2 ? 0 : double(loop.missed(deadline)) / double(loop.steps.size() - 1);
}

const ClosedLoop::Step* ControlReport::first_unusable() const {
  const auto step = std::find_if(loop.steps.begin(), loop.steps.end(),
                                 [](const ClosedLoop::Step& at) { return !at.usable; });
  return step == loop.steps.end() ? nullptr : &*step;
}

namespace {

void tell_goal(const ControlReport& report, io::Facts& facts) {
  facts["from_goal"] = nullptr;
  if (report.off_of.empty()) return;
  facts.say("from " + report.off_of, io::significant(report.off_begin, 3) + " at the beginning, " +
                                         io::significant(report.off_end, 3) + " at the end (" + report.unit +
                                         ")");
  facts["from_goal"] = {
      {"of", report.off_of}, {"unit", report.unit}, {"begin", report.off_begin}, {"end", report.off_end}};
}

void tell_steps(const ClosedLoop& loop, io::Facts& facts) {
  const auto ms = [](double seconds) { return io::significant(1e3 * seconds, 3) + " ms"; };
  if (!loop.steps.empty())
    facts.say("first step", ms(loop.steps.front().seconds) + ", " + to_string(loop.steps.front().status));
  const double median = loop.latency(0.5), p99 = loop.latency(0.99), longest = loop.latency(1);
  facts.say("later steps", "median " + ms(median) + ", 99 % " + ms(p99) + ", longest " + ms(longest));
  facts["step_ms"] = {{"median", 1e3 * median}, {"p99", 1e3 * p99}, {"longest", 1e3 * longest}};
}

nlohmann::ordered_json json_of(const std::vector<ClosedLoop::Step>& steps) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const ClosedLoop::Step& step : steps)
    list.push_back({{"t", step.t},
                    {"ms", 1e3 * step.seconds},
                    {"iterations", step.iterations},
                    {"violation", step.violation},
                    {"status", to_string(step.status)},
                    {"usable", step.usable}});
  return list;
}

std::string limits_text(const std::vector<std::string>& beyond) {
  if (beyond.empty()) return "kept";
  return beyond.front() + (beyond.size() > 1 ? ", and " + std::to_string(beyond.size() - 1) + " more" : "");
}

void tell_feedback(const ControlReport& report, io::Facts& facts) {
  const ControlReport::Feedback& of = *report.feedback;
  const auto pair = [](double most, double typical) {
    return io::significant(most, 3) + " at most, " + io::significant(typical, 3) + " typically";
  };
  const double gain_ms = median_gain_ms(report.loop);
  facts.say("after the first push", pair(of.most_with, of.typical_with) + " from " + report.off_of +
                                        " with feedback between plans, " +
                                        pair(of.most_without, of.typical_without) + " without");
  facts.say("gains of a plan", "median " + io::significant(gain_ms, 3) + " ms of the step");
  facts["feedback"] = {{"after", of.after},
                       {"with", {{"most", of.most_with}, {"typical", of.typical_with}}},
                       {"without", {{"most", of.most_without}, {"typical", of.typical_without}}},
                       {"gain_ms", gain_ms}};
}

io::Facts facts_of(const ControlReport& report) {
  const ClosedLoop& loop = report.loop;
  const double seconds = loop.motion.t[loop.motion.points() - 1];
  io::Facts facts("", {{"closed loop"}, {""}});
  facts.say("task", report.task);
  facts["task"] = report.task;
  facts["success"] = report.success();
  facts["trouble"] = loop.trouble;
  facts["late"] = {{"share", report.late_share()}, {"allowed", report.most_late}};
  facts.say("simulated", io::significant(seconds, 4) + " s, " + std::to_string(loop.steps.size()) + " steps");
  facts["seconds"] = seconds;
  tell_goal(report, facts);
  tell_steps(loop, facts);
  facts["missed_deadlines"] = loop.missed(report.deadline);
  facts["unusable_plans"] = loop.unusable();
  facts["steps"] = json_of(loop.steps);
  if (report.beyond) facts["limits"] = {{"kept", report.beyond->empty()}, {"exceeded", *report.beyond}};
  if (report.feedback) tell_feedback(report, facts);
  if (report.beyond) facts.say("robot's limits", limits_text(*report.beyond));
  facts.say("longer than the period", std::to_string(loop.missed(report.deadline)) + " (" +
                                          io::significant(100 * report.late_share(), 2) + " %, allowed " +
                                          io::significant(100 * report.most_late, 2) + " %)");
  if (!report.note.empty()) facts.say("note", report.note);
  std::string unusable = std::to_string(loop.unusable());
  if (const ClosedLoop::Step* step = report.first_unusable())
    unusable += ", the first at " + io::significant(step->t, 4) + " s: " + to_string(step->status);
  facts.say("plans not usable", unusable);
  if (!loop.trouble.empty()) facts.say("ended early", loop.trouble);
  return facts;
}

}  // namespace

std::string ControlReport::text() const { return facts_of(*this).text(); }
std::string ControlReport::json() const { return facts_of(*this).json(); }

}  // namespace dyntape
