// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape eval: a function of a robot at the states of a CSV file, by one route.
#include <iostream>
#include <memory>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/function/robot_evaluator.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/io/progress.h>

#include "function_options.h"

namespace dyntape::tools {
namespace {

struct Options {
  RobotOptions robot;
  FunctionOptions function;
  std::string route, input, output;
};

// The columns of the state in the order that the function takes them, wherever they stand in the file.
std::vector<int> columns(const io::CsvTable& table, const std::vector<std::string>& wanted,
                         const std::string& file) {
  std::vector<int> indices;
  for (const std::string& name : wanted) {
    if (!table.has(name)) {
      throw FileError(file + ":1: no column \"" + name + "\"; expected " + wanted.front() + " to " +
                      wanted.back() + " (" + std::to_string(wanted.size()) + " columns), got " +
                      std::to_string(table.cols()));
    }
    indices.push_back(table.index(name));
  }
  if (table.cols() != static_cast<int>(wanted.size())) {
    for (const std::string& name : table.names()) {
      if (std::find(wanted.begin(), wanted.end(), name) == wanted.end()) {
        throw FileError(file + ":1: column \"" + name + "\" is not an input of this function; expected " +
                        wanted.front() + " to " + wanted.back());
      }
    }
  }
  return indices;
}

void run(const Options& options) {
  const auto robot = load_robot(options.robot);
  const RobotFunction function = chosen(options.function.name, options.function, robot);
  RobotEvaluator evaluate(robot.model, function, robot_route_from(options.route));
  const io::CsvTable states = io::read_csv(options.input);
  const std::vector<int> order = columns(states, input_names(robot.model, function), options.input);

  io::CsvTable results(output_names(robot.model, function));
  io::Progress progress("evaluating", states.rows());
  std::vector<double> state(evaluate.n_in()), result(evaluate.n_out());
  for (int i = 0; i < states.rows(); ++i) {
    for (std::size_t k = 0; k < state.size(); ++k) state[k] = states(i, order[k]);
    evaluate.evaluate(state.data(), result.data());
    results.append(result);
    progress.update(i + 1);
  }
  io::write_csv(options.output, results);
}

}  // namespace

void add_eval(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "eval",
      "evaluate a function of a robot at given states.\n"
      "Input: a CSV file with columns q0.. v0.. a0.. as the function takes them, one state a row.\n"
      "Output: one row a state, matrices row by row");
  const auto options = std::make_shared<Options>();
  add_robot_options(*command, options->robot);
  add_function_options(*command, options->function, "what to evaluate")->required();
  command
      ->add_option("--route", options->route,
                   "analytic: plain double code; tape: the recorded value, differentiated and interpreted;\n"
                   "generated: compiled C; fd-forward, fd-central: finite differences of the value")
      ->required()
      ->check(CLI::IsMember({"analytic", "tape", "generated", "fd-forward", "fd-central"}))
      ->type_name("analytic|tape|generated|fd-forward|fd-central");
  command->add_option("--input", options->input, "states")->required()->type_name("states.csv");
  command->add_option("--output", options->output, "results")->required()->type_name("out.csv");
  command->callback([options] { run(*options); });
}

}  // namespace dyntape::tools
