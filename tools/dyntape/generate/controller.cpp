// SPDX-License-Identifier: BSD-3-Clause
#include "controller.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/build/stack_usage.h>
#include <dyntape/interface/control/printed/controller.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>

#include "../words.h"

namespace dyntape::tools {

namespace {

// By the compiler that is asked for; by gcc, if there is one, where none is.
codegen::StackUse stack_of(const PrintedController& c, const std::string& cross) {
  codegen::EmbeddedSource embedded;
  embedded.source = c.source;
  const std::string include = "#include \"" + c.name + ".h\"\n";
  embedded.source.text.replace(embedded.source.text.find(include), include.size(), c.source.header);
  embedded.entries = {c.name + "_step", c.name + "_control"};
  try {
    return measure_stack(embedded, cross_words(cross));
  } catch (const ToolError&) {
    if (cross.empty()) return {};
    throw;
  }
}

nlohmann::json json_of(const TextCount& c) {
  return {{"operations", c.operations},
          {"loads", c.loads},
          {"stores", c.stores},
          {"turns", c.turns},
          {"sum", c.sum()}};
}

nlohmann::json report_of(const PrintedController& c, const codegen::StackUse& stack,
                         const std::vector<std::string>& files) {
  return {{"name", c.name},
          {"files", files},
          {"states", c.n_x},
          {"controls", c.n_u},
          {"intervals", c.intervals},
          {"scalar", c.single ? "float" : "double"},
          {"text_bytes", c.source.text.size()},
          {"state_bytes", c.state_bytes},
          {"constant_bytes", c.constant_bytes},
          {"stack_bound", c.stack_bytes},
          {"stack_bytes", stack.bytes.empty() ? nlohmann::json(nullptr) : nlohmann::json(stack.bytes[0])},
          {"stack_measured_with", stack.with},
          {"bounds", c.bounds},
          {"parameters", c.parameter_names},
          {"step", json_of(c.of_step)},
          {"iteration", json_of(c.of_iteration)},
          {"control", json_of(c.of_control)}};
}

std::string whole(double value) { return io::with_groups(std::llround(value)); }

}  // namespace

std::vector<std::string> cross_words(const std::string& cross) {
  std::vector<std::string> words;
  std::istringstream text(cross.empty() ? "gcc" : cross);
  for (std::string word; text >> word;) words.push_back(word);
  if (words.empty()) throw ArgumentError("--cross: expected a compiler and its flags, got only spaces");
  return words;
}

CLI::Option* add_controller_options(CLI::App& command, ControllerCommand& options) {
  CLI::Option* const controller = add_path(command, "--controller", options.output,
                                           "write the controller of a task, which stands in place of the "
                                           "robot, as one C file and its header: model "
                                           "predictive control without heap, recursion, libraries or static "
                                           "variables; the header states the bound on "
                                           "its time and memory",
                                           "DIR");
  command
      .add_option("--iterations", options.iterations,
                  "controller: most iterations that a step may be asked for")
      ->transform(whole_number(1, 10000))
      ->needs(controller)
      ->capture_default_str();
  command
      .add_option("--target-bytes", options.target_bytes,
                  "controller: refuse one whose state, constants and stack take more; 0: any")
      ->transform(whole_number<std::size_t>(0, std::size_t(1) << 40))
      ->needs(controller)
      ->capture_default_str();
  add_settings(command, options.set);
  return controller;
}

void run_controller(const ControllerCommand& options) {
  const Task task = task_in(TextOfFile(options.task, options.set));
  if (!task.closing.empty() || !task.phases.empty() || task.simulated)
    throw ArgumentError("task \"" + task.name + "\" has " +
                        (task.simulated         ? "rigid contacts"
                         : task.closing.empty() ? "phases"
                                                : "a periodic motion") +
                        ", which a controller in C does not know; expected a task without");
  ControllerOptions how;
  how.mesh = task.optimise.mesh;
  how.single = options.single;
  how.name = task.name;
  how.iterations = options.iterations;
  how.target_bytes = options.target_bytes;
  const Problem problem = tracking_problem(task);
  how.stack = stack_of(generate_controller(problem, how), options.cross);
  const PrintedController c = generate_controller(problem, how);
  const std::vector<std::string> files = write_source(c.source, options.output);
  if (options.json) return print_json(report_of(c, how.stack, files));
  std::cout << c.name << ": " << c.n_x << " states, " << c.n_u << " controls, " << c.intervals
            << " intervals, " << (c.single ? "float" : "double") << "\n\n";
  io::TextTable table({{"at most"},
                       {"operations", "", io::Align::kRight},
                       {"loads", "", io::Align::kRight},
                       {"stores", "", io::Align::kRight},
                       {"turns", "", io::Align::kRight}});
  for (const auto& [name, count] :
       {std::pair("a step without iterations", c.of_step), std::pair("an iteration", c.of_iteration),
        std::pair("a control", c.of_control)})
    table.append(
        {name, whole(count.operations), whole(count.loads), whole(count.stores), whole(count.turns)});
  std::cout << table.text() << "\nbytes: state " << c.state_bytes << ", constants " << c.constant_bytes
            << ", stack below " << c.stack_bytes;
  if (!how.stack.bytes.empty()) std::cout << " (" << how.stack.bytes[0] << " with " << how.stack.with << ")";
  std::cout << "\n";
  for (const std::string& file : files) std::cout << file << "\n";
}

}  // namespace dyntape::tools
