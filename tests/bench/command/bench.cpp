// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape bench: what each route to a function of a robot costs, and how exact it is.
#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/io/live_line.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/robot/robot_evaluator.h>

#include "bench_commands.h"
#include "bench_lanes.h"
#include "compare.h"
#include "function_options.h"
#include "host.h"
#include "measure.h"
#include "words.h"

namespace dyntape::tools {
namespace {

struct BenchOptions {
  RobotOptions robot;
  FunctionOptions function;
  bool peer = false;
  std::string peer_prefix;
  int states = 100;
  std::uint64_t seed = 1;
  bool json = false;
  bool lanes = false;
};

struct Row {
  RobotRoute route = RobotRoute::kAnalytic;
  double seconds = 0, error = 0;
  double prepare = 0;  // record, derive, print, compile, load: from the model to the first evaluation
  std::size_t operations = 0;
  Timings timings;
};

Row measure(const dynamics::Model<double>& model, const RobotFunction& function, RobotRoute route,
            const std::vector<Eigen::VectorXd>& states, const std::vector<std::vector<double>>& expected) {
  RobotEvaluatorOptions options;
  options.codegen.use_cache = false;  // cold: what making it costs
  const auto start = std::chrono::steady_clock::now();
  RobotEvaluator evaluate(model, function, route, options);
  Row row;
  row.route = route;
  row.prepare = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::vector<double> result(evaluate.n_out());
  for (std::size_t i = 0; i < states.size(); ++i) {
    evaluate.evaluate(states[i].data(), result.data());
    const double error = relative_error(expected[i], result.data(), outputs(model, function));
    row.error = error <= row.error ? row.error : error;
  }
  row.seconds = median_seconds(
      [&](std::size_t i) { evaluate.evaluate(states[i % states.size()].data(), result.data()); });
  if (evaluate.compiled()) {
    row.operations = evaluate.compiled()->operations(Order::kValue);
    row.timings = evaluate.compiled()->timings();
  }
  return row;
}

nlohmann::json to_json(const Row& row) {
  nlohmann::json j = {
      {"route", to_string(row.route)},
      {"time_s", row.seconds},
      {"error", row.error},
      {"prepare_s", row.prepare},
      {"operations", row.operations ? nlohmann::json(row.operations) : nlohmann::json(nullptr)}};
  if (row.route == RobotRoute::kGenerated) {
    j["derive_s"] = row.timings.derive;
    j["print_s"] = row.timings.schedule + row.timings.print;
    j["compile_s"] = row.timings.compile;
  }
  return j;
}

// Every function of the robot, or the one that was named.
void run_compare(const dynamics::UrdfRobot& robot, const BenchOptions& options) {
  CompareOptions comparison;
  for (const RobotFunction& function : robot_functions()) {
    const std::string name = to_string(function);
    if (options.function.name.empty() || options.function.name == name) {
      comparison.functions.push_back(chosen(name, options.function, robot));
    }
  }
  comparison.seed = options.seed;
  comparison.peer = options.peer;
  comparison.peer_prefix = options.peer_prefix;
  comparison.json = options.json;
  compare(robot.model, comparison);
}

void run(const BenchOptions& options) {
  const auto robot = load_robot(options.robot);
  check_moves(robot, "there is nothing to measure");
  if (options.peer || options.function.name.empty()) return run_compare(robot, options);
  const RobotFunction function = chosen(options.function.name, options.function, robot);
  const auto states = random_states(robot.model, function, options.states, options.seed);
  std::vector<std::vector<double>> expected;
  for (const auto& state : states) expected.push_back(reference(robot.model, function, state));

  const int nv = robot.model.nv - static_cast<int>(robot.mimics.size());
  std::vector<Row> rows;
  {
    io::LiveLine line;
    for (RobotRoute route : kRobotRoutes) {
      line.show(std::string("measuring ") + to_string(route));
      if (has_route(function, route)) rows.push_back(measure(robot.model, function, route, states, expected));
    }
  }
  const auto in_lanes =
      options.lanes ? measure_lanes(robot.model, function, states, expected) : std::vector<LaneRow>();
  if (options.json) {
    nlohmann::json report = {{"robot", robot.model.name},
                             {"function", options.function.name},
                             {"nv", nv},
                             {"states", options.states},
                             {"seed", options.seed},
                             {"processor", processor_name()},
                             {"compiler", compiler_name()}};
    for (const Row& row : rows) report["routes"].push_back(to_json(row));
    for (const LaneRow& row : in_lanes)
      report["lanes"].push_back({{"kernel", row.name},
                                 {"time_s", row.seconds},
                                 {"error", row.error},
                                 {"prepare_s", row.prepare},
                                 {"compile_s", row.compile},
                                 {"operations", row.operations}});
    std::cout << report.dump(2) << "\n";
    return;
  }
  std::cout << robot.model.name << " " << options.function.name << ", nv " << nv << ": median time of one "
            << "evaluation, largest error against 113 bits over " << options.states << " states (seed "
            << options.seed << ")\n"
            << processor_name() << ", " << compiler_name() << "\n\n";
  io::TextTable table({{"route"},
                       {"time", "us", io::Align::kRight},
                       {"error", "", io::Align::kRight},
                       {"operations", "", io::Align::kRight},
                       {"made in", "", io::Align::kRight},
                       {"of it compiling", "", io::Align::kRight}});
  for (const Row& row : rows) {
    const bool generated = row.route == RobotRoute::kGenerated;
    table.append({to_string(row.route), io::significant(row.seconds * 1e6, 3), io::scientific(row.error),
                  row.operations ? io::with_groups(static_cast<long long>(row.operations)) : "",
                  io::duration(row.prepare), generated ? io::duration(row.timings.compile) : ""});
  }
  for (const LaneRow& row : in_lanes)
    table.append({row.name, io::significant(row.seconds * 1e6, 3), io::scientific(row.error),
                  io::with_groups(static_cast<long long>(row.operations)), io::duration(row.prepare),
                  io::duration(row.compile)});
  std::cout << table.text();
}

}  // namespace

void add_bench(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "bench",
      "with --function: time, operations, generation and compile time, and error against 113 bits, of every\n"
      "route to it; without: time and error of every function in plain double; --peer: beside Pinocchio's");
  const auto options = std::make_shared<BenchOptions>();
  add_robot_options(*command, options->robot);
  add_function_options(*command, options->function, "what to measure (default: everything)");
  command->add_option("--states", options->states, "random states")
      ->transform(whole_number(1, 100000))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "of the random states")
      ->transform(seed())
      ->capture_default_str();
  command->add_flag("--lanes", options->lanes,
                    "with --function: generated kernels of several states at once as well, a state's share");
  command->add_flag("--peer", options->peer, "beside Pinocchio (PyPI `pin`), in the same run");
  command
      ->add_option("--peer-prefix", options->peer_prefix,
                   "where its headers are: a prefix or a virtual environment")
      ->type_name("DIR");
  command->add_flag("--json", options->json, "for programs");
  command->callback([options] { run(*options); });
}

}  // namespace dyntape::tools
