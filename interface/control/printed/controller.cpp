// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/printed/controller.h>

#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/print/c_text.h>
#include <dyntape/interface/control/printed/print_controller.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>

namespace dyntape {

namespace {

std::string whole(double value) { return io::with_groups(std::llround(value)); }

std::string line(const std::string& what, const TextCount& count) {
  return " *   " + what + ": " + whole(count.operations) + " operations, " + whole(count.loads) + " loads, " +
         whole(count.stores) + " stores, " + whole(count.turns) + " turns and calls; together " +
         whole(count.sum()) + "\n";
}

std::string banner(const PrintedController& c, const ControllerOptions& options) {
  std::string text =
      "/* Model predictive controller \"" + codegen::c_comment(c.name) + "\", printed by dyntape.\n *\n";
  text +=
      " * C99 in " + std::string(c.single ? "float" : "double") +
      ", without heap, recursion, libraries or static variables.  For the same bits everywhere compile with\n"
      " * -ffp-contract=off and never with -ffast-math.\n *\n * At most:\n";
  text += line("a step with a budget of 0", c.of_step) + line("each iteration of a step", c.of_iteration) +
          line("a control", c.of_control);
  text += " *   iterations of a step: " + std::to_string(options.iterations) +
          "; interior-point steps of an iteration: " + std::to_string(options.interior_steps) +
          "; trials of its line search: " + std::to_string(options.trials) + "\n *\n * Bytes:\n";
  text += " *   state " + whole(double(c.state_bytes)) + ", constants " + whole(double(c.constant_bytes)) +
          ", stack below " + whole(double(c.stack_bytes)) + " at any optimisation level\n";
  if (!options.stack.bytes.empty())
    text += " *   stack of a step " + whole(double(options.stack.bytes[0])) + " with " +
            codegen::c_comment(options.stack.with) + "\n";
  return text + " */\n";
}

void check_target(const PrintedController& c, std::size_t target) {
  const std::size_t needed = c.state_bytes + c.constant_bytes + c.stack_bytes;
  if (target == 0 || needed <= target) return;
  throw ArgumentError("controller \"" + c.name + "\": state, constants and stack take " +
                      whole(double(c.state_bytes)) + " + " + whole(double(c.constant_bytes)) + " + " +
                      whole(double(c.stack_bytes)) + " = " + whole(double(needed)) +
                      " bytes, more than the target's " + whole(double(target)) +
                      "; expected fewer intervals" + (c.single ? "" : ", or single precision"));
}

}  // namespace

PrintedController generate_controller(const Problem& problem, const ControllerOptions& options) {
  const ControllerParts parts = controller_parts(problem, options);
  PrintedController c = print_controller(parts, options);
  const std::string step = c.name + "_step";
  c.of_step = CountedText(c.source.text, {{"DT_MOST_ITERATIONS", 0}}).of(step);
  const CountedText with_one(c.source.text, {{"DT_MOST_ITERATIONS", 1}});
  c.of_iteration = with_one.of(step) + (-1.0 * c.of_step);
  c.of_control = with_one.of(c.name + "_control");
  check_target(c, options.target_bytes);
  const std::string about = banner(c, options);
  c.source.text = about + c.source.text;
  c.source.header = about + c.source.header;
  return c;
}

}  // namespace dyntape
