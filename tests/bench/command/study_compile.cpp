// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape study compile: how the cost of recording, printing and compiling grows with the length of a function.
#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iostream>
#include <memory>
#include <sstream>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/io/live_line.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/picture.h>
#include <dyntape/interface/io/table.h>

#include "chains.h"
#include "host.h"
#include "measure.h"
#include "study.h"
#include "words.h"

namespace dyntape::tools {
namespace {

struct Options {
  std::string output;
  int bodies = 256;
  std::size_t operations = 250000;  // longer functions are left out
};

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
  const char *title, *unit;
  double Sample::*value;
};
constexpr Quantity kQuantities[] = {{"recording", "s", &Sample::record},
                                    {"deriving, scheduling, printing", "s", &Sample::print},
                                    {"compiling", "s", &Sample::compile},
                                    {"memory of the process", "MB", &Sample::megabytes}};

struct Growth {
  std::vector<double> x, y;
  double slope() const { return fitted_slope(x, y, kFirstOfFit); }
};

Growth growth(const std::vector<Sample>& samples, const std::string& function, double Sample::*value) {
  Growth g;
  for (const Sample& s : samples) {
    if (s.function != function) continue;
    g.x.push_back(s.operations);
    g.y.push_back(s.*value);
  }
  return g;
}

std::string csv(const std::vector<Sample>& samples) {
  std::ostringstream text;
  text << "shape,function,bodies,operations,record_s,print_s,compile_s,process_mb,processor,compiler,"
          "dyntape\n";
  for (const Sample& s : samples) {
    text << "chain," << s.function << "," << s.bodies << "," << io::shortest(s.operations) << ","
         << io::shortest(s.record) << "," << io::shortest(s.print) << "," << io::shortest(s.compile) << ","
         << io::shortest(s.megabytes) << ",\"" << processor_name() << "\",\"" << compiler_name() << "\","
         << DYNTAPE_VERSION << "\n";
  }
  return text.str();
}

io::Plot picture(const std::vector<Sample>& samples) {
  io::Plot plot{.title = "From a model to a library: chains of bodies", .columns = 2, .width = 1280};
  for (const Quantity& quantity : kQuantities) {
    io::Panel panel{.title = quantity.title, .y_label = std::string("[") + quantity.unit + "]"};
    panel.log_x = panel.log_y = true;
    if (plot.panels.size() >= 2) panel.x_label = "operations";
    for (const char* function : kFunctions) {
      const Growth g = growth(samples, function, quantity.value);
      io::Series series{.name = std::string(function) + ", slope " + io::significant(g.slope(), 2),
                        .mark = io::Mark::kBoth};
      series.x = g.x;
      series.y = g.y;
      panel.series.push_back(series);
    }
    plot.panels.push_back(panel);
  }
  return plot;
}

void print(const std::vector<Sample>& samples) {
  io::TextTable table({{"function"},
                       {"bodies", "", io::Align::kRight},
                       {"operations", "", io::Align::kRight},
                       {"record", "ms", io::Align::kRight},
                       {"print", "ms", io::Align::kRight},
                       {"compile", "ms", io::Align::kRight},
                       {"process", "MB", io::Align::kRight}});
  for (const char* function : kFunctions) {
    const auto last = std::find_if(samples.rbegin(), samples.rend(),
                                   [&](const Sample& s) { return s.function == function; });
    table.append({function, io::shortest(last->bodies), io::shortest(last->operations),
                  io::significant(last->record * 1e3, 3), io::significant(last->print * 1e3, 3),
                  io::significant(last->compile * 1e3, 3), io::significant(last->megabytes, 3)});
  }
  std::cout << table.text() << "the longest of each; no compiler took more than " << (kCompilerBytes >> 20)
            << " MB of address space\n";
}

void run(const Options& options) {
  prepare_folder(options.output, {"compile.csv", "compile.svg"});
  std::vector<Sample> samples;
  {
    io::LiveLine line;
    for (std::size_t f = 0; f < std::size(kFunctions); ++f) {
      for (int bodies = kFewest; bodies <= options.bodies; bodies *= 2) {
        line.show("measuring " + std::string(kFunctions[f]) + " " + std::to_string(bodies));
        const Sample s = sample(kFunctions[f], bodies, options.operations);
        if (s.compile == 0) break;
        samples.push_back(s);
      }
    }
  }
  print(samples);
  const std::string data = options.output + "/compile.csv", drawing = options.output + "/compile.svg";
  dyntape::write_file_atomically(data, csv(samples));
  io::draw(picture(samples), drawing);
  std::cout << data << "\n" << drawing << "\n";
}

}  // namespace

void add_compile(CLI::App& study) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = study.add_subcommand("compile",
                                           "how time and memory of recording, printing and compiling grow "
                                           "with the number of operations, on chains\n"
                                           "of revolute joints");
  command->add_option("--output", options->output, "where compile.csv and compile.svg go")
      ->check(not_empty())
      ->required()
      ->type_name("DIR");
  command->add_option("--bodies", options->bodies, "of the longest chain")
      ->transform(whole_number(4 * kFewest, 1024))
      ->capture_default_str();
  command->add_option("--operations", options->operations, "longer functions are left out")
      ->transform(whole_number(std::size_t{20000}, std::size_t{100000000}))
      ->capture_default_str();
  command->callback([options] { run(*options); });
}

}  // namespace dyntape::tools
