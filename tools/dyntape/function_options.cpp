// SPDX-License-Identifier: BSD-3-Clause
#include "function_options.h"

#include <algorithm>

#include <dyntape/autodiff/error.h>

#include "help.h"
#include "words.h"

namespace dyntape::tools {
namespace {

// "tau[nv], M[nv x nv]"
std::string text_of(const std::vector<RobotBlock>& blocks) {
  std::string text;
  for (const RobotBlock& block : blocks) {
    text += (text.empty() ? "" : ", ") + block.name;
    if (block.shape != "1") text += "[" + block.shape + "]";
  }
  return text;
}

// Three columns, of which the last flows in what is left of the line.
constexpr std::size_t kFunctionColumn = 32, kStateColumn = 11;

std::string function_row(std::string function, std::string state, const std::string& what) {
  function.resize(kFunctionColumn, ' ');
  state.resize(kStateColumn, ' ');
  return function + state + wrapped(what, kFunctionColumn + kStateColumn, help_width()) + "\n";
}

// Below it, from the second column on; a shape stays in one line.
std::string result_row(const std::string& result) {
  constexpr char kHard = '\1';
  std::string words = "-> " + result;
  bool is_shape = false;
  for (char& c : words) {
    is_shape = c == '[' || (is_shape && c != ']');
    if (is_shape && c == ' ') c = kHard;
  }
  std::string text = std::string(kFunctionColumn, ' ') + wrapped(words, kFunctionColumn, help_width()) + "\n";
  std::replace(text.begin(), text.end(), kHard, ' ');
  return text;
}

std::string table_of_functions() {
  const dynamics::Model<double> none;
  std::string table = function_row("function", "state", "what, and below -> the result");
  for (const RobotFunction& function : robot_functions()) {
    std::string state, what = description(function);
    for (const RobotBlock& block : inputs(none, function)) state += (state.empty() ? "" : " ") + block.name;
    if (takes_frame(function)) what += takes_contacts(function) ? " (--contacts)" : " (--frame)";
    table += function_row(to_string(function), state, what) + result_row(text_of(outputs(none, function)));
  }
  return table + "\n" +
         wrapped("q[nq], v, a, tau, mu[nv]; matrices row by row; derivatives by q are tangent.", 0,
                 help_width());
}

std::string fault(const std::string& name) {
  try {
    RobotFunction function(name);
  } catch (const ArgumentError& e) {
    return e.what();
  }
  return {};
}

}  // namespace

CLI::Option* add_function_options(CLI::App& command, FunctionOptions& options, const std::string& purpose) {
  command
      .add_option("--frame", options.frame, "name of the frame, for functions of a frame (default: the last)")
      ->type_name("NAME");
  add_choice(command, "--in", options.in,
             "reference frame: the frame itself, the world, or the frame's origin with the world's axes",
             {"local", "world", "aligned"})
      ->capture_default_str();
  command
      .add_option("--contacts", options.contacts,
                  "frames whose origins are in contact (default: the frame of --frame)")
      ->delimiter(',')
      ->type_name("F1,F2");
  command.footer(table_of_functions);
  return command.add_option("--function", options.name, purpose)
      ->check(CLI::Validator(fault, "", "function"))
      ->type_name("NAME");
}

RobotFunction chosen(const std::string& name, const FunctionOptions& options,
                     const dynamics::UrdfRobot& robot) {
  RobotFunction function(name);
  function.frame = options.frame;
  function.in = options.in == "local"   ? dynamics::ReferenceFrame::kLocal
                : options.in == "world" ? dynamics::ReferenceFrame::kWorld
                                        : dynamics::ReferenceFrame::kLocalWorldAligned;
  function.contacts = options.contacts;
  function.mimics = robot.mimics;
  return function;
}

void check_moves(const dynamics::UrdfRobot& robot, const std::string& consequence) {
  if (robot.model.nv > 0) return;
  throw ArgumentError("model \"" + robot.model.name + "\" has no joint that moves, so that " + consequence +
                      "; lock fewer joints, or load it with --base floating");
}

}  // namespace dyntape::tools
