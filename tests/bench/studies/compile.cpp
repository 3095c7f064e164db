// SPDX-License-Identifier: BSD-3-Clause
//
// How the cost of recording, printing, compiling and of making machine code grows with the length of a function, and what each way to
// evaluate makes one wait for (waiting.h).
#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/robot/robot_functions.h>

#include "chains.h"
#include "study.h"
#include "waiting.h"

namespace dyntape::tools {
namespace {

constexpr const char* kFunctions[] = {"rnea", "aba", "id-derivatives", "fd-derivatives"};
constexpr int kFewest = 8;
constexpr std::size_t kCompilerBytes = std::size_t{1} << 30;  // address space of each: more, and it fails
constexpr std::size_t kLongest =
    1200000;                          // operations; beyond what compilers are asked for, machine code alone
constexpr double kFirstOfFit = 5000;  // operations; below, what every compiler costs flattens the line

struct Sample {
  std::string function;
  double bodies = 0, operations = 0;
  double record = 0, machine = 0, print = 0, compile = 0;  // seconds; 0: not measured
  double megabytes = 0;                                    // the most that this process held in addition
};

// "VmHWM" or "VmRSS" of /proc/self/status, in megabytes.
double memory(const std::string& entry) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    double kilobytes = 0;
    if (word == entry + ":" && status >> kilobytes) return kilobytes / 1024;
  }
  return 0;
}

Sample sample(const std::string& name, int bodies, std::size_t most) {
  using Clock = std::chrono::steady_clock;
  const auto since = [](Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  malloc_trim(0);                               // what earlier functions left is no room for this one
  std::ofstream("/proc/self/clear_refs") << 5;  // the peak is counted from here
  const double before = memory("VmRSS");
  const auto model = chain(bodies);
  Sample s{.function = name, .bodies = static_cast<double>(bodies), .record = 1e9};
  Function recorded;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const auto start = Clock::now();
    recorded = record_robot_function(model, RobotFunction(name));
    s.record = std::min(s.record, since(start));
  }
  s.operations = static_cast<double>(total_operations(recorded));
  if (s.operations > static_cast<double>(kLongest)) return s;
  CodegenOptions options;
  options.order = Order::kValue;
  options.use_cache = false;
  options.route = Route::kMachineCode;
  s.machine = 1e9;
  for (int repeat = 0; repeat < 3; ++repeat) {
    const auto start = Clock::now();
    CompiledFunction::make(recorded, options);
    s.machine = std::min(s.machine, since(start));
  }
  if (s.operations > static_cast<double>(most)) return s;
  options.route = Route::kCompiled;
  options.compile_bytes = kCompilerBytes;
  const CompiledFunction compiled = CompiledFunction::make(recorded, options);
  const Timings& t = compiled.timings();
  s.print = t.derive + t.schedule + t.print;
  s.compile = t.compile;
  s.megabytes = memory("VmHWM") - before;
  return s;
}

struct Quantity {
  const char *name, *title, *unit;
  double Sample::*value;
};
constexpr Quantity kQuantities[] = {
    {"record", "Recording", "s", &Sample::record},
    {"machine", "Making machine code", "s", &Sample::machine},
    {"print", "Deriving, scheduling and printing", "s", &Sample::print},
    {"compile", "Compiling", "s", &Sample::compile},
    {"memory", "Memory of the process beyond what it had", "MB", &Sample::megabytes}};

}  // namespace

Study outline_of_compile() {
  Study study{.name = "compile",
              .title = "From a model to a library",
              .question = "How long until a robot's function is machine code, and in how much memory?"};
  for (const Quantity& quantity : kQuantities)
    study.parts.push_back({.name = quantity.name,
                           .title = quantity.title,
                           .x = StudyPart::kParameter,
                           .x_label = "operations",
                           .y_label = std::string("[") + quantity.unit + "]"});
  study.parts.push_back(outline_of_waiting());
  return study;
}

Study study_compile(const StudyOptions& options) {
  Study study = outline_of_compile();
  const int longest = options.quick ? 32 : 1024;
  const std::size_t most = options.quick ? 30000 : 250000;
  for (const char* function : kFunctions) {
    std::vector<std::vector<double>> operations(std::size(kQuantities)), values(std::size(kQuantities));
    for (int bodies = kFewest; bodies <= longest; bodies *= 2) {
      options.watch(std::string(function) + ", " + std::to_string(bodies) + " bodies");
      const Sample s = sample(function, bodies, most);
      if (s.machine == 0) break;
      for (std::size_t k = 0; k < std::size(kQuantities); ++k) {
        const Quantity& quantity = kQuantities[k];
        const double value = s.*quantity.value;
        if (value == 0) continue;
        operations[k].push_back(s.operations), values[k].push_back(value);
        const bool is_time = std::string(quantity.unit) == "s";
        study.rows.push_back({quantity.name, "chains of bodies", function, s.operations,
                              is_time ? value : std::numeric_limits<double>::quiet_NaN(), value});
      }
    }
    for (std::size_t k = 0; k < std::size(kQuantities); ++k) {
      const double last = values[k].back(), count = operations[k].back();
      const bool is_time = std::string(kQuantities[k].unit) == "s";
      const double slope = fitted_slope(operations[k], values[k], kFirstOfFit);
      study.parts[k].findings.push_back(
          std::string(function) + ": " +
          (std::isnan(slope) ? "" : "slope " + io::significant(slope, 2) + "; ") +
          (is_time ? io::duration(last) : io::significant(last, 3) + " MB") + " for " +
          io::with_groups((long long)(count)) + " operations" +
          (is_time ? ", " + io::significant(last / count * 1e9, 3) + " ns each." : "."));
    }
  }
  study_waiting(study, study.parts.back(), options);
  study.methods = {
      "Chains of revolute joints; recording is the least of five, compiling from an empty cache, its pieces "
      "on all cores.",
      "No compiler may take more than " + std::to_string(kCompilerBytes >> 20) + " MB of address space.",
      "Machine code is of one state, the least of three, with what precedes it: the recording is copied and "
      "scheduled.",
      "The wait is from a recording to its first result, with an empty cache; CasADi's is from its "
      "expressions on, by `gcc -march=native` in "
      "one piece, and its evaluation is called through its buffers from Python.",
      "Slopes by least squares, from " + io::with_groups((long long)(kFirstOfFit)) + " operations on."};
  study.left_out.push_back("Compilers on functions of more than " + io::with_groups((long long)(most)) +
                           " operations, machine code beyond " + io::with_groups((long long)(kLongest)) +
                           ".");
  return study;
}

}  // namespace dyntape::tools
