// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/build/compile.h>

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <numeric>
#include <sstream>
#include <thread>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/build/identity.h>
#include <dyntape/codegen/options/lane_widths.h>
#include <dyntape/codegen/system/process.h>

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

// Whether the compiler failed for want of room, not because of the text.
bool mentions_any(const std::string& output, std::initializer_list<const char*> phrases) {
  return std::any_of(phrases.begin(), phrases.end(),
                     [&](const char* phrase) { return output.find(phrase) != std::string::npos; });
}
bool is_disk_full(const Outcome& outcome) {
  return mentions_any(outcome.output, {"No space left on device", "Disk quota exceeded"});
}
bool is_no_fault_of_the_text(const Outcome& outcome) {
  return outcome.status == Outcome::kNotStarted || outcome.status == 128 + SIGKILL ||
         mentions_any(outcome.output,
                      {"annot allocate memory", "virtual memory exhausted", "out of memory", "Out of memory",
                       "Too many open files", "Resource temporarily unavailable", "signal terminated program",
                       "internal compiler error"});
}

std::string reason_of(const Outcome& outcome, const CodegenOptions& options) {
  if (outcome.status == Outcome::kTimedOut)
    return "was ended after " + std::to_string(static_cast<long>(options.compile_seconds)) + " s";
  if (outcome.status == Outcome::kStopped) return "was interrupted";
  if (outcome.status == Outcome::kNotStarted) return "could not be run";
  if (outcome.status == Outcome::kUnknown) return "made nothing";
  if (mentions_any(outcome.output, {"cannot find -lsleef", "unable to find library -lsleef"}))
    return "does not find SLEEF (Debian: libsleef-dev), which portable functions need";
  return "ended with exit status " + std::to_string(outcome.status);
}

[[noreturn]] void fail(const Command& command, const Outcome& outcome, const CodegenOptions& options,
                       const std::string& source) {
  const std::string what = "the compiler " + reason_of(outcome, options),
                    how = to_text(command.arguments) + "\n" + outcome.output;
  if (is_disk_full(outcome))
    throw FileError(source.substr(0, source.rfind('/')) + ": the disk is full: " + what);
  if (outcome.status == Outcome::kStopped) throw ToolError(what);  // and nothing is kept
  if (access(source.c_str(), F_OK) != 0)
    throw FileError(source.substr(0, source.rfind('/')) + ": removed while a compiler was at work in it");
  const std::string message = what + "; the source is kept in " + source + "\n  " + how;
  if (is_no_fault_of_the_text(outcome)) throw Unavailable(message);
  throw ToolError(message);
}

// What a command makes: the file after -o.
std::string result_of(const Command& command) {
  const auto& arguments = command.arguments;
  return *std::next(std::find(arguments.begin(), arguments.end(), "-o"));
}

// How many of how many runs of the compiler are done.
struct Pieces {
  std::size_t done, of;
};

void run(const std::vector<Command>& commands, const CodegenOptions& options, const std::string& source,
         const Pieces& pieces) {
  const auto tell = [&](std::size_t ended) {
    if (options.compiled_piece) options.compiled_piece(pieces.done + ended, pieces.of);
  };
  tell(0);
  std::vector<Outcome> outcomes = run_all(
      commands, {jobs_of(options), options.compile_seconds, options.compile_bytes, options.stop, tell});
  for (std::size_t i = 0; i < commands.size(); ++i) {
    const bool is_made = access(result_of(commands[i]).c_str(), F_OK) == 0;
    if (outcomes[i].status == Outcome::kUnknown && is_made) outcomes[i].status = 0;
    if (outcomes[i].status != 0) fail(commands[i], outcomes[i], options, source);
  }
}

// The key knows what the text says, and what the headers say that every text includes: a body of a kernel that is
// written by hand includes nothing else.
void check_includes(const Source& source) {
  std::istringstream lines(source.text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t hash = line.find_first_not_of(" \t");
    if (hash == std::string::npos || line[hash] != '#') continue;
    const std::size_t word = line.find_first_not_of(" \t", hash + 1);
    if (word == std::string::npos || line.compare(word, 7, "include") != 0) continue;
    const auto& known = included_headers();
    const bool is_known = std::any_of(known.begin(), known.end(), [&](const std::string& header) {
      return line.substr(word) == "include " + header;
    });
    if (is_known) continue;
    throw ArgumentError(
        "\"" + source.name + "\": the C body of a kernel has the line \"" + line.substr(hash) +
        "\"; what a file says would not be part of the key of the library, write it into the body");
  }
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
  check_includes(source);
  const std::string text = folder + "/" + kSourceFile, library = folder + "/" + kLibraryFile;
  std::vector<std::string> base = {compiler.path};
  if (compiler.chooses_level) {
    base.push_back(kLevel);
#if defined(__x86_64__)
    // On straight lines gcc's older allocation of registers gives 5 % shorter and 3 to 5 % faster code; where there are 32 registers,
    // longer code.
    if (compiler.version.starts_with("gcc version")) base.push_back("-fira-algorithm=priority");
#endif
  }
  base.insert(base.end(), compiler.flags.begin(), compiler.flags.end());
  // A debugger looks for the source where it will lie.
  if (folder != final_folder) base.push_back("-ffile-prefix-map=" + folder + "=" + final_folder);
  const auto command = [&](std::vector<std::string> more) {
    Command c{base, "", folder};
    c.arguments.insert(c.arguments.end(), more.begin(), more.end());
    return c;
  };
  const std::vector<unsigned> widths = lane_widths(options.lanes);
  const std::vector<Unit> units = units_of(source.pieces, jobs_of(options));
  std::vector<std::string> link = {"-shared", "-o", library};
  Pieces pieces{0, 1};
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
      commands.push_back(command(std::move(flags)));
      link.push_back(object);
    };
    for (const Unit& unit : units) {
      add(unit, "", listed(widths));
      for (unsigned width : widths) add(unit, "-x" + std::to_string(width), lane_flags(width));
    }
    pieces.of = commands.size() + 1;
    run(commands, options, text, pieces);
    pieces.done = commands.size();
  }
  if (source.needs_sleef) link.push_back("-lsleef");
  link.push_back("-lm");
  run({command(std::move(link))}, options, text, pieces);
}

}  // namespace dyntape::codegen
