// SPDX-License-Identifier: BSD-3-Clause
//
// Random programs through every route, random graphs through the compiler and as machine code, random robots through both,
// random scenes against their balance of energy: each kind for its share of the time.
//
//   fuzz --seconds 3600 --kinds programs,robots --first-seed 1
//
// A program that disagrees is shrunk and printed with its seed; so is the seed of a batch of graphs whose compiled
// code differs from the interpreter by a bit, one point at a time or in lanes.  Exit status 1 then.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <iostream>
#include <mutex>
#include <thread>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/io/live_line.h>

#include "autodiff/evaluate/routes.h"
#include "codegen/random_function.h"
#include "fuzz_robots.h"
#include "fuzz_scenes.h"
#include "timed_seeds.h"

namespace dyntape::testing {
namespace {

struct Kind {
  const char *name, *what, *fault;
  std::string (*failure)(std::uint64_t seed);  // what is wrong; empty: nothing
  double share;                                // of the time
};

// Tries seeds on all threads; returns the number of those that fail and prints what `failure` says.
std::uint64_t failures(const Kind& kind, std::uint64_t first_seed, double seconds) {
  std::mutex printing;
  std::uint64_t failed = 0;
  io::LiveLine line;
  TimedSeeds seeds(first_seed, seconds);
  std::vector<std::jthread> threads;
  for (unsigned t = 0; t < std::max(1u, std::thread::hardware_concurrency()); ++t) {
    threads.emplace_back([&] {
      for (std::uint64_t seed; seeds.take(seed);) {
        const std::string found = kind.failure(seed);
        const std::lock_guard lock(printing);
        line.show(std::string(kind.name) + " " + std::to_string(seeds.taken()));
        if (found.empty()) continue;
        ++failed;
        std::cerr << "seed " << seed << ": " << found << "\n";
      }
    });
  }
  threads.clear();
  std::cout << seeds.taken() << " " << kind.what << ": " << failed << " " << kind.fault << "\n";
  return failed;
}

std::string program_failure(std::uint64_t seed) {
  Random random(seed);
  const Program program = random_program(random, 5 + random.below(195));
  return disagreement(program, seed).empty() ? "" : shrunk_disagreement(program, seed);
}

// A hundred graphs in one function, with derivatives.
std::string code_failure(std::uint64_t seed, Route route) {
  Random random(seed);
  const Function f = random_functions(random, 100, 5 + random.below(10));
  CodegenOptions options;
  options.use_cache = false;
  options.jobs = 1;
  options.route = Route::kInterpreter;
  const CompiledFunction interpreted = CompiledFunction::make(f, options);
  options.route = route;
  options.lanes = Lanes::kNative;
  options.piece_statements = 20 + random.below(400);
  const CompiledFunction compiled = CompiledFunction::make(f, options);

  constexpr std::size_t kPoints = 37;  // whole groups of lanes, and a rest
  const auto x = random_arguments(random, kPoints * f.n_x()), p = random_arguments(random, kPoints * f.n_p());
  const auto results = [&](const CompiledFunction& function) {
    const std::size_t n = f.n_y(), nnz = function.jacobian_pattern().nnz();
    std::vector<double> all(kPoints * (n + nnz));
    Points points;
    points.count = kPoints;
    points.x = x.data();
    points.p = p.data();
    points.y = all.data();
    points.jacobian = all.data() + kPoints * n;
    CompiledFunction::Workspace workspace(function);
    static_cast<void>(function.run(Order::kFirst, points, workspace));
    return all;
  };
  const std::vector<double> expected = results(interpreted), got = results(compiled);
  for (std::size_t i = 0; i < got.size(); ++i) {
    if (!same(got[i], expected[i]))
      return "result " + std::to_string(i) + " of the lanes differs from the interpreter's";
  }
  for (std::size_t k = 0; k < kPoints; ++k) {
    const auto at = [&](const std::vector<double>& v, std::size_t n) {
      return std::vector<double>(v.begin() + static_cast<std::ptrdiff_t>(k * n),
                                 v.begin() + static_cast<std::ptrdiff_t>((k + 1) * n));
    };
    const auto one = compiled.evaluate(Order::kFirst, at(x, f.n_x()), at(p, f.n_p()));
    for (std::size_t i = 0; i < one.y.size(); ++i) {
      if (!same(one.y[i], expected[k * f.n_y() + i])) return "y of a single point differs";
    }
  }
  return "";
}

std::string compiled_failure(std::uint64_t seed) { return code_failure(seed, Route::kCompiled); }
std::string machine_failure(std::uint64_t seed) { return code_failure(seed, Route::kMachineCode); }

constexpr Kind kKinds[] = {
    {"programs", "programs through every route", "disagree", program_failure, 0.2},
    {"batches", "libraries of 100 graphs with derivatives, single and in lanes",
     "differ from the interpreter", compiled_failure, 0.2},
    {"machine-code", "machine codes of 100 graphs with derivatives, single and in lanes",
     "differ from the interpreter", machine_failure, 0.15},
    {"robots", "robots, six functions each, as templates and on the tape", "disagree with 113 bits",
     robot_failure, 0.15},
    {"compiled-robots", "robots compiled", "differ from the interpreter", compiled_robot_failure, 0.1},
    {"scenes", "scenes against the balance of energy", "disagree", scene_failure, 0.1},
    {"ends", "smooth scenes against adaptive steps at 1e-12", "disagree", accuracy_failure, 0.1}};

int fuzz(const std::vector<std::string>& names, std::uint64_t first_seed, double seconds) {
  std::vector<Kind> kinds;
  for (const Kind& kind : kKinds) {
    if (names.empty() || std::find(names.begin(), names.end(), kind.name) != names.end())
      kinds.push_back(kind);
  }
  double shares = 0;
  for (const Kind& kind : kinds) shares += kind.share;
  std::uint64_t failed = 0;
  for (const Kind& kind : kinds) failed += failures(kind, first_seed, seconds * kind.share / shares);
  std::cout << refused_scenes() << " scenes were refused; seeds from " << first_seed << "\n";
  return failed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace dyntape::testing

int main(int argc, char** argv) {
  using dyntape::testing::kKinds;
  CLI::App app(
      "Random programs through every route to values and derivatives; random graphs compiled; random robots "
      "and "
      "scenes.");
  std::vector<std::string> names, kinds;
  for (const auto& kind : kKinds) names.emplace_back(kind.name);
  std::uint64_t first_seed = 1;
  double seconds = 120;
  app.add_option("--seconds", seconds, "how long in all; a seed of each kind in any case")
      ->capture_default_str();
  app.add_option("--kinds", kinds, "which kinds, separated by commas; otherwise all")
      ->delimiter(',')
      ->check(CLI::IsMember(names));
  app.add_option("--first-seed", first_seed, "each case has the next one")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return dyntape::testing::fuzz(kinds, first_seed, seconds);
}
