// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape study: measurements with a picture.  Here: routes, what accuracy costs in time, for every route to the derivatives of forward dynamics.
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <sstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/live_line.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/picture.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/robot/robot_evaluator.h>
#include <dyntape/interface/robot/robot_rows.h>

#include "bench_commands.h"
#include "host.h"
#include "measure.h"
#include "study.h"
#include "words.h"

namespace dyntape::tools {
namespace {

struct StudyOptions {
  std::string output, config;
  int states = 20;
  std::uint64_t seed = 1;
};

struct Subject {
  std::string label;
  dynamics::Model<double> model;
};

struct Sample {
  std::string route;
  double step = 0;  // of differences
  double seconds = 0, error = 0;
};

const RobotFunction kFunction = RobotFunction::kFdDerivatives;

// The folder with robots and tasks: beside an installed command, or that of the source tree.
std::string config_folder(const std::string& wanted) {
  if (!wanted.empty()) return wanted;
  std::error_code none;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", none);
  const auto installed = program.parent_path().parent_path() / "share" / "dyntape";
  return std::filesystem::exists(installed / "robots", none) ? installed.string() : DYNTAPE_CONFIG_FOLDER;
}

std::vector<Subject> subjects(const std::string& folder) {
  using dynamics::load_urdf;
  const std::string robots = folder + "/robots/";
  return {{"pendulum", load_urdf(robots + "pendulum.urdf")},
          {"arm (7 joints)",
           load_urdf(robots + "panda.urdf", {.lock = {"panda_finger_joint1", "panda_finger_joint2"}})},
          {"quadruped (18 degrees of freedom)",
           load_urdf(robots + "solo12.urdf", {.base = dynamics::Base::kFloating})}};
}

// Median over the states of the error; time of one evaluation.
template <class Evaluate>
Sample sample(const std::string& route, const dynamics::Model<double>& model,
              const std::vector<Eigen::VectorXd>& states, const std::vector<std::vector<double>>& expected,
              Evaluate&& evaluate) {
  std::vector<double> errors, result(expected[0].size());
  for (std::size_t i = 0; i < states.size(); ++i) {
    evaluate(states[i], result.data());
    errors.push_back(relative_error(expected[i], result.data(), outputs(model, kFunction)));
  }
  Sample s;
  s.route = route;
  s.error = median(errors);
  s.seconds = median_seconds([&](std::size_t i) { evaluate(states[i % states.size()], result.data()); }, 15);
  return s;
}

// The analytic code in single precision.
Sample single_precision(const dynamics::Model<double>& model, const std::vector<Eigen::VectorXd>& states,
                        const std::vector<std::vector<double>>& expected) {
  const dynamics::Model<float> narrow = model.cast<float>();
  detail::RobotWorkspace<float> work(narrow, kFunction);
  Eigen::VectorXf x;
  std::vector<float> y(expected[0].size());
  return sample("analytic, float", model, states, expected,
                [&](const Eigen::VectorXd& state, double* result) {
                  x = state.cast<float>();
                  work.evaluate(x.data(), y.data());
                  std::copy(y.begin(), y.end(), result);
                });
}

std::vector<Sample> measure(const dynamics::Model<double>& model, const StudyOptions& options,
                            io::LiveLine& line, long& done) {
  const auto states = random_states(model, kFunction, options.states, options.seed);
  std::vector<std::vector<double>> expected;
  for (const auto& state : states) expected.push_back(reference(model, kFunction, state));
  std::vector<Sample> samples;
  const auto add = [&](RobotRoute route, double step) {
    RobotEvaluatorOptions evaluator;
    evaluator.step = step;
    RobotEvaluator evaluate(model, kFunction, route, evaluator);
    samples.push_back(sample(
        to_string(route), model, states, expected,
        [&](const Eigen::VectorXd& state, double* result) { evaluate.evaluate(state.data(), result); }));
    samples.back().step = step;
    line.show("measuring " + std::to_string(++done) + ", " + to_string(route));
  };
  for (RobotRoute route : {RobotRoute::kFdForward, RobotRoute::kFdCentral}) {
    for (int k = -24; k <= -2; ++k) add(route, std::pow(10.0, 0.5 * k));
  }
  for (RobotRoute route : {RobotRoute::kAnalytic, RobotRoute::kTape, RobotRoute::kGenerated}) add(route, 0);
  samples.push_back(single_precision(model, states, expected));
  return samples;
}

std::string csv(const std::vector<Subject>& robots, const std::vector<std::vector<Sample>>& samples,
                const StudyOptions& options) {
  std::ostringstream text;
  text << "robot,function,route,step,error,seconds,states,seed,processor,compiler,dyntape\n";
  for (std::size_t r = 0; r < robots.size(); ++r) {
    for (const Sample& s : samples[r]) {
      text << robots[r].model.name << "," << to_string(kFunction) << "," << '"' << s.route << "\","
           << io::shortest(s.step) << "," << io::shortest(s.error) << "," << io::shortest(s.seconds) << ","
           << options.states << "," << options.seed << ",\"" << processor_name() << "\",\"" << compiler_name()
           << "\"," << DYNTAPE_VERSION << "\n";
    }
  }
  return text.str();
}

std::vector<Sample> of_route(const std::vector<Sample>& samples, const std::string& route) {
  std::vector<Sample> chosen;
  for (const Sample& s : samples) {
    if (s.route == route) chosen.push_back(s);
  }
  return chosen;
}

constexpr double kExact = 1e-17;  // where an error of exactly zero is drawn

io::Series series(const std::vector<Sample>& samples, const std::string& name, double Sample::*x,
                  double scale, io::Mark mark) {
  io::Series s{.name = name, .mark = mark};
  for (const Sample& sample : samples) {
    s.x.push_back(sample.*x * scale);
    s.y.push_back(std::max(sample.error, kExact));
  }
  return s;
}

io::Plot picture(const std::vector<Subject>& robots, const std::vector<std::vector<Sample>>& samples) {
  io::Plot plot{
      .title = "Derivatives of forward dynamics: error against 113 bits", .columns = 3, .width = 1280};
  const char* const differences[] = {"fd-forward", "fd-central"};
  for (std::size_t r = 0; r < robots.size(); ++r) {
    io::Panel panel{.title = robots[r].label,
                    .x_label = "step of the differences",
                    .log_x = true,
                    .log_y = true,
                    .y_limits = {kExact, 10}};
    if (r == 0) panel.y_label = "relative error";
    for (const char* route : differences) {
      panel.series.push_back(series(of_route(samples[r], route), route, &Sample::step, 1, io::Mark::kBoth));
    }
    plot.panels.push_back(panel);
  }
  for (std::size_t r = 0; r < robots.size(); ++r) {
    io::Panel panel{
        .x_label = "time of one evaluation [us]", .log_x = true, .log_y = true, .y_limits = {kExact, 10}};
    if (r == 0) panel.y_label = "relative error";
    for (const char* route : differences) {
      panel.series.push_back(series(of_route(samples[r], route), std::string(route) + ", every step",
                                    &Sample::seconds, 1e6, io::Mark::kPoints));
    }
    for (const char* route : {"analytic", "tape", "generated", "analytic, float"}) {
      io::Series s = series(of_route(samples[r], route), route, &Sample::seconds, 1e6, io::Mark::kPoints);
      s.point = 2;
      panel.series.push_back(s);
    }
    plot.panels.push_back(panel);
  }
  return plot;
}

void print(const std::vector<Subject>& robots, const std::vector<std::vector<Sample>>& samples) {
  for (std::size_t r = 0; r < robots.size(); ++r) {
    io::TextTable table({{robots[r].label},
                         {"time", "us", io::Align::kRight},
                         {"error", "", io::Align::kRight},
                         {"at step", "", io::Align::kRight}});
    for (const char* route :
         {"fd-forward", "fd-central", "analytic, float", "tape", "analytic", "generated"}) {
      const std::vector<Sample> chosen = of_route(samples[r], route);
      const Sample best = *std::min_element(
          chosen.begin(), chosen.end(), [](const Sample& a, const Sample& b) { return a.error < b.error; });
      table.append({route, io::significant(best.seconds * 1e6, 3), io::scientific(best.error),
                    best.step > 0 ? io::scientific(best.step) : ""});
    }
    std::cout << table.text() << "\n";
  }
}

void run(const StudyOptions& options) {
  prepare_folder(options.output, {"routes.csv", "routes.svg"});
  const std::vector<Subject> robots = subjects(config_folder(options.config));
  std::vector<std::vector<Sample>> samples;
  {
    long done = 0;
    io::LiveLine line;
    for (const Subject& subject : robots) samples.push_back(measure(subject.model, options, line, done));
  }
  print(robots, samples);
  const std::string table = options.output + "/routes.csv", drawing = options.output + "/routes.svg";
  dyntape::write_file_atomically(table, csv(robots, samples, options));
  io::draw(picture(robots, samples), drawing);
  std::cout << table << "\n" << drawing << "\n";
}

}  // namespace

void add_study(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("study", "measure what accuracy costs, how cost grows; CSV and picture");
  command->require_subcommand(1);
  const auto options = std::make_shared<StudyOptions>();
  CLI::App* routes = command->add_subcommand(
      "routes",
      "every route to the derivatives of forward dynamics on pendulum, arm and quadruped: error against a\n"
      "113-bit reference over time per evaluation, with a sweep over the step of finite differences");
  routes->add_option("--output", options->output, "where routes.csv and routes.svg go")
      ->check(not_empty())
      ->required()
      ->type_name("DIR");
  routes->add_option("--states", options->states, "random states; errors are medians over them")
      ->transform(whole_number(1, 1000))
      ->capture_default_str();
  routes->add_option("--seed", options->seed, "of the random states")
      ->transform(seed())
      ->capture_default_str();
  routes
      ->add_option("--config", options->config, "the folder with robots/ (default: the one that came along)")
      ->type_name("DIR");
  routes->callback([options] { run(*options); });
  add_slopes(*command);
  add_compile(*command);
}

}  // namespace dyntape::tools
