// SPDX-License-Identifier: BSD-3-Clause
//
// All functions of robots on a device of OpenCL: values, and first derivatives of the two dynamics, with the interpreter's bits.
//
//   build/bin/device_robots config/robots/*.urdf          77: there is no device
//   build/bin/device_robots --quick config/robots/ur5.urdf    the functions of optimal control only
//   build/bin/device_robots --times config/robots/ur5.urdf    and a line each: seconds to print and compile
//
// Functions that call others of libm than sines and cosines are compared within 1e-9: they are the device's.
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <random>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/device_function.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_callee.h>
#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape {
namespace {

constexpr std::size_t kMany = 50'000;  // as many as a driver may put into one group, on one stack
constexpr int kStates = 70;            // more than a group of work-items
constexpr int kLarge = 12;  // degrees of freedom: larger robots without second derivatives, minutes each
constexpr double kNear = 1e-9;
constexpr std::size_t kLongest = 40'000;  // operations: the compilers of devices take minutes for more

struct Told {
  int functions = 0, failures = 0, longer = 0;
  std::size_t numbers = 0;
  bool times = false, quick = false;
};

bool is_exact(const Function& function) {
  for (const Node& node : function.graph.nodes()) {
    if (is_table_op(node.op) && has_portable_form(node.op) && !is_turn(node.op)) return false;
  }
  return true;
}

bool agree(double a, double b, bool exactly) {
  if (std::isnan(a) && std::isnan(b)) return true;
  return exactly ? std::memcmp(&a, &b, sizeof a) == 0 : std::abs(a - b) <= kNear * (1 + std::abs(b));
}

std::vector<double> states(const dynamics::Model<double>& model, std::size_t n_x) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> x;
  for (int s = 0; s < kStates; ++s) {
    const Eigen::VectorXd q = dynamics::random_configuration(model, random);
    std::vector<double> state(n_x);
    for (double& v : state) v = uniform(random);
    std::copy(q.begin(), q.begin() + std::min<std::ptrdiff_t>(q.size(), std::ptrdiff_t(n_x)), state.begin());
    x.insert(x.end(), state.begin(), state.end());
  }
  return x;
}

void compare(const std::string& name, const dynamics::Model<double>& model, const Function& function,
             Order order, Told& told) {
  if (total_operations(function) > kLongest) {
    ++told.longer;
    return;
  }
  CodegenOptions options;
  options.order = order;
  options.use_cache = false;
  const auto start = std::chrono::steady_clock::now();
  const DeviceFunction device = DeviceFunction::make(function, options);
  const std::vector<double> x = states(model, function.n_x());
  const auto found = device.evaluate(order, kStates, x);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (name == "panda fd-derivatives") {
    std::vector<double> many;
    while (many.size() < kMany * function.n_x()) many.insert(many.end(), x.begin(), x.end());
    many.resize(kMany * function.n_x());
    const auto y = device.evaluate(order, kMany, many).y;
    if (std::memcmp(y.data(), found.y.data(), found.y.size() * sizeof(double)) != 0) ++told.failures;
  }
  options.route = Route::kInterpreter;
  const CompiledFunction interpreted = CompiledFunction::make(function, options);
  const bool exactly = is_exact(function);
  ++told.functions;
  if (told.times) std::cout << name << "," << interpreted.operations(order) << "," << seconds << std::endl;
  for (std::size_t s = 0; s < kStates; ++s) {
    const auto expected = interpreted.evaluate(
        order, std::vector<double>(x.begin() + std::ptrdiff_t(s * function.n_x()),
                                   x.begin() + std::ptrdiff_t((s + 1) * function.n_x())));
    for (const auto& [all, one] :
         {std::pair(&found.y, &expected.y), std::pair(&found.jacobian, &expected.jacobian)}) {
      for (std::size_t i = 0; i < one->size(); ++i, ++told.numbers) {
        const double a = (*all)[s * one->size() + i], b = (*one)[i];
        if (agree(a, b, exactly)) continue;
        ++told.failures;
        std::cout << name << ": entry " << i << " of state " << s << ": device " << a << ", interpreter " << b
                  << std::endl;
        return;
      }
    }
  }
}

void compare(const std::string& path, bool floats, Told& told) {
  const auto base = floats ? dynamics::Base::kFloating : dynamics::Base::kFixed;
  const dynamics::Model<double> model = dynamics::load_urdf(path, {.base = base});
  const std::string robot = std::filesystem::path(path).stem().string() + (floats ? " floating" : "");
  for (const RobotFunction& function : robot_functions()) {
    const std::string name = to_string(function);
    const bool is_core =
        std::find(std::begin(kCoreFunctions), std::end(kCoreFunctions), function) != std::end(kCoreFunctions);
    if (told.quick && (!is_core || (model.nv > kLarge && is_derivative(function)))) continue;
    if (model.nv > kLarge && (name.find("second") != name.npos || name.find("hessian") != name.npos))
      continue;
    Function recorded;
    try {
      recorded = record_robot_function(model, function);
    } catch (const Error&) {
      continue;  // not of this robot
    }
    compare(robot + " " + name, model, recorded, Order::kValue, told);
    if (model.nv <= kLarge && (name == "rnea" || name == "aba"))
      compare(robot + " " + name + " first order", model, record_differentiable(model, function),
              Order::kFirst, told);
  }
}

int run(int count, char** arguments) {
  try {
    codegen::opencl_device(0);
  } catch (const Error& e) {
    std::cout << e.what() << "\n";
    return 77;
  }
  Told told;
  for (int i = 1; i < count; ++i) {
    const std::string argument = arguments[i];
    if (argument == "--times") told.times = true;
    if (argument == "--quick") told.quick = true;
    if (argument.starts_with("--")) continue;
    compare(argument, false, told);
    compare(argument, true, told);
  }
  std::cout << told.functions << " functions, " << told.numbers << " numbers, " << told.failures
            << " differ\n";
  return told.failures != 0 || told.functions == 0;
}

}  // namespace
}  // namespace dyntape

int main(int count, char** arguments) { return dyntape::run(count, arguments); }
