// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape generate: a robot's function, with derivatives, as C source and compiled library.
#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/graph/nonzero_outputs.h>
#include <dyntape/codegen/build/compile.h>
#include <dyntape/codegen/build/stack_usage.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/pipeline.h>
#include <dyntape/interface/io/stopwatch.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/robot/robot_callee.h>

#include "function_options.h"
#include "generate/controller.h"
#include "words.h"

namespace dyntape::tools {
namespace {

struct GenerateOptions {
  RobotOptions robot;
  FunctionOptions function;
  std::string functions = to_string(kDefaultFunctions), output;
  int order = 0;
  bool json = false, yes = false, nonzeros = false;

  bool embedded = false, casadi = false, single = false;
  std::string cross;  // compiler and flags that the stack is measured with
  std::string dialect = "c";
  ControllerCommand controller;
};

// Order 0: outputs of the function; 1: of the Jacobian; 2: of the lower triangle of the Hessian.
struct Entries {
  std::size_t non_zeros, places;
};
Entries entries(int order, std::size_t n_y, const Pattern& jacobian, const Pattern& hessian) {
  if (order == 0) return {n_y, n_y};
  if (order == 1) return {jacobian.nnz(), jacobian.rows * jacobian.cols};
  return {hessian.nnz(), hessian.rows * (hessian.rows + 1) / 2};
}

// By the compiler that is asked for; by gcc, if there is one, where none is.
codegen::StackUse stack_of(const codegen::EmbeddedSource& embedded, const std::string& cross) {
  try {
    return measure_stack(embedded, cross_words(cross));
  } catch (const ToolError&) {
    if (cross.empty()) return {};
    throw;
  }
}

// A slip of --order makes a text of hundreds of megabytes, and a compiler of gigabytes.
constexpr std::size_t kLargestText = 20'000'000;

// Prints how large the text is and refuses an unexpectedly large one, before anything is written or compiled.
void check_size(const GenerateOptions& options, const codegen::Source& source) {
  const std::size_t bytes = source.text.size() + source.header.size();
  const std::string size = source.name + ": " +
                           (bytes < 1'000'000 ? io::significant(double(bytes) / 1e3, 3) + " kB"
                                              : io::significant(double(bytes) / 1e6, 3) + " MB") +
                           " of C";
  if (bytes > kLargestText && !options.yes) {
    throw ArgumentError(size +
                        ", more than 20 MB, which takes a compiler minutes and gigabytes; nothing is " +
                        "written: expected a lower --order, or --yes to go on");
  }
  if (!options.json) std::cout << size << std::endl;  // ahead of the compiler
}

void run_embedded(const GenerateOptions& options, const Function& recorded, const CodegenOptions& codegen) {
  codegen::EmbeddedOptions how;
  how.single = options.single;
  const codegen::EmbeddedSource unmeasured = generate_embedded(recorded, codegen, how);
  check_size(options, unmeasured.source);
  how.stack = stack_of(unmeasured, options.cross);
  const codegen::EmbeddedSource e = generate_embedded(recorded, codegen, how);
  const std::vector<std::string> files = write_source(e.source, options.output);

  nlohmann::json report = {
      {"name", e.source.name}, {"files", files}, {"stack_measured_with", how.stack.with}};
  io::TextTable table({{"function"},
                       {"operations", "", io::Align::kRight},
                       {"static", "bytes", io::Align::kRight},
                       {"stack", "bytes", io::Align::kRight},
                       {"at most", "bytes", io::Align::kRight}});
  for (std::size_t k = 0; k < e.entries.size(); ++k) {
    const bool is_known = k < how.stack.bytes.size();
    table.append({e.entries[k], io::with_groups(e.source.operations[k]), std::to_string(e.work[k]),
                  is_known ? std::to_string(how.stack.bytes[k]) : "-",
                  e.stack_bounds[k] ? std::to_string(e.stack_bounds[k]) : "-"});
    report["functions"].push_back({{"name", e.entries[k]},
                                   {"operations", e.source.operations[k]},
                                   {"static_bytes", e.work[k]},
                                   {"stack_bytes", is_known ? nlohmann::json(how.stack.bytes[k]) : nullptr},
                                   {"stack_bound", e.stack_bounds[k]}});
  }
  if (options.json) return print_json(report);
  std::cout << table.text() << "\n";
  if (!how.stack.with.empty()) {
    std::cout << "stack with " << how.stack.with;
    for (std::size_t i = 0; i < how.stack.beyond.size(); ++i)
      std::cout << (i ? ", " : "; on top comes that of ") << how.stack.beyond[i];
    std::cout << "\n";
  }
  for (const std::string& file : files) std::cout << file << "\n";
}

// Kernels of a graphics card: text, and a header for the program that calls them.
void run_device(const GenerateOptions& options, const Function& recorded, const CodegenOptions& codegen) {
  const bool is_cuda = options.dialect == "cuda";
  codegen::DeviceOptions how;
  how.language = is_cuda ? codegen::DeviceLanguage::kCuda : codegen::DeviceLanguage::kOpenCl;
  how.single = options.single;
  const codegen::DeviceSource d = generate_device(recorded, codegen, how);
  check_size(options, d.source);
  const std::vector<std::string> files = write_source(d.source, options.output, is_cuda ? ".cu" : ".cl");
  nlohmann::json report = {{"name", d.source.name}, {"files", files}, {"dialect", options.dialect}};
  io::TextTable table({{"kernel"},
                       {"operations", "", io::Align::kRight},
                       {"in", "numbers", io::Align::kRight},
                       {"out", "numbers", io::Align::kRight},
                       {"memory a state", "bytes", io::Align::kRight}});
  const auto sum = [](const auto& entries) {
    return std::accumulate(std::begin(entries), std::end(entries), std::size_t{0});
  };
  for (std::size_t k = 0; k < d.kernels.size(); ++k) {
    const codegen::DeviceKernel& kernel = d.kernels[k];
    table.append({kernel.name, io::with_groups(d.source.operations[k]), std::to_string(sum(kernel.inputs)),
                  std::to_string(sum(kernel.outputs)), std::to_string(kernel.work)});
    report["kernels"].push_back({{"name", kernel.name},
                                 {"operations", d.source.operations[k]},
                                 {"in", sum(kernel.inputs)},
                                 {"out", sum(kernel.outputs)},
                                 {"guarded", kernel.is_guarded},
                                 {"memory_bytes", kernel.work}});
  }
  if (options.json) return print_json(report);
  std::cout << table.text() << "\n";
  for (const std::string& file : files) std::cout << file << "\n";
}

void run_casadi(const GenerateOptions& options, const dynamics::Model<double>& model,
                const RobotFunction& function, const Function& recorded, const CodegenOptions& codegen) {
  codegen::CasadiBlocks blocks;
  const auto add = [](std::vector<codegen::CasadiBlock>& to, const std::vector<RobotBlock>& from) {
    for (const RobotBlock& block : from)
      to.push_back({block.name, std::size_t(block.rows), std::size_t(block.cols * block.pages)});
  };
  add(blocks.inputs, inputs(model, function)), add(blocks.outputs, outputs(model, function));
  const codegen::Source source = generate_casadi(recorded, blocks, codegen);
  check_size(options, source);
  std::vector<std::string> files = write_source(source, options.output);
  if (const auto compiler = codegen::find_compiler("", {})) {
    const std::string library = files[0].substr(0, files[0].size() - 1) + "so";
    compile_casadi(source, library, codegen);
    files.push_back(library);
  } else if (!options.json) {
    std::cout << codegen::no_compiler("") << ": no library is made\n";
  }
  if (options.json) return print_json({{"name", source.name}, {"files", files}, {"order", options.order}});
  for (const std::string& file : files) std::cout << file << "\n";
  std::cout << "in Python: casadi.external('" << source.name << "', '" << files.back() << "')\n";
}

void run(const GenerateOptions& options) {
  if (!options.controller.output.empty()) {
    ControllerCommand controller = options.controller;
    controller.task = options.robot.path, controller.single = options.single;
    controller.json = options.json, controller.cross = options.cross;
    return run_controller(controller);
  }
  if (!options.cross.empty() && !options.embedded)
    throw CLI::RequiresError("--cross", "--embedded or --controller");
  if (!options.controller.set.empty()) throw CLI::RequiresError("--set", "--controller");
  if (options.single && !options.embedded && options.dialect == "c")
    throw CLI::RequiresError("--float", "--embedded, --controller, or --dialect opencl or cuda");
  if (options.robot.path.ends_with(".info"))
    throw ArgumentError(options.robot.path + ": a task; expected a robot (.urdf), or --controller DIR");
  if (options.function.name.empty()) throw CLI::RequiredError("--function");
  if (options.output.empty()) throw CLI::RequiredError("--output");
  const auto robot = load_robot(options.robot);
  const RobotFunction function = chosen(options.function.name, options.function, robot);
  CodegenOptions codegen;
  codegen.order = order_from(options.order);
  codegen.functions = functions_from(options.functions);
  const bool has_compiler = codegen::find_compiler("", {}).has_value();
  codegen.route = has_compiler ? Route::kCompiled : Route::kMachineCode;  // to count what the text holds
  codegen.label = robot.model.name + "_" + options.function.name;

  const auto start = std::chrono::steady_clock::now();
  Function recorded = record_differentiable(robot.model, function);
  if (options.nonzeros) recorded = nonzero_outputs(recorded).function;
  const double record_seconds = seconds_since(start);
  if (options.dialect != "c") return run_device(options, recorded, codegen);
  if (options.embedded) return run_embedded(options, recorded, codegen);
  if (options.casadi) return run_casadi(options, robot.model, function, recorded, codegen);
  const codegen::Source source = generate_source(recorded, codegen);
  check_size(options, source);
  const std::vector<std::string> files = write_source(source, options.output);
  const auto compiled = CompiledFunction::make(recorded, codegen);
  const Timings& t = compiled.timings();

  nlohmann::json report = {{"compiled", has_compiler},
                           {"name", source.name},
                           {"symbol", source.symbol},
                           {"files", files},
                           {"bytes", source.text.size() + source.header.size()},
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
    const auto [non_zeros, places] =
        entries(k, compiled.n_y(), k >= 1 ? compiled.jacobian_pattern() : Pattern{},
                k >= 2 ? compiled.hessian_pattern() : Pattern{});
    table.append({names[k], io::with_groups(operations), std::to_string(non_zeros), std::to_string(places)});
    report["kernels"].push_back({{"order", k}, {"operations", operations}, {"non_zeros", non_zeros}});
  }
  if (options.json) return print_json(report);
  std::cout << table.text() << "\nrecord " << io::duration(record_seconds) << ", ";
  if (!has_compiler) {
    std::cout << codegen::no_compiler("") << ": nothing is compiled into the cache\n";
  } else if (t.cache_hit) {
    std::cout << "found in the cache, load " << io::duration(t.load) << "\n";
  } else {
    std::cout << "derive " << io::duration(t.derive) << ", print " << io::duration(t.schedule + t.print)
              << ", compile " << io::duration(t.compile) << ", load " << io::duration(t.load) << "\n";
  }
  for (const std::string& file : files) std::cout << file << "\n";
}

}  // namespace

void add_generate(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("generate",
                         "write a function of a robot and its derivatives as self-contained C99; if there is "
                         "a compiler, also\ncompile it into the cache.  Derivatives are with respect to the "
                         "entries of the state (q, v, a or tau)");
  const auto options = std::make_shared<GenerateOptions>();
  add_robot_options(*command, options->robot);
  command->get_option("robot")->description(
      "the robot, a URDF file; with --controller a task, an .info file");
  CLI::Option* const function = add_function_options(*command, options->function,
                                                     "function to generate; required without --controller");
  command->add_option("--order", options->order, "0: values; 1: and Jacobian; 2: and weighted Hessian")
      ->transform(whole_number(0, 2))
      ->type_name("0|1|2")
      ->capture_default_str();
  add_choice(
      *command, "--functions", options->functions,
      "sines: sin and cos in the text, within 0.82 ulp, with the same bits on every processor, quicker "
      "than libm's, others libm's; libm: all libm's; portable: others SLEEF's, with the same bits on "
      "every processor (link with -lsleef)",
      {"sines", "libm", "portable"})
      ->capture_default_str();
  CLI::Option* const output = add_path(*command, "--output", options->output,
                                       "folder for the .c and .h file; required without --controller", "DIR");
  CLI::Option* const embedded = command->add_flag(
      "--embedded", options->embedded,
      "plain functions of x, p, w for a microcontroller or a program of one's own: no descriptor, heap or "
      "library but libm; stack and static bytes stated; nothing is compiled into the cache");
  CLI::Option* const nonzeros = command->add_flag("--nonzeros", options->nonzeros,
                                                  "only the outputs that are not zero everywhere, of a "
                                                  "symmetric matrix one triangle; the text names each");
  CLI::Option* const casadi = command->add_flag(
      "--casadi", options->casadi,
      "with the interface of casadi.external and acados: values, and with --order 2 sparse Jacobians and "
      "exact Hessians; NAME.c and, where there is a compiler, NAME.so");
  casadi->excludes(embedded)->excludes(nonzeros);
  add_choice(
      *command, "--dialect", options->dialect,
      "opencl, cuda: kernels of a graphics card, one state a work-item, entry i of state s at "
      "[i * count + s] of every array; NAME.cl or NAME.cu, and NAME.h with the places of the non-zeros",
      {"c", "opencl", "cuda"})
      ->excludes(embedded)
      ->excludes(casadi)
      ->capture_default_str();
  CLI::Option* const controller = add_controller_options(*command, options->controller);
  controller->excludes(function)->excludes(output)->excludes(embedded)->excludes(casadi)->excludes(nonzeros);
  for (const char* of_robots : {"--dialect", "--order", "--functions", "--base", "--lock", "--snap"})
    controller->excludes(of_robots);
  command->add_flag("--float", options->single,
                    "embedded, controller, opencl, cuda: float instead of double");
  command
      ->add_option("--cross", options->cross,
                   "embedded, controller: the gcc and flags that the stack is measured with, in one word "
                   "(default: gcc -O2)")
      ->type_name("\"CC FLAGS\"");
  command->add_flag("--yes", options->yes, "continue if the C text is larger than 20 MB");
  command->add_flag("--json", options->json, "print sizes and times as JSON");
  command->callback([options] { run(*options); });
}

}  // namespace dyntape::tools
