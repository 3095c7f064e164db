// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape generate: a robot's function, with derivatives, as C source and compiled library.
#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/function/robot_functions.h>
#include <dyntape/interface/io/table.h>

#include "function_options.h"

namespace dyntape::tools {
namespace {

struct Options {
  RobotOptions robot;
  FunctionOptions function;
  std::string profile = "strict", output;
  int order = 0;
  bool json = false;
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void run(const Options& options) {
  const auto robot = load_robot(options.robot);
  const RobotFunction function = chosen(options.function.name, options.function, robot);
  CodegenOptions codegen;
  codegen.order = order_from(options.order);
  codegen.profile = profile_from(options.profile);
  codegen.route = Route::kCompiled;
  codegen.label = robot.model.name + "_" + options.function.name;

  const auto start = std::chrono::steady_clock::now();
  const Function recorded = record_robot_function(robot.model, function);
  const double record_seconds = seconds_since(start);
  const codegen::Source source = generate_source(recorded, codegen);
  const std::vector<std::string> files = write_source(source, options.output);
  const auto compiled = CompiledFunction::make(recorded, codegen);
  const Timings& t = compiled.timings();

  nlohmann::json report = {{"name", source.name},
                           {"symbol", source.symbol},
                           {"files", files},
                           {"cache_hit", t.cache_hit},
                           {"record_s", record_seconds},
                           {"derive_s", t.derive},
                           {"print_s", t.schedule + t.print},
                           {"compile_s", t.compile},
                           {"load_s", t.load}};
  io::TextTable table({{"kernel"},
                       {"operations", "", io::Align::kRight},
                       {"non-zeros", "", io::Align::kRight},
                       {"of", "", io::Align::kRight}});
  const char* const names[] = {"value", "+ Jacobian", "+ Hessian"};
  for (int k = 0; k <= options.order; ++k) {
    const auto operations = compiled.operations(order_from(k));
    const Pattern pattern = k == 0   ? Pattern{}
                            : k == 1 ? compiled.jacobian_pattern()
                                     : compiled.hessian_pattern();
    const std::size_t entries = k == 0 ? compiled.n_y() : pattern.nnz();
    const std::size_t full = k == 0   ? compiled.n_y()
                             : k == 1 ? pattern.rows * pattern.cols
                                      : pattern.rows * (pattern.rows + 1) / 2;
    table.append({names[k], io::with_groups(static_cast<long long>(operations)), std::to_string(entries),
                  std::to_string(full)});
    report["kernels"].push_back({{"order", k}, {"operations", operations}, {"non_zeros", entries}});
  }
  if (options.json) {
    std::cout << report.dump(2) << "\n";
    return;
  }
  std::cout << table.text() << "\nrecord " << io::duration(record_seconds) << ", ";
  if (t.cache_hit) {
    std::cout << "found in the cache, load " << io::duration(t.load) << "\n";
  } else {
    std::cout << "derive " << io::duration(t.derive) << ", print " << io::duration(t.schedule + t.print)
              << ", compile " << io::duration(t.compile) << ", load " << io::duration(t.load) << "\n";
  }
  for (const std::string& file : files) std::cout << file << "\n";
}

}  // namespace

void add_generate(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "generate",
      "write a function of a robot and its derivatives as self-contained C99, and compile it into the "
      "cache.\n"
      "The derivatives of --order are with respect to the entries of the state (q, v, a | tau)");
  const auto options = std::make_shared<Options>();
  add_robot_options(*command, options->robot);
  add_function_options(*command, options->function, "what to generate")->required();
  command->add_option("--order", options->order, "0: values; 1: and Jacobian; 2: and weighted Hessian")
      ->check(CLI::Range(0, 2))
      ->type_name("0|1|2")
      ->capture_default_str();
  command
      ->add_option("--profile", options->profile,
                   "strict: bit-equal to the interpreter; fast: within a tolerance")
      ->check(CLI::IsMember({"strict", "fast"}))
      ->type_name("strict|fast")
      ->capture_default_str();
  command->add_option("--output", options->output, "where the .c and .h go")->required()->type_name("DIR");
  command->add_flag("--json", options->json, "sizes and times for programs");
  command->callback([options] { run(*options); });
}

}  // namespace dyntape::tools
