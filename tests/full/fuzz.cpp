// SPDX-License-Identifier: BSD-3-Clause
//
// Random programs through every route, random graphs through the compiler and as machine code, and random robots through both,
// random scenes against their balance of energy, as many as asked for.
//
//   fuzz --programs 100000 --first-seed 1
//
// A program that disagrees is shrunk and printed with its seed; so is the seed of a batch of graphs whose compiled
// code differs from the interpreter by a bit, one point at a time or in lanes.  Exit status 1 then.
#include <CLI/CLI.hpp>

#include <atomic>
#include <iostream>
#include <mutex>
#include <thread>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/io/live_line.h>

#include "../autodiff/routes.h"
#include "../codegen/random_function.h"
#include "fuzz_robots.h"
#include "fuzz_scenes.h"

namespace dyntape::testing {
namespace {

struct Options {
  std::uint64_t programs = 5000, first_seed = 1, batches = 12, machine_batches = 200, robots = 300,
                compiled_robots = 4, scenes = 200, accuracy = 200;
};

// Tries `count` seeds on all threads; returns the number of those that fail and prints what `failure` says.
std::uint64_t failures(const std::string& what, std::uint64_t count, std::uint64_t first_seed,
                       const std::function<std::string(std::uint64_t)>& failure) {
  std::mutex printing;
  std::uint64_t done = 0, failed = 0;
  io::LiveLine line;
  std::atomic<std::uint64_t> next = first_seed;
  std::vector<std::jthread> threads;
  for (unsigned t = 0; t < std::max(1u, std::thread::hardware_concurrency()); ++t) {
    threads.emplace_back([&] {
      for (std::uint64_t seed; (seed = next++) < first_seed + count;) {
        const std::string found = failure(seed);
        const std::lock_guard lock(printing);
        line.show(std::string(what) + " " + std::to_string(++done) + " of " + std::to_string(count));
        if (found.empty()) continue;
        ++failed;
        std::cerr << "seed " << seed << ": " << found << "\n";
      }
    });
  }
  threads.clear();
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

int fuzz(const Options& options) {
  const std::uint64_t bad_programs =
      failures("programs", options.programs, options.first_seed, program_failure);
  const std::uint64_t bad_batches =
      failures("compiled batches of 100 graphs", options.batches, options.first_seed, compiled_failure);
  const std::uint64_t bad_machine =
      failures("machine code of 100 graphs", options.machine_batches, options.first_seed, machine_failure);
  const std::uint64_t bad_robots = failures("robots", options.robots, options.first_seed, robot_failure);
  const std::uint64_t bad_compiled =
      failures("compiled robots", options.compiled_robots, options.first_seed, compiled_robot_failure);
  const std::uint64_t bad_scenes = failures("scenes", options.scenes, options.first_seed, scene_failure);
  const std::uint64_t scenes_refused = refused_scenes();
  const std::uint64_t bad_ends =
      failures("ends of scenes", options.accuracy, options.first_seed, accuracy_failure);
  std::cout << options.programs << " programs through every route: " << bad_programs << " disagree\n"
            << 100 * options.batches
            << " graphs with derivatives, compiled, single and in lanes: " << bad_batches << " of "
            << options.batches << " batches differ from the interpreter\n"
            << 100 * options.machine_batches
            << " graphs with derivatives, as machine code, single and in lanes: " << bad_machine << " of "
            << options.machine_batches << " batches differ from the interpreter\n"
            << options.robots << " robots, six functions each, as templates and on the tape: " << bad_robots
            << " disagree with 113 bits\n"
            << options.compiled_robots << " robots compiled: " << bad_compiled
            << " differ from the interpreter\n"
            << options.scenes << " scenes against the balance of energy: " << bad_scenes << " disagree, "
            << scenes_refused << " were refused\n"
            << options.accuracy << " scenes against adaptive steps at 1e-12: " << bad_ends << " disagree, "
            << refused_scenes() - scenes_refused << " were refused\n"
            << "seeds from " << options.first_seed << "\n";
  return bad_programs + bad_batches + bad_machine + bad_robots + bad_compiled + bad_scenes + bad_ends == 0
             ? 0
             : 1;
}

}  // namespace
}  // namespace dyntape::testing

int main(int argc, char** argv) {
  dyntape::testing::Options options;
  CLI::App app(
      "Random programs through every route to values and derivatives; random graphs compiled; random "
      "robots.");
  app.add_option("--programs", options.programs, "random programs of 5 to 200 instructions")
      ->capture_default_str();
  app.add_option("--batches", options.batches, "libraries of 100 random graphs")->capture_default_str();
  app.add_option("--machine-batches", options.machine_batches, "machine code of 100 random graphs")
      ->capture_default_str();
  app.add_option("--robots", options.robots, "random robots of 1 to 12 joints, interpreted")
      ->capture_default_str();
  app.add_option("--compiled-robots", options.compiled_robots, "random robots of 1 to 8 joints, compiled")
      ->capture_default_str();
  app.add_option("--scenes", options.scenes, "random robots of 1 to 6 joints under random effects, simulated")
      ->capture_default_str();
  app.add_option("--accuracy", options.accuracy, "smooth ones of these beside adaptive steps at 1e-12")
      ->capture_default_str();
  app.add_option("--first-seed", options.first_seed, "each program has the next one")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return dyntape::testing::fuzz(options);
}
