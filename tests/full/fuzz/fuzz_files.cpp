// SPDX-License-Identifier: BSD-3-Clause
//
// Shipped robots, scenes and tables with random changes, read again: each is read, or refused with an Error that has a sentence.
//
//   fuzz_files CONFIG_FOLDER --seconds 3600 --first-seed 1
//
// Anything else, a crash above all, is a defect; its seed makes the same file again.  Under the address sanitizer where the build
// has it.  Exit status 1 where an exception is none of ours.
#include <CLI/CLI.hpp>

#include <filesystem>
#include <iostream>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/live_line.h>

#include "file_reading.h"
#include "timed_seeds.h"

namespace dyntape {
namespace {

struct Source {
  std::string path, text;
  FileKind kind;
};

// Bytes, numbers and lines that are changed, doubled, moved or gone.
std::string changed(std::string text, const std::vector<Source>& all, std::mt19937_64& random) {
  static const char* const numbers[] = {
      "nan", "inf", "-1", "0", "1e308", "-1e-320", "1e", "999999999999999999999", "0x10", "\"\""};
  const auto below = [&](std::size_t n) { return std::size_t(random() % std::max<std::size_t>(n, 1)); };
  for (std::size_t k = 1 + below(4); k > 0 && !text.empty(); --k) {
    const std::size_t at = below(text.size()), size = std::min(below(40), text.size() - at);
    switch (below(7)) {
      case 0:
        text[at] = char(below(256));
        break;
      case 1:
        text.erase(at, size);
        break;
      case 2:
        text.insert(at, text.substr(at, size));
        break;
      case 3:
        text.insert(at, std::string(1 + below(3), "{}<>/\"\\;#,= \n\t\r"[below(16)]));
        break;
      case 4:
        text.resize(at);
        break;
      case 5: {  // a number
        const std::size_t digit = text.find_first_of("0123456789", at);
        if (digit != std::string::npos)
          text.replace(digit, text.find_first_not_of("0123456789.e+-", digit) - digit,
                       numbers[below(std::size(numbers))]);
        break;
      }
      default: {  // a piece of another file
        const std::string& other = all[below(all.size())].text;
        text.insert(at, other.substr(below(other.size()), below(200)));
      }
    }
  }
  return text;
}

struct Outcome {
  bool was_read = false;
  std::string fault = {};  // where it is neither read nor refused
};

Outcome read(const ReadingPlace& place, FileKind kind, const std::string& text) {
  try {
    place.read(kind, text);
    return {true};
  } catch (const Error& e) {
    if (std::string(e.what()).size() < 10) return {false, std::string("says only '") + e.what() + "'"};
    return {false};
  } catch (const std::exception& e) {
    return {false, std::string("throws '") + e.what() + "'"};
  }
}

// Without the lines that the fault does not need.
std::string shrunk(const ReadingPlace& place, FileKind kind, std::string text, const std::string& fault) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size() - 1) + 1;
    std::string without = text;
    without.erase(at, end - at);
    if (read(place, kind, without).fault == fault)
      text = without;
    else
      at = end;
  }
  return text;
}

int fuzz(const std::string& config, double seconds, std::uint64_t first) {
  std::vector<Source> all;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(config)) {
    const std::optional<FileKind> kind = kind_of(entry.path());
    if (kind && entry.is_regular_file()) all.push_back({entry.path(), read_file(entry.path()), *kind});
  }
  all.push_back({config + "/table.csv", "t,q.a,q.b\n0,1,2\n0.1,-1e-3,2.5\n0.2,3,4\n", FileKind::kTable});
  const ReadingPlace place(config);
  std::uint64_t was_read = 0, refused = 0, bad = 0;
  io::LiveLine line;
  testing::TimedSeeds seeds(first, seconds);
  for (std::uint64_t seed; seeds.take(seed);) {
    std::mt19937_64 random(seed);
    const Source& source = all[random() % all.size()];
    const std::string text = changed(source.text, all, random);
    if (seed % 100 == 0) line.show("file " + std::to_string(seed - first));
    const Outcome outcome = read(place, source.kind, text);
    if (outcome.fault.empty()) {
      ++(outcome.was_read ? was_read : refused);
      continue;
    }
    ++bad;
    std::cerr << "seed " << seed << ", " << source.path << ": " << outcome.fault << "\n"
              << shrunk(place, source.kind, text, outcome.fault) << "\n";
  }
  std::cout << seeds.taken() << " files: " << was_read << " read, " << refused << " refused, " << bad
            << " neither; seeds from " << first << "\n";
  return bad == 0 ? 0 : 1;
}

}  // namespace
}  // namespace dyntape

int main(int argc, char** argv) {
  std::string config;
  std::uint64_t first = 1;
  double seconds = 60;
  CLI::App app("Shipped files with random changes: each is read or refused with a sentence.");
  app.add_option("config", config, "the folder with robots, scenes and tasks")->required();
  app.add_option("--seconds", seconds, "how long")->capture_default_str();
  app.add_option("--first-seed", first, "each file has the next one")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return dyntape::fuzz(config, seconds, first);
}
