// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape study slopes: how the cost of the dynamics grows with the number of bodies.
#include <cmath>
#include <iostream>
#include <memory>
#include <sstream>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/live_line.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/picture.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/robot/robot_rows.h>

#include "chains.h"
#include "host.h"
#include "measure.h"
#include "study.h"
#include "words.h"

namespace dyntape::tools {
namespace {

using dynamics::Model;

constexpr const char* kFunctions[] = {"rnea", "crba", "aba", "minverse", "id-derivatives", "fd-derivatives"};
constexpr int kFewest = 8;
constexpr int kFirstOfFit = 64;  // below, what every call costs flattens the line

struct Line {
  std::string shape, function;
  std::vector<double> bodies, seconds;
  double slope = 0;
};

double seconds_of(const Model<double>& model, const RobotFunction& function, const SlopesOptions& options) {
  const auto states = random_states(model, function, 8, options.seed);
  detail::RobotWorkspace<double> work(model, function);
  std::vector<detail::RobotState<double>> prepared;
  for (const auto& state : states) {
    work.read(state.data());
    prepared.push_back(work.state);
  }
  return median_seconds([&](std::size_t i) { work.run(prepared[i % prepared.size()]); }, options.repeats);
}

std::string csv(const std::vector<Line>& lines, const SlopesOptions& options) {
  std::ostringstream text;
  text << "shape,function,bodies,seconds,slope,seed,processor,compiler,dyntape\n";
  for (const Line& line : lines) {
    for (std::size_t i = 0; i < line.bodies.size(); ++i) {
      text << line.shape << "," << line.function << "," << line.bodies[i] << ","
           << io::shortest(line.seconds[i]) << "," << io::shortest(line.slope) << "," << options.seed << ",\""
           << processor_name() << "\",\"" << compiler_name() << "\"," << DYNTAPE_VERSION << "\n";
    }
  }
  return text.str();
}

io::Plot picture(const std::vector<Line>& lines) {
  io::Plot plot{.title = "Time of one evaluation in plain double", .columns = 2, .width = 1280};
  for (const char* shape : {"chain", "binary tree"}) {
    io::Panel panel{.title = shape, .x_label = "bodies", .log_x = true, .log_y = true};
    if (plot.panels.empty()) panel.y_label = "time [us]";
    for (const Line& line : lines) {
      if (line.shape != shape) continue;
      io::Series series{.name = line.function + ", slope " + io::significant(line.slope, 2),
                        .mark = io::Mark::kBoth};
      series.x = line.bodies;
      for (double s : line.seconds) series.y.push_back(s * 1e6);
      panel.series.push_back(series);
    }
    plot.panels.push_back(panel);
  }
  return plot;
}

}  // namespace

void run_slopes(const SlopesOptions& options) {
  prepare_folder(options.output, {"slopes.csv", "slopes.svg"});
  std::vector<Line> lines;
  {
    io::LiveLine live;
    for (auto make : {chain, binary_tree}) {
      for (const char* name : kFunctions) {
        const RobotFunction function(name);
        Line line{make(1).name, name, {}, {}};
        live.show("measuring " + line.shape + " " + name);
        for (int bodies = kFewest; bodies <= options.bodies; bodies *= 2) {
          line.bodies.push_back(bodies);
          line.seconds.push_back(seconds_of(make(bodies), function, options));
        }
        line.slope = fitted_slope(line.bodies, line.seconds, kFirstOfFit);
        lines.push_back(line);
      }
    }
  }
  io::TextTable table({{"shape"},
                       {"function"},
                       {"slope", "", io::Align::kRight},
                       {std::to_string(kFewest) + " bodies", "us", io::Align::kRight},
                       {std::to_string(options.bodies) + " bodies", "us", io::Align::kRight}});
  for (const Line& line : lines) {
    table.append({line.shape, line.function, io::significant(line.slope, 3),
                  io::significant(line.seconds.front() * 1e6, 3),
                  io::significant(line.seconds.back() * 1e6, 3)});
  }
  std::cout << table.text() << "slope: log time over log bodies, from " << kFirstOfFit << " bodies on\n";
  const std::string data = options.output + "/slopes.csv", drawing = options.output + "/slopes.svg";
  dyntape::write_file_atomically(data, csv(lines, options));
  io::draw(picture(lines), drawing);
  std::cout << data << "\n" << drawing << "\n";
}

void add_slopes(CLI::App& study) {
  const auto options = std::make_shared<SlopesOptions>();
  CLI::App* command = study.add_subcommand(
      "slopes",
      "how the cost of the dynamics grows with the number of bodies, on chains and binary trees of revolute\n"
      "joints: slopes of log time over log bodies");
  command->add_option("--output", options->output, "where slopes.csv and slopes.svg go")
      ->check(not_empty())
      ->required()
      ->type_name("DIR");
  command->add_option("--bodies", options->bodies, "of the largest robot")
      ->transform(whole_number(2 * kFirstOfFit, 4096))
      ->capture_default_str();
  command->add_option("--repeats", options->repeats, "timings of each, of which the median counts")
      ->transform(whole_number(1, 1000))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "of the random states")
      ->transform(seed())
      ->capture_default_str();
  command->callback([options] { run_slopes(*options); });
}

}  // namespace dyntape::tools
