// SPDX-License-Identifier: BSD-3-Clause
//
// A function and its Jacobian at many states on a device of OpenCL: a graphics card, or the processor by pocl.
//
//   device               ends with a sentence where there is no device
//   device opencl:1      another one
#include <cmath>
#include <cstdio>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/device_function.h>

using namespace dyntape;

int main(int argc, char** argv) {
  const Function swing = record("swing", 2, 1, [](const VectorXad& x, const VectorXad& p) {
    return VectorXad::Constant(1, p[0] * sin(x[0]) * x[1]).eval();
  });
  const std::size_t count = 10'000;
  std::vector<double> x(2 * count);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::sin(0.001 * double(i));

  try {
    const DeviceFunction f =
        DeviceFunction::make(swing, {.order = Order::kFirst}, {.device = argc > 1 ? argv[1] : "opencl:0"});
    const auto result = f.evaluate(Order::kFirst, count, x, {9.81});  // one p for all states
    std::printf("%zu states on %s\n", count, f.device().name.c_str());
    std::printf("y = %.12f, dy/dx = %.12f %.12f at the last\n", result.y.back(),
                result.jacobian[2 * count - 2], result.jacobian[2 * count - 1]);
    for (std::size_t s = 0; s < count; ++s) {
      if (result.y[s] == evaluate(swing, {x[2 * s], x[2 * s + 1]}, {9.81})[0]) continue;
      std::printf("state %zu DIFFERS from the interpreter\n", s);
      return 1;
    }
    std::printf("equal to the interpreter, bit for bit\n");
  } catch (const ToolError& e) {  // no device here
    std::printf("%s\n", e.what());
  } catch (const ArgumentError& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
  return 0;
}
