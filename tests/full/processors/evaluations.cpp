// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluates a robot's function so many times, for counters of instructions (instructions.py).
//   evaluations ROBOT.urdf[:floating] FUNCTION ROUTE N      N states; ROUTE: double, packs, interpreter, machine-code
//                                                           or compiled, the last three with "+lanes" too
//   evaluations ROBOT.urdf[:floating] --model               the robot, for other libraries
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/packs/packed_path.h>
#include <dyntape/interface/robot/robot_functions.h>

#include "bench/command/model_json.h"

using namespace dyntape;

namespace {

// Evaluates n states, `step` a call, between two marks for the counter (instructions.c).  A call before does what is
// done once.
template <class Call>
int counted(std::size_t n, std::size_t step, const Call& call) {
  call();
  close(-31415);
  for (std::size_t k = 0; k < n; k += step) call();
  close(-31415);
  return 0;
}

}  // namespace

int main(int count, char** arguments) {
  const bool prints_model = count == 3 && std::string(arguments[2]) == "--model";
  if (count != 5 && !prints_model) {
    std::fprintf(stderr, "evaluations: expected ROBOT.urdf FUNCTION ROUTE N, or ROBOT.urdf --model\n");
    return 2;
  }
  std::string robot = arguments[1];
  dynamics::UrdfOptions reading;
  if (robot.ends_with(":floating")) reading.base = dynamics::Base::kFloating, robot.resize(robot.size() - 9);
  const auto model = dynamics::load_urdf(robot, reading);
  if (prints_model) {
    std::puts(tools::model_json(model).dump().c_str());
    return 0;
  }
  const RobotFunction f(arguments[2]);
  std::string route = arguments[3];
  const auto n = static_cast<std::size_t>(std::atol(arguments[4]));
  constexpr std::size_t kStates = 64;
  detail::RobotWorkspace<double> work(model, f);
  const std::size_t n_in = work.n_in(), n_out = work.n_out();
  std::vector<double> x(kStates * n_in), y(kStates * n_out);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = 0.3 + 0.01 * static_cast<double>(i % 100);
  if (route == "double") return counted(n, 1, [&] { work.evaluate(x.data(), y.data()); });
  if (route == "packs") {
    const auto path = detail::best_packed_path(model, f);
    return counted(n, static_cast<std::size_t>(path->lanes),
                   [&] { path->evaluate(x.data(), path->lanes, y.data()); });
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
    return counted(n, kStates,
                   [&] { compiled.check(compiled.run(Order::kValue, points, workspace), kStates); });
  }
  return counted(n, 1, [&] { compiled.value(x.data(), nullptr, y.data(), workspace); });
}
