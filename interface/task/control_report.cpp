// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/task/control_report.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/result_folder.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/player/player.h>

namespace dyntape {

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
  results.write(kLoopTable,
                [&](const std::string& path) { io::write_csv(path, table, io::NonFinite::kAllow); });
  if (report.loop.motion.points() > 2) {
    const LoopPictures drawn = pictures();
    const auto draw = [&](const std::string& file, const io::Plot& plot) {
      results.write(file.c_str(), [&](const std::string& path) { io::draw(plot, path, "gnuplot", stop); });
    };
    for (const auto& [file, plot] : drawn.plots) draw(file, plot);
    draw(kLoopSteps, steps_plot(report));
    results.write(kLoopPlayer, [&](const std::string& path) { write_player(drawn.player, path); });
  }
  results.write(kLoopReport, [&](const std::string& path) { write_file_atomically(path, report.json()); });
}

std::vector<std::string> step_columns() { return {"step_ms", "iterations", "usable"}; }

std::vector<double> step_values(const ClosedLoop& loop, int point) {
  if (std::size_t(point) >= loop.steps.size()) return {0, 0, 0};
  const ClosedLoop::Step& step = loop.steps[std::size_t(point)];
  return {1e3 * step.seconds, double(step.iterations), step.usable ? 1.0 : 0.0};
}

const ClosedLoop::Step* ControlReport::first_unusable() const {
  const auto step = std::find_if(loop.steps.begin(), loop.steps.end(),
                                 [](const ClosedLoop::Step& at) { return !at.usable; });
  return step == loop.steps.end() ? nullptr : &*step;
}

std::string ControlReport::text() const {
  const auto ms = [](double seconds) { return io::significant(1e3 * seconds, 3) + " ms"; };
  io::TextTable table({{"closed loop"}, {""}});
  table.append({"task", task});
  table.append({"simulated", io::significant(loop.motion.t[loop.motion.points() - 1], 4) + " s, " +
                                 std::to_string(loop.steps.size()) + " steps"});
  table.append({"from the goal", io::significant(off_begin, 3) + " at the beginning, " +
                                     io::significant(off_end, 3) + " at the end (" + off_of + ")"});
  table.append({"first step", loop.steps.empty() ? "" : ms(loop.steps.front().seconds) + ", solved"});
  table.append({"later steps", "median " + ms(loop.latency(0.5)) + ", 99 % " + ms(loop.latency(0.99)) +
                                   ", longest " + ms(loop.latency(1))});
  table.append({"longer than the period", std::to_string(loop.missed(deadline))});
  std::string unusable = std::to_string(loop.unusable());
  if (const ClosedLoop::Step* step = first_unusable())
    unusable += ", the first at " + io::significant(step->t, 4) + " s: " + to_string(step->status);
  table.append({"plans not usable", unusable});
  if (!loop.trouble.empty()) table.append({"ended early", loop.trouble});
  return table.text();
}

std::string ControlReport::json() const {
  nlohmann::ordered_json steps = nlohmann::ordered_json::array();
  for (const ClosedLoop::Step& step : loop.steps)
    steps.push_back({{"t", step.t},
                     {"ms", 1e3 * step.seconds},
                     {"iterations", step.iterations},
                     {"status", to_string(step.status)},
                     {"usable", step.usable}});
  const nlohmann::ordered_json report = {{"task", task},
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

}  // namespace dyntape
