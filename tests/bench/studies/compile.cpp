// SPDX-License-Identifier: BSD-3-Clause
//
// How the cost of recording, printing and compiling grows with the length of a function.
#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <fstream>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/robot/robot_functions.h>

#include "chains.h"
#include "study.h"

namespace dyntape::tools {
namespace {

constexpr const char* kFunctions[] = {"rnea", "aba", "id-derivatives", "fd-derivatives"};
constexpr int kFewest = 8;
constexpr std::size_t kCompilerBytes = std::size_t{1} << 30;  // address space of each: more, and it fails
constexpr double kFirstOfFit = 5000;  // operations; below, what every compiler costs flattens the line

struct Sample {
  std::string function;
  double bodies = 0, operations = 0;
  double record = 0, print = 0, compile = 0;  // seconds
  double megabytes = 0;                       // the most that this process held in addition
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
  if (s.operations > static_cast<double>(most)) return s;
  CodegenOptions options;
  options.order = Order::kValue;
  options.use_cache = false;
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
  return study;
}

Study study_compile(const StudyOptions& options) {
  Study study = outline_of_compile();
  const int longest = options.quick ? 32 : 256;
  const std::size_t most = options.quick ? 30000 : 250000;
  for (const char* function : kFunctions) {
    std::vector<double> operations;
    std::vector<std::vector<double>> values(std::size(kQuantities));
    for (int bodies = kFewest; bodies <= longest; bodies *= 2) {
      options.watch(std::string(function) + ", " + std::to_string(bodies) + " bodies");
      const Sample s = sample(function, bodies, most);
      if (s.compile == 0) break;
      operations.push_back(s.operations);
      for (std::size_t k = 0; k < std::size(kQuantities); ++k) {
        const Quantity& quantity = kQuantities[k];
        values[k].push_back(s.*quantity.value);
        const bool is_time = std::string(quantity.unit) == "s";
        study.rows.push_back({quantity.name, "chains of bodies", function, s.operations,
                              is_time ? values[k].back() : std::numeric_limits<double>::quiet_NaN(),
                              values[k].back()});
      }
    }
    for (std::size_t k = 0; k < std::size(kQuantities); ++k) {
      const double last = values[k].back();
      study.parts[k].findings.push_back(
          std::string(function) + ": slope " +
          io::significant(fitted_slope(operations, values[k], kFirstOfFit), 2) + "; " +
          (k == 3 ? io::significant(last, 3) + " MB" : io::duration(last)) + " for " +
          io::with_groups((long long)(operations.back())) + " operations.");
    }
  }
  study.methods = {
      "Chains of revolute joints; recording is the least of five, compiling from an empty cache, its pieces "
      "on all cores.",
      "No compiler may take more than " + std::to_string(kCompilerBytes >> 20) + " MB of address space.",
      "Slopes by least squares, from " + io::with_groups((long long)(kFirstOfFit)) + " operations on."};
  study.left_out = {"Functions of more than " + io::with_groups((long long)(most)) + " operations."};
  return study;
}

}  // namespace dyntape::tools
