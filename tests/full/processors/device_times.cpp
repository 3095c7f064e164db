// SPDX-License-Identifier: BSD-3-Clause
//
// Times of a robot's functions on a device of OpenCL beside the processor's lanes in all threads: a row of Markdown each.
// By hand, alone on the machine; docs/how_to/gpu.md has the table.
//
//   device_times ROBOT.urdf [STATES] [STATEMENTS]      STATEMENTS: of a piece of a kernel
//
// Both take and give arrays state after state, transposed and sent within the time.  The median of seven calls.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <random>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/device_function.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape {
namespace {

template <class Call>
double seconds_of(Call&& call) {
  const auto start = std::chrono::steady_clock::now();
  call();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

template <class Call>
double median(Call&& call) {
  std::vector<double> seconds;
  for (int i = 0; i < 7; ++i) seconds.push_back(seconds_of(call));
  std::nth_element(seconds.begin(), seconds.begin() + 3, seconds.end());
  return seconds[3];
}

void measure(const std::string& robot, const dynamics::Model<double>& model, const RobotFunction& function,
             std::size_t count, std::size_t statements) {
  const Function recorded = record_robot_function(model, function);
  CodegenOptions options;
  options.order = Order::kValue, options.use_cache = false;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> x(count * recorded.n_x()), y(count * recorded.n_y()), z(y.size());
  for (double& v : x) v = uniform(random);
  const Points points{.count = count, .x = x.data(), .y = y.data()};
  DeviceRunOptions how;
  if (statements) how.piece_statements = statements;
  const DeviceFunction device = DeviceFunction::make(recorded, options, how);
  const double first = seconds_of([&] { (void)device.run(Order::kValue, points); });
  const double on_device = median([&] { (void)device.run(Order::kValue, points); });
  options.lanes = Lanes::kNative, options.route = Route::kCompiled;
  const CompiledFunction compiled = CompiledFunction::make(recorded, options);
  CompiledFunction::Workspace workspace(compiled, 0);
  Points others = points;
  others.y = z.data();
  (void)compiled.run(Order::kValue, others, workspace);
  const double in_lanes = median([&] { (void)compiled.run(Order::kValue, others, workspace); });
  std::cout << "| " << robot << " | " << to_string(function) << " | " << compiled.operations(Order::kValue)
            << " | " << count << " | " << std::setprecision(3) << 1e9 * in_lanes / double(count) << " | "
            << 1e9 * on_device / double(count) << " | " << first - on_device << " | "
            << (y == z ? "yes" : "NO") << " |" << std::endl;
}

}  // namespace
}  // namespace dyntape

int main(int count, char** arguments) {
  using namespace dyntape;
  if (count < 2) return std::cerr << "device_times: expected a robot's file\n", 2;
  const std::size_t states = count > 2 ? std::stoul(arguments[2]) : 100'000,
                    statements = count > 3 ? std::stoul(arguments[3]) : 0;
  const dynamics::Model<double> model = dynamics::load_urdf(arguments[1]);
  const std::string robot = std::filesystem::path(arguments[1]).stem().string();
  std::cout << "| robot | function | operations | states | lanes [ns a state] | "
            << codegen::opencl_device(0).name
            << " [ns a state] | first call [s more] | same bits |\n|---|---|--:|--:|--:|--:|--:|---|\n";
  for (const char* name : {"rnea", "aba", "fd-derivatives"})
    measure(robot, model, RobotFunction(name), states, statements);
}
