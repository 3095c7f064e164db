// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape eval: a function of a robot at the states of a CSV file, by one route.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <iterator>
#include <memory>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/algorithms/mimic.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/io/live_line.h>
#include <dyntape/interface/robot/robot_evaluator.h>

#include "function_options.h"
#include "state_columns.h"
#include "words.h"

namespace dyntape::tools {
namespace {

struct EvalOptions {
  RobotOptions robot;
  FunctionOptions function;
  std::string route, input, output;
  ColumnOptions columns;
};

constexpr const char* kStream = "-";  // the standard input, or output

io::CsvTable read_states(const std::string& input) {
  if (input != kStream) return io::read_csv(input);
  return io::parse_csv(std::string(std::istreambuf_iterator<char>(std::cin), {}), "the standard input");
}

void write_results(const std::string& output, const io::CsvTable& results) {
  if (output != kStream) return io::write_csv(output, results);
  std::cout << io::format_csv(results);
}

void check_result(const std::vector<double>& result, const std::vector<std::string>& names,
                  const std::string& where) {
  const auto bad = std::find_if(result.begin(), result.end(), [](double y) { return !std::isfinite(y); });
  if (bad == result.end()) return;
  throw FileError(where + "at this state " + names[static_cast<std::size_t>(bad - result.begin())] + " is " +
                  (std::isnan(*bad) ? "not a number" : "infinite") +
                  "; expected a state where the function is finite");
}

void run(const EvalOptions& options) {
  if (options.output != kStream) {
    dyntape::check_can_write(options.output);
    keep_inputs(options.output, {options.robot.path, options.input});
  }
  const auto robot = load_robot(options.robot);
  const RobotFunction function = chosen(options.function.name, options.function, robot);
  check_moves(robot, "a file of states has no columns");
  // The file first: what a large robot's evaluator takes is not worth building for states of another.
  const io::CsvTable states = read_states(options.input);
  const std::string input = options.input == kStream ? "the standard input" : options.input;
  const StateColumns columns(states, robot, inputs(robot.model, function), input, options.columns);
  RobotEvaluator evaluate(robot.model, function, robot_route_from(options.route));

  io::CsvTable results(output_names(robot.model, function));
  io::LiveLine line;
  std::vector<double> state(evaluate.n_in()), result(evaluate.n_out());
  for (int i = 0; i < states.rows(); ++i) {
    columns.read(states, i, state);
    const std::string where = input + ": row " + std::to_string(i + 1) + ": ";
    evaluate.evaluate(state.data(), result.data());
    check_result(result, results.names(), where);
    results.append(result);
    line.show("evaluating row " + std::to_string(i + 1) + " of " + std::to_string(states.rows()));
  }
  write_results(options.output, results);
}

}  // namespace

void add_eval(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "eval",
      "evaluate a function of a robot at given states.\nInput: a CSV file with one state per row.  Its "
      "columns are the inputs of the function, in any order, by number (q0, v0, tau0) or by joint (q.elbow, "
      "v.elbow, tau.elbow).\nOutput: one row per state, matrices row by row.\n\nThe torques of a motion from "
      "`dyntape solve`, and inverse dynamics in a pipe:\n  dyntape eval arm.urdf --function rnea --route "
      "analytic --pass-over \\\n    --input out/trajectory.csv --output torques.csv\n  ... | dyntape eval "
      "arm.urdf --function rnea --route tape --input - --output -");
  const auto options = std::make_shared<EvalOptions>();
  add_robot_options(*command, options->robot);
  add_function_options(*command, options->function, "function to evaluate")->required();
  add_choice(*command, "--route", options->route,
             "analytic: plain double code; tape: the recorded value, differentiated and interpreted; "
             "generated: compiled C; machine-code: made in this process without a compiler, the bits of "
             "generated; fd-forward, fd-central: finite differences of the value",
             {"analytic", "tape", "generated", "machine-code", "fd-forward", "fd-central"})
      ->required();
  add_path(*command, "--input", options->input, "states; - for the standard input", "states.csv")->required();
  add_path(*command, "--output", options->output, "results; - for the standard output", "out.csv")
      ->required();
  add_column_options(*command, options->columns);
  command->callback([options] { run(*options); });
}

}  // namespace dyntape::tools
