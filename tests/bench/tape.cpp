// SPDX-License-Identifier: BSD-3-Clause
//
// What the tape costs: recording and preparing it per operation, interpreting it per operation and point, and
// the time from a recorded function to its first result.
//
//   ninja -C build bench_tape && build/bin/bench_tape config/robots/panda.urdf ... >tape.csv
//
// Each figure is the least of many repetitions; nanoseconds an operation are of operations that are left.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <optional>
#include <random>

#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/system/files.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape {
namespace {

template <class F>
double least_seconds(int repetitions, F&& f) {
  double least = 1e9;
  for (int i = 0; i < repetitions; ++i) {
    const auto start = std::chrono::steady_clock::now();
    f();
    least = std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return least;
}

constexpr std::size_t kPoints = 32;

struct Row {
  std::size_t operations = 0;
  double record = 0, hash = 0, program = 0;  // seconds
  double one = 0, many = 0;                  // seconds a point: alone, and eight side by side
  double first = 0;                          // seconds from the recorded function to its first result
};

Row measure(const dynamics::Model<double>& model, const RobotFunction& function) {
  Row row;
  Function f;
  row.record = least_seconds(10, [&] { f = record_robot_function(model, function); });
  row.operations = total_operations(f);
  row.hash = least_seconds(10, [&] { content_hash(f, 1); });
  f = compact(f);
  row.program = least_seconds(10, [&] { Interpreter{f}; });

  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> x(kPoints * f.n_x()), y(kPoints * f.n_y());
  for (double& t : x) t = uniform(random);
  const Interpreter run(f);
  Interpreter::Workspace workspace(run, kPoints);
  const PointRange points{.points = kPoints, .x = x.data(), .y = y.data()};
  row.many = least_seconds(50, [&] { run(points, workspace); }) / kPoints;
  row.one = least_seconds(50,
                          [&] {
                            for (std::size_t i = 0; i < kPoints; ++i)
                              run(&x[i * f.n_x()], nullptr, nullptr, &y[i * f.n_y()], workspace);
                          }) /
            kPoints;

  row.first = 1e9;
  for (int i = 0; i < 5; ++i) {
    const codegen::TemporaryFolder cold(codegen::system_temporary_folder(), "dyntape-");
    CodegenOptions options;
    options.order = Order::kValue;
    options.cache_folder = cold.path();
    options.route = Route::kTiered;
    std::optional<CompiledFunction> tiers;  // to end the compiler is not part of it
    row.first = std::min(row.first, least_seconds(1, [&] {
                           tiers = CompiledFunction::make(f, options);
                           CompiledFunction::Workspace room(*tiers);
                           tiers->value(x.data(), nullptr, y.data(), room);
                         }));
  }
  return row;
}

void run(int count, char** files) {
  std::printf(
      "robot,function,operations,record_ns_per_op,hash_ns_per_op,program_ns_per_op,one_ns_per_op,many_ns_per_"
      "op,");
  std::printf("one_us,many_us,first_result_ms\n");
  for (int i = 0; i < count; ++i) {
    const auto model = dynamics::load_urdf(files[i]);
    for (const RobotFunction& function :
         {RobotFunction::kRnea, RobotFunction::kIdDerivatives, RobotFunction::kFdDerivatives}) {
      const Row row = measure(model, function);
      const double ns = 1e9 / static_cast<double>(row.operations);
      std::printf("%s,%s,%zu,%.3g,%.3g,%.3g,%.3g,%.3g,%.4g,%.4g,%.3g\n", model.name.c_str(),
                  to_string(function), row.operations, row.record * ns, row.hash * ns, row.program * ns,
                  row.one * ns, row.many * ns, row.one * 1e6, row.many * 1e6, row.first * 1e3);
    }
  }
}

}  // namespace
}  // namespace dyntape

int main(int count, char** arguments) {
  if (count < 2) return std::fprintf(stderr, "usage: bench_tape ROBOT.urdf ...\n"), 2;
  try {
    dyntape::run(count - 1, arguments + 1);
  } catch (const std::exception& e) {
    return std::fprintf(stderr, "bench_tape: %s\n", e.what()), 1;
  }
}
