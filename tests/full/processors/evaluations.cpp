// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluates a robot's function so many times, for counters of instructions (instructions.sh).
//   evaluations ROBOT.urdf FUNCTION interpreter|machine-code|compiled|double|packs N      N states; lanes: "+lanes"
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/packs/packed_path.h>
#include <dyntape/interface/robot/robot_functions.h>

using namespace dyntape;

int main(int count, char** arguments) {
  if (count != 5) {
    std::fprintf(stderr, "evaluations: expected ROBOT.urdf FUNCTION ROUTE N\n");
    return 2;
  }
  const auto model = dynamics::load_urdf(arguments[1]);
  const RobotFunction f(arguments[2]);
  std::string route = arguments[3];
  const auto n = static_cast<std::size_t>(std::atol(arguments[4]));
  constexpr std::size_t kStates = 64;
  detail::RobotWorkspace<double> work(model, f);
  const std::size_t n_in = work.n_in(), n_out = work.n_out();
  std::vector<double> x(kStates * n_in), y(kStates * n_out);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = 0.3 + 0.01 * static_cast<double>(i % 100);
  if (route == "double") {
    for (std::size_t k = 0; k < n; ++k) work.evaluate(x.data(), y.data());
    return 0;
  }
  if (route == "packs") {
    const auto path = detail::best_packed_path(model, f);
    const auto lanes = static_cast<std::size_t>(path->lanes);
    for (std::size_t k = 0; k < n; k += lanes) path->evaluate(x.data(), path->lanes, y.data());
    return 0;
  }
  CodegenOptions options;
  options.order = Order::kValue;
  const bool in_lanes = route.ends_with("+lanes");
  if (in_lanes) options.lanes = Lanes::kNative, route.resize(route.size() - 6);
  options.route = route == "interpreter" ? Route::kInterpreter
                  : route == "compiled"  ? Route::kCompiled
                                         : Route::kMachineCode;
  const CompiledFunction compiled = CompiledFunction::make(record_robot_function(model, f), options);
  CompiledFunction::Workspace workspace(compiled);
  if (in_lanes) {
    Points points;
    points.count = kStates, points.x = x.data(), points.y = y.data();
    for (std::size_t k = 0; k < n; k += kStates)
      compiled.check(compiled.run(Order::kValue, points, workspace), kStates);
    return 0;
  }
  for (std::size_t k = 0; k < n; ++k) compiled.value(x.data(), nullptr, y.data(), workspace);
}
