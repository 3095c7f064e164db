// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape eval: a function of a robot at the states of a CSV file, by one route.
#include <algorithm>
#include <cmath>
#include <memory>
#include <unordered_set>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/mimic.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/io/file.h>
#include <dyntape/interface/io/progress.h>
#include <dyntape/interface/robot/robot_evaluator.h>

#include "function_options.h"
#include "words.h"

namespace dyntape::tools {
namespace {

struct EvalOptions {
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
    const std::unordered_set<std::string> inputs(wanted.begin(), wanted.end());
    for (const std::string& name : table.names()) {
      if (!inputs.count(name)) {
        throw FileError(file + ":1: column \"" + name + "\" is not an input of this function; expected " +
                        wanted.front() + " to " + wanted.back());
      }
    }
  }
  return indices;
}

// Entries of q that are read by their direction: a quaternion, or a pair (cos, sin).
struct Direction {
  std::string joint;
  int begin, size;
};

std::vector<Direction> directions(const dynamics::UrdfRobot& robot) {
  using dynamics::JointType;
  const dynamics::MimicModel<double> model(robot.model, robot.mimics);
  std::vector<Direction> found;
  for (const auto& joint : robot.model.joints) {
    const int begin = model.q_entries[static_cast<std::size_t>(joint.idx_q)].index;
    if (joint.type == JointType::kContinuous) found.push_back({joint.name, begin, 2});
    if (joint.type == JointType::kPlanar) found.push_back({joint.name, begin + 2, 2});
    if (joint.type == JointType::kSpherical) found.push_back({joint.name, begin, 4});
    if (joint.type == JointType::kFreeFlyer) found.push_back({joint.name, begin + 3, 4});
  }
  return found;
}

void check_directions(const std::vector<Direction>& directions, const std::vector<double>& state,
                      const std::string& where) {
  for (const Direction& d : directions) {
    const auto begin = state.begin() + d.begin, end = begin + d.size;
    if (std::any_of(begin, end, [](double x) { return x != 0; })) continue;
    throw FileError(where + "the " + (d.size == 2 ? "pair (cos, sin)" : "quaternion") + " of joint \"" +
                    d.joint + "\", q" + std::to_string(d.begin) + " to q" +
                    std::to_string(d.begin + d.size - 1) + ", is zero; expected any length but zero");
  }
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
  io::check_can_write(options.output);
  const auto robot = load_robot(options.robot);
  const RobotFunction function = chosen(options.function.name, options.function, robot);
  check_moves(robot, "a file of states has no columns");
  // The file first: what a large robot's evaluator takes is not worth building for states of another.
  const io::CsvTable states = io::read_csv(options.input);
  const std::vector<int> order = columns(states, input_names(robot.model, function), options.input);
  RobotEvaluator evaluate(robot.model, function, robot_route_from(options.route));

  const std::vector<Direction> read_by_direction = directions(robot);
  io::CsvTable results(output_names(robot.model, function));
  io::Progress progress("evaluating", states.rows());
  std::vector<double> state(evaluate.n_in()), result(evaluate.n_out());
  for (int i = 0; i < states.rows(); ++i) {
    for (std::size_t k = 0; k < state.size(); ++k) state[k] = states(i, order[k]);
    const std::string where = options.input + ": row " + std::to_string(i + 1) + ": ";
    check_directions(read_by_direction, state, where);
    evaluate.evaluate(state.data(), result.data());
    check_result(result, results.names(), where);
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
  const auto options = std::make_shared<EvalOptions>();
  add_robot_options(*command, options->robot);
  add_function_options(*command, options->function, "what to evaluate")->required();
  command
      ->add_option("--route", options->route,
                   "analytic: plain double code; tape: the recorded value, differentiated and interpreted;\n"
                   "generated: compiled C; fd-forward, fd-central: finite differences of the value")
      ->required()
      ->check(CLI::IsMember({"analytic", "tape", "generated", "fd-forward", "fd-central"}))
      ->type_name("analytic|tape|generated|fd-forward|fd-central");
  command->add_option("--input", options->input, "states")
      ->required()
      ->check(not_empty())
      ->type_name("states.csv");
  command->add_option("--output", options->output, "results")
      ->required()
      ->check(not_empty())
      ->type_name("out.csv");
  command->callback([options] { run(*options); });
}

}  // namespace dyntape::tools
