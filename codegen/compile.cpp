// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/compile.h>

#include <algorithm>
#include <numeric>
#include <thread>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/lane_widths.h>
#include <dyntape/codegen/process.h>

namespace dyntape::codegen {
namespace {

// Pieces [first, last] that one compiler takes.
struct Unit {
  std::size_t first, last;
};

unsigned jobs_of(const CodegenOptions& options) {
  return options.jobs ? options.jobs : std::max(1u, std::thread::hardware_concurrency());
}

// Straight lines leave little to optimise: -O2 and -O3 give the same speed within 5 % and take 1.4 to 2 times as
// long (four robots, values and derivatives).  -O0 takes half as long and runs at the speed of the interpreter.
constexpr const char* kLevel = "-O1";

// Starting a compiler costs as much as a few pieces, and the last one to end is waited for: three units a
// job.  A compiler reads its whole unit before it optimises the first piece: the largest bounds its memory.
std::vector<Unit> units_of(const std::vector<std::size_t>& pieces, unsigned jobs) {
  const std::size_t total = std::accumulate(pieces.begin(), pieces.end(), std::size_t{0});
  constexpr std::size_t kSmallestUnit = 1200, kLargestUnit = 20000;  // statements
  const std::size_t wanted = std::max(
      std::clamp<std::size_t>(total / kSmallestUnit, 1, std::size_t{jobs} * 3), total / kLargestUnit);
  std::vector<Unit> units;
  std::size_t first = 0, done = 0;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    done += pieces[k];
    const bool is_full = done * wanted >= total * (units.size() + 1);
    if (is_full || k + 1 == pieces.size()) {
      units.push_back({first, k});
      first = k + 1;
    }
    if (first == pieces.size()) break;
  }
  return units;
}

[[noreturn]] void fail(const Command& command, const Outcome& outcome, const CodegenOptions& options,
                       const std::string& source) {
  std::string reason = "ended with exit status " + std::to_string(outcome.status);
  if (outcome.status == Outcome::kTimedOut)
    reason = "was ended after " + std::to_string(static_cast<long>(options.compile_seconds)) + " s";
  if (outcome.status == Outcome::kStopped) reason = "was told to stop";
  if (outcome.status == Outcome::kNotStarted) reason = "could not be run";
  if (outcome.output.find("cannot find -lsleef") != std::string::npos ||
      outcome.output.find("unable to find library -lsleef") != std::string::npos)
    reason = "does not find SLEEF (Debian: libsleef-dev), which portable functions need";
  throw ToolError("the compiler " + reason + "; the source is kept in " + source + "\n  " +
                  to_text(command.arguments) + "\n" + outcome.output);
}

void run(const std::vector<Command>& commands, const CodegenOptions& options, const std::string& source) {
  const std::vector<Outcome> outcomes =
      run_all(commands, {jobs_of(options), options.compile_seconds, options.compile_bytes, options.stop});
  for (std::size_t i = 0; i < commands.size(); ++i) {
    if (outcomes[i].status != 0) fail(commands[i], outcomes[i], options, source);
  }
}

std::vector<std::string> libraries(const CodegenOptions& options) {
  return options.functions == Functions::kPortable ? std::vector<std::string>{"-lsleef", "-lm"}
                                                   : std::vector<std::string>{"-lm"};
}

// The kernels of several lanes that the descriptor is to list.
std::vector<std::string> listed(const std::vector<unsigned>& widths) {
  std::vector<std::string> flags;
  for (unsigned width : widths) flags.push_back("-DDYNTAPE_X" + std::to_string(width));
  return flags;
}

}  // namespace

void compile(const Compiler& compiler, const Source& source, const CodegenOptions& options,
             const std::string& folder, const std::string& final_folder) {
  const std::string text = folder + "/" + kSourceFile, library = folder + "/" + kLibraryFile;
  std::vector<std::string> base = {compiler.path};
  if (compiler.chooses_level) {
    base.push_back(kLevel);
    // On straight lines gcc's older allocation of registers gives 5 % shorter and 3 to 5 % faster code.
    if (compiler.version.starts_with("gcc version")) base.push_back("-fira-algorithm=priority");
  }
  base.insert(base.end(), compiler.flags.begin(), compiler.flags.end());
  // A debugger looks for the source where it will lie.
  if (folder != final_folder) base.push_back("-ffile-prefix-map=" + folder + "=" + final_folder);
  const auto command = [&](std::vector<std::string> more, const std::string& log) {
    Command c{base, folder + "/" + log, folder};
    c.arguments.insert(c.arguments.end(), more.begin(), more.end());
    return c;
  };
  const std::vector<unsigned> widths = lane_widths(options.lanes);
  const std::vector<Unit> units = units_of(source.pieces, jobs_of(options));
  std::vector<std::string> link = {"-shared", "-o", library};
  if (units.size() == 1 && widths.empty()) {
    link.push_back(text);
  } else {
    std::vector<Command> commands;
    const auto add = [&](const Unit& unit, const std::string& kind, std::vector<std::string> flags) {
      const std::string name = "unit-" + std::to_string(unit.first) + kind,
                        object = folder + "/" + name + ".o";
      if (units.size() > 1) {
        flags.push_back("-DDYNTAPE_FIRST=" + std::to_string(unit.first));
        flags.push_back("-DDYNTAPE_LAST=" + std::to_string(unit.last));
      }
      flags.insert(flags.end(), {"-c", "-o", object, text});
      commands.push_back(command(std::move(flags), name + ".log"));
      link.push_back(object);
    };
    for (const Unit& unit : units) {
      add(unit, "", listed(widths));
      for (unsigned width : widths) add(unit, "-x" + std::to_string(width), lane_flags(width));
    }
    run(commands, options, text);
  }
  for (const std::string& name : libraries(options)) link.push_back(name);
  run({command(std::move(link), "log")}, options, text);
}

}  // namespace dyntape::codegen
