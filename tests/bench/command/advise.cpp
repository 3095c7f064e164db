// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape advise: how a task is best solved on this machine, to so many digits.
#include <cmath>
#include <iostream>
#include <memory>

#include <dyntape/interface/io/live_line.h>
#include <dyntape/interface/io/table.h>

#include "../studies/advice.h"
#include "../studies/report.h"
#include "bench_commands.h"
#include "commands.h"
#include "host.h"
#include "words.h"

namespace dyntape::tools {
namespace {

struct Wanted {
  std::string task, output;
  int digits = 6;
  AdviceOptions how;
};

std::string number_or_dash(double value, std::string (*text)(double)) {
  return std::isnan(value) ? "-" : text(value);
}

void run(const Wanted& wanted) {
  const Task task = read_task(wanted.task);
  if (!wanted.output.empty()) prepare_folder(wanted.output, {"advice.csv", "advice.md"});
  Advice advice;
  {
    io::LiveLine line;
    AdviceOptions how = wanted.how;
    how.digits = wanted.digits;
    how.watch = [&line](const std::string& doing) { line.show("measuring " + doing); };
    advice = advise(task, how);
  }
  std::cout << "Task \"" << task.name << "\" to " << wanted.digits << " digits, on " << processor_name()
            << ", " << compiler_name() << "\nThe optimum is " << io::significant(advice.reference, 10)
            << ", known to " << io::scientific(advice.known_to) << " of itself.\n\n";
  io::TextTable table({{"of"}, {"take"}, {"time", "", io::Align::kRight}, {"error", "", io::Align::kRight}});
  for (const Choice& choice : advice.choices)
    table.append({choice.what, choice.chosen,
                  number_or_dash(choice.seconds, [](double s) { return io::duration(s); }),
                  number_or_dash(choice.error, [](double e) { return io::scientific(e); })});
  std::cout << table.text() << "\n";
  for (const Choice& choice : advice.choices) {
    if (!choice.measured.empty()) std::cout << choice.what << "\n";
    for (const std::string& line : choice.measured) std::cout << "- " << line << "\n";
  }
  std::cout
      << "\nTimes: of a solve from the task's guess; of the integrator, of a simulated second.\n"
         "What is quicker by less than a twentieth, or not each time that both are measured in turn, is "
         "noise: then the\none before it is taken.\n";
  if (const double known = 3 * advice.known_to; known > std::pow(10.0, -wanted.digits))
    std::cout << "So many digits of the optimum are not known: what is taken keeps " << io::scientific(known)
              << ".\n";
  if (!advice.reached)
    std::cout << "The digits are not reached in the time given: a longer --seconds, or fewer --digits.\n";
  std::cout << "\nAs keys of the task file:\n\n" << advice.keys;
  if (wanted.output.empty()) return;
  std::cout << "\n";
  for (const std::string& file : write_study(advice.study, {}, wanted.output)) std::cout << file << "\n";
}

}  // namespace

void add_advise(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "advise",
      "measure on this machine how a task is best solved: scheme, mesh, Hessian, solver, route and\n"
      "integrator for so many digits, with the figures behind it and the keys to write into the task");
  const auto wanted = std::make_shared<Wanted>();
  command->add_option("task", wanted->task, "the task, an .info file (config/tasks)")
      ->required()
      ->check(not_empty())
      ->type_name("TASK.info");
  command->add_option("--digits", wanted->digits, "of the cost and of the motion, relative")
      ->transform(whole_number(1, 10))
      ->capture_default_str();
  command
      ->add_option("--solves", wanted->how.solves, "how often the task is solved before it is compiled again")
      ->transform(positive_number())
      ->capture_default_str();
  command->add_option("--seconds", wanted->how.seconds, "of measuring; what is begun is ended")
      ->transform(positive_number())
      ->capture_default_str();
  command->add_option("--output", wanted->output, "where all points go: advice.csv, pictures and a page")
      ->check(not_empty())
      ->type_name("DIR");
  command->callback([wanted] { run(*wanted); });
}

}  // namespace dyntape::tools
