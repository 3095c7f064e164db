// SPDX-License-Identifier: BSD-3-Clause
//
// Functions that are machine code until they are compiled, or for good.
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/machine/encoder.h>
#include <dyntape/codegen/machine/machine_code.h>
#include <dyntape/codegen/options/lane_widths.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <stdexcept>

#include "codegen/compilers.h"
#include "codegen/random_function.h"

namespace dyntape::machine_tiers_test {
namespace {

using codegen::MachineCode;
using testing::fake_compiler;
using testing::Random;
using testing::same;
using testing::Scratch;

Function parabola() {
  return record("parabola", 1, [](const VectorXad& x) { return VectorXad::Constant(1, x[0] * x[0] + 3); });
}

class MachineTiers : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!MachineCode::is_possible()) GTEST_SKIP() << "no encoder for this processor";
  }
  CodegenOptions options(Order order = Order::kValue) const {
    CodegenOptions o;
    o.order = order;
    o.route = Route::kTiered;
    o.cache_folder = scratch_ / "cache";
    return o;
  }
  const Scratch scratch_;
};

TEST_F(MachineTiers, MachineCodeServesUntilTheCompilerIsDone) {
  Random random(11);
  SCOPED_TRACE(random.seed_text());
  const Function f = testing::random_functions(random, 120, 9);
  CodegenOptions o = options(Order::kFirst);
  o.lanes = Lanes::kNative;
  o.compiler = fake_compiler(scratch_, "sleep 0.3\ncc \"$@\"");
  CodegenOptions interpreted = options(Order::kFirst);
  interpreted.route = Route::kInterpreter;
  const CompiledFunction t = CompiledFunction::make(f, o), reference = CompiledFunction::make(f, interpreted);
  EXPECT_EQ(t.tier(), Tier::kMachineCode);
  EXPECT_EQ(t.route(), Route::kMachineCode);
  const unsigned native = codegen::lane_widths(Lanes::kNative).front();
  EXPECT_EQ(t.lane_width(), codegen::Encoder::can_encode(int(native)) ? native : 1u);
  CompiledFunction::Workspace room(t), of_reference(reference);
  constexpr std::size_t kPoints = 19;
  const auto x = testing::random_arguments(random, kPoints * f.n_x()),
             p = testing::random_arguments(random, kPoints * f.n_p());
  const std::size_t nnz = reference.jacobian_pattern().nnz();
  std::vector<double> y(kPoints * f.n_y()), j(kPoints * nnz), expected_y(y), expected_j(j);
  const auto at = [&](std::vector<double>& to_y, std::vector<double>& to_j) {
    return Points{.count = kPoints, .x = x.data(), .p = p.data(), .y = to_y.data(), .jacobian = to_j.data()};
  };
  EXPECT_FALSE(reference.run(Order::kFirst, at(expected_y, expected_j), of_reference));
  std::set<Tier> met;
  for (bool last = false; !last;) {
    last = t.is_settled();
    met.insert(t.tier());
    EXPECT_FALSE(t.run(Order::kFirst, at(y, j), room));
    for (std::size_t i = 0; i < y.size(); ++i) ASSERT_TRUE(same(y[i], expected_y[i])) << to_string(t.tier());
    for (std::size_t i = 0; i < j.size(); ++i) ASSERT_TRUE(same(j[i], expected_j[i])) << to_string(t.tier());
  }
  EXPECT_EQ(met, (std::set<Tier>{Tier::kMachineCode, Tier::kFinal})) << t.trouble();
}

// Also where a processor is held to fewer lanes than it has: with DYNTAPE_PROCESSOR=x86-64-v3 (test machine_tiers_v3).
TEST_F(MachineTiers, PointsSideBySideAreThoseOfTheFirstTier) {
  CodegenOptions o = options();
  o.lanes = Lanes::kAll;
  const CompiledFunction t = CompiledFunction::make(parabola(), o);
  const std::size_t width = t.lane_width(), count = 3 * width;
  ASSERT_GT(width, 1u);
  CompiledFunction::Workspace room(t);
  std::vector<double> x(count), expected;
  for (std::size_t k = 0; k < count; ++k) x[k] = double(k), expected.push_back(x[k] * x[k] + 3);
  for (const bool last : {false, true}) {
    if (last) t.wait();
    std::vector<double> y(count, -1);
    Points points{.count = count, .x = x.data(), .y = y.data()};
    points.side_by_side = width;
    EXPECT_FALSE(t.run(Order::kValue, points, room));
    EXPECT_EQ(y, expected) << to_string(t.tier());
  }
}

TEST_F(MachineTiers, WithoutCompilerItIsMachineCodeForGood) {
  for (const Route route : {Route::kAutomatic, Route::kTiered, Route::kMachineCode}) {
    CodegenOptions o = options();
    o.compiler = "/nowhere/cc";
    o.route = route;
    const CompiledFunction t = CompiledFunction::make(parabola(), o);
    EXPECT_EQ(t.tier(), Tier::kMachineCode) << to_string(route);
    EXPECT_TRUE(t.is_settled());
    EXPECT_EQ(t.evaluate(Order::kValue, {0.5}).y[0], 3.25);
  }
}

TEST_F(MachineTiers, WhatAKernelByHandThrowsArrives) {
  Kernel kernel;
  kernel.evaluate = [](const double* in, double* out) {
    if (in[0] < 0) throw std::domain_error("below zero");
    out[0] = std::sqrt(in[0]);
  };
  const auto root = std::make_shared<Callee>("root", 1, 1, kernel);
  const Function f = record("roots", 2, [&](const VectorXad& x) -> VectorXad {
    return call(root, x.head(1)) + call(root, x.tail(1));
  });
  CodegenOptions o = options();
  o.route = Route::kMachineCode;
  o.lanes = Lanes::kNative;
  const CompiledFunction c = CompiledFunction::make(f, o);
  EXPECT_EQ(c.tier(), Tier::kMachineCode);
  EXPECT_EQ(c.evaluate(Order::kValue, {4, 9}).y[0], 5);
  EXPECT_THROW(c.evaluate(Order::kValue, {4, -9}), std::domain_error);
  EXPECT_EQ(c.evaluate(Order::kValue, {4, 9}).y[0], 5);
  CompiledFunction::Workspace room(c);
  std::vector<double> x(40, 4.0), y(20);
  x[31] = -1;
  EXPECT_THROW((void)c.run(Order::kValue, {.count = 20, .x = x.data(), .y = y.data()}, room),
               std::domain_error);
  x[31] = 4;
  EXPECT_FALSE(c.run(Order::kValue, {.count = 20, .x = x.data(), .y = y.data()}, room));
  EXPECT_EQ(y, std::vector<double>(20, 4.0));
}

// One that iterates until it is near enough, or evaluates something itself, does not meet what another one left.
TEST_F(MachineTiers, NoKernelByHandIsCalledBehindOneThatThrew) {
  Kernel first, second;
  int calls = 0;
  first.evaluate = [](const double* in, double* out) {
    if (in[0] < 0) throw std::domain_error("below zero");
    out[0] = in[0];
  };
  const CompiledFunction inner =
      CompiledFunction::make(parabola(), {.order = Order::kValue, .route = Route::kMachineCode});
  second.evaluate = [&](const double* in, double* out) {
    ++calls;
    out[0] = inner.evaluate(Order::kValue, {in[0]}).y[0];
  };
  const auto A = std::make_shared<Callee>("A", 1, 1, first), B = std::make_shared<Callee>("B", 1, 1, second);
  const Function f = record("chain", 1, [&](const VectorXad& x) -> VectorXad { return call(B, call(A, x)); });
  const CompiledFunction c =
      CompiledFunction::make(f, {.order = Order::kValue, .route = Route::kMachineCode});
  calls = 0;  // but for the recording
  EXPECT_THROW(c.evaluate(Order::kValue, {-1}), std::domain_error);
  EXPECT_EQ(calls, 0);
  EXPECT_EQ(c.evaluate(Order::kValue, {2}).y[0], 7);
  EXPECT_EQ(calls, 1);
}

// A hardened system, as it were.
TEST_F(MachineTiers, SwitchedOffItIsInterpreted) {
  setenv("DYNTAPE_MACHINE_CODE", "off", 1);
  CodegenOptions o = options();
  o.route = Route::kMachineCode;
  const CompiledFunction f = CompiledFunction::make(parabola(), o);
  unsetenv("DYNTAPE_MACHINE_CODE");
  EXPECT_EQ(f.tier(), Tier::kInterpreted);
  EXPECT_EQ(f.evaluate(Order::kValue, {0.5}).y[0], 3.25);
}

}  // namespace
}  // namespace dyntape::machine_tiers_test
