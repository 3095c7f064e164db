// SPDX-License-Identifier: BSD-3-Clause
//
// Machine code against the interpreter, bit for bit: every operator, special values, all orders, 1, 2, 4 and 8 lanes; calls, guards,
// gaps between points, outputs that nobody wants; and what it leaves behind.
#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/machine/machine_code.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <fstream>

#include "codegen/calls.h"
#include "codegen/random_function.h"

namespace dyntape::machine_code_test {
namespace {

using codegen::MachineCode;
using testing::Random;
using testing::same;

std::vector<Derivatives> derived(const Function& f, Order highest) {
  std::vector<Derivatives> all;
  for (int order = 0; order <= int(highest); ++order) all.push_back(derive(f, Order(order)));
  return all;
}

CodegenOptions all_lanes(Functions functions = kDefaultFunctions) {
  CodegenOptions options;
  options.lanes = Lanes::kAll;
  options.functions = functions;
  return options;
}

// Blocks of points in the layout of a kernel: [(b n + i) W + l].
struct Blocks {
  Blocks(std::size_t blocks, std::size_t entries, std::size_t width)
      : n(entries), width(width), values(blocks * entries * width) {}
  double& at(std::size_t point, std::size_t i) {
    return values[(point / width * n + i) * width + point % width];
  }
  std::size_t n, width;
  std::vector<double> values;
};

class MachineCodeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!MachineCode::is_possible()) GTEST_SKIP() << "no encoder for this processor";
  }

  // Every kernel at some points; the number of comparisons.
  static std::size_t expect_same_bits(const Function& f, Order highest, Random& random, std::size_t blocks,
                                      Functions functions = kDefaultFunctions) {
    const auto all = derived(f, highest);
    const auto code = MachineCode::make(all, all_lanes(functions));
    const dyntape_descriptor& d = code->descriptor();
    std::size_t compared = 0;
    for (std::uint32_t k = 0; k < d.n_kernels; ++k)
      compared += compare(all[d.kernels[k].order], d.kernels[k], random, blocks, functions);
    return compared;
  }

  static std::size_t compare(const Derivatives& of, const dyntape_kernel& kernel, Random& random,
                             std::size_t blocks, Functions functions) {
    const std::size_t width = kernel.lane_width, points = blocks * width;
    const Function& f = of.function;
    const Interpreter interpret(f, functions);
    Interpreter::Workspace workspace(interpret);
    Blocks x(blocks, f.n_x(), width), p(blocks, f.n_p(), width), w(blocks, f.n_w(), width),
        y(blocks, of.n_y, width), jacobian(blocks, of.jacobian.nnz(), width),
        hessian(blocks, of.hessian.nnz(), width);
    std::vector<std::vector<double>> expected;
    std::vector<std::uint32_t> violated, status(points, 77);
    for (std::size_t point = 0; point < points; ++point) {
      const auto at_x = testing::random_arguments(random, f.n_x()),
                 at_p = testing::random_arguments(random, f.n_p()), at_w = random.vector(f.n_w(), -1, 1);
      for (std::size_t i = 0; i < x.n; ++i) x.at(point, i) = at_x[i];
      for (std::size_t i = 0; i < p.n; ++i) p.at(point, i) = at_p[i];
      for (std::size_t i = 0; i < w.n; ++i) w.at(point, i) = at_w[i];
      expected.emplace_back(f.n_y());
      violated.push_back(interpret(at_x.data(), at_p.data(), at_w.data(), expected.back().data(), workspace));
    }
    std::vector<double> work(kernel.work);
    kernel.run(x.values.data(), p.values.data(), w.values.data(), y.values.data(), jacobian.values.data(),
               hessian.values.data(), work.data(), points, nullptr, status.data());
    EXPECT_EQ(status, violated);
    std::size_t compared = 0, wrong = 0;
    for (std::size_t point = 0; point < points; ++point) {
      std::size_t k = 0;
      for (Blocks* out : {&y, &jacobian, &hessian}) {
        for (std::size_t i = 0; i < out->n; ++i, ++k, ++compared) {
          if (same(out->at(point, i), expected[point][k]) || ++wrong > 3) continue;
          ADD_FAILURE() << f.name << ", order " << kernel.order << ", " << width << " lanes, output " << k
                        << ": " << out->at(point, i) << ", interpreted " << expected[point][k];
        }
      }
    }
    return compared;
  }
};

TEST_F(MachineCodeTest, EveryOperatorHasTheBitsOfTheInterpreter) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.seed_text());
    const Function f = testing::random_functions(random, 60, 20);
    for (const Functions functions : {Functions::kSines, Functions::kLibm, Functions::kPortable}) {
      EXPECT_GT(expect_same_bits(f, Order::kFirst, random, 3, functions), 2000u);
      if (HasFailure()) return;
    }
  }
}

TEST_F(MachineCodeTest, SecondOrder) {
  for (std::uint64_t seed = 100; seed < 106; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.seed_text());
    EXPECT_GT(expect_same_bits(testing::random_functions(random, 8, 12), Order::kSecond, random, 3), 300u);
  }
}

TEST_F(MachineCodeTest, MoreValuesThanRegisters) {
  Random random(7);
  const Function f = record("many", 80, [](const VectorXad& x) {
    VectorXad y(80);
    for (int i = 0; i < 80; ++i) y[i] = sin(x[i]) * x[79 - i] + x[(i + 7) % 80] / (1.0 + x[i] * x[i]);
    VectorXad z(80);
    for (int i = 0; i < 80; ++i) z[i] = y[i] * y[(i * 31 + 5) % 80] - y[79 - i];
    return z;
  });
  expect_same_bits(f, Order::kSecond, random, 2);
}

TEST_F(MachineCodeTest, CallsOfFunctionsAndOfKernelsByHand) {
  Random random(3);
  expect_same_bits(testing::with_calls(testing::kepler()), Order::kSecond, random, 4);
}

TEST_F(MachineCodeTest, OutputsThatAreInputsOrConstants) {
  Random random(4);
  expect_same_bits(record("plain", 2,
                          [](const VectorXad& x) {
                            VectorXad y(4);
                            y << x[1], AD(3.5), x[0], x[1];
                            return y;
                          }),
                   Order::kSecond, random, 3);
  expect_same_bits(record("none", 0, [](const VectorXad&) { return VectorXad::Constant(1, AD(2)).eval(); }),
                   Order::kFirst, random, 3);
}

TEST_F(MachineCodeTest, GuardsNameTheFirstThatIsViolated) {
  Random random(5);
  const Function f = record("branches", 3, [](const VectorXad& x) {
    AD y = x[0] * x[1];
    if (x[0] < 0.5) y += x[2];
    if (x[1] > -0.5) y *= 2;
    if (!(x[2] < 1)) y -= 1;
    return VectorXad::Constant(1, y).eval();
  });
  ASSERT_EQ(f.guards.size(), 3u);
  expect_same_bits(f, Order::kSecond, random, 30);
}

TEST_F(MachineCodeTest, GapsAndOutputsThatNobodyWants) {
  const Function f = record("gaps", 2, [](const VectorXad& x) {
    VectorXad y(2);
    y << x[0] * x[1], x[0] - x[1];
    return y;
  });
  const auto code = MachineCode::make(derived(f, Order::kFirst), {});
  const dyntape_kernel& first = code->descriptor().kernels[1];
  ASSERT_EQ(first.order, 1u);
  const double x[] = {2, 3, 0, 5, 7, 0, 11, 13};
  double y[] = {0, 0, -1, 0, 0, -1, 0, 0}, jacobian[12] = {};
  std::vector<double> work(first.work);
  const dyntape_strides strides = {3, 0, 0, 3, 4, 0};
  first.run(x, nullptr, nullptr, y, nullptr, nullptr, work.data(), 3, &strides, nullptr);
  EXPECT_EQ(std::vector<double>(y, y + 8), (std::vector<double>{6, -1, -1, 35, -2, -1, 143, -2}));
  first.run(x, nullptr, nullptr, nullptr, jacobian, nullptr, work.data(), 3, &strides, nullptr);
  EXPECT_EQ(std::vector<double>(jacobian + 8, jacobian + 12), (std::vector<double>{13, 11, 1, -1}));
  first.run(x, nullptr, nullptr, nullptr, nullptr, nullptr, work.data(), 0, nullptr, nullptr);
}

TEST_F(MachineCodeTest, NothingIsLeftBehind) {
  // Executable memory that is no file's: other mappings come and go with the allocator.
  const auto executable = [] {
    std::ifstream maps("/proc/self/maps");
    std::size_t lines = 0;
    for (std::string line; std::getline(maps, line);) {
      EXPECT_EQ(line.find("rwx"), std::string::npos) << line;
      if (line.find(" r-xp ") != std::string::npos && line.find('/') == std::string::npos) ++lines;
    }
    return lines;
  };
  const Function f = testing::with_calls(testing::kepler());
  const auto all = derived(f, Order::kFirst);
  const std::size_t before = executable();
  for (int k = 0; k < 1000; ++k) MachineCode::make(all, all_lanes());
  EXPECT_EQ(executable(), before);
  const auto kept = MachineCode::make(all, all_lanes());
  EXPECT_EQ(executable(), before + 1);
}

// Of a chain, two values live at a time.
TEST_F(MachineCodeTest, PlacesOfTheWorkArrayServeAgain) {
  Function level = record("level", 1, [](const VectorXad& x) {
    VectorXad y(3);
    y << sin(x[0]), cos(x[0]), x[0] + 1;
    return y;
  });
  const auto callee = recorded_callee(level);
  const Function f = record("chain", 1, [&](const VectorXad& x) -> VectorXad {
    VectorXad y = x;
    for (int k = 0; k < 300; ++k) {
      const VectorXad z = call(callee, y);
      y[0] = sin(z[0]) * cos(z[0]) + z[2 * (k % 2)];
    }
    return y;
  });
  const auto code = MachineCode::make(derived(f, Order::kValue), {});
  EXPECT_LT(code->descriptor().kernels[0].work, 40u);
  Random random(8);
  expect_same_bits(f, Order::kFirst, random, 2);
}

TEST_F(MachineCodeTest, CalleesWithinCalleesNeedLittleStack) {
  std::shared_ptr<const Callee> below;
  for (int k = 0; k < 150; ++k) {
    below = recorded_callee(record("level", 1, [&](const VectorXad& x) -> VectorXad {
      return (below ? call(below, x) : x) * AD(0.999);
    }));
  }
  const Function f = record("top", 1, [&](const VectorXad& x) { return call(below, x); });
  const auto all = derived(f, Order::kValue);
  pthread_attr_t small;
  pthread_attr_init(&small);
#if defined(__SANITIZE_ADDRESS__)
  constexpr std::size_t kStack = std::size_t{1} << 22;  // its frames are larger
#else
  constexpr std::size_t kStack = std::size_t{1} << 18;
#endif
  ASSERT_EQ(pthread_attr_setstacksize(&small, kStack), 0);
  const auto make = [](void* from) -> void* {
    MachineCode::make(*static_cast<const std::vector<Derivatives>*>(from), {});
    return from;
  };
  pthread_t thread = {};
  void* made = nullptr;
  ASSERT_EQ(pthread_create(&thread, &small, make, const_cast<std::vector<Derivatives>*>(&all)), 0);
  pthread_join(thread, &made);
  EXPECT_EQ(made, &all);
}

}  // namespace
}  // namespace dyntape::machine_code_test
