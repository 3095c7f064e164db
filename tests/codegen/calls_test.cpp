// SPDX-License-Identifier: BSD-3-Clause
//
// Calls of recorded functions and of kernels in generated code.
#include <dyntape/autodiff/callee.h>
#include <dyntape/autodiff/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <gtest/gtest.h>

#include "calls.h"
#include "compilers.h"
#include "random_function.h"

namespace dyntape {
namespace {

using testing::kepler;
using testing::Random;
using testing::with_calls;

std::size_t occurrences(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += what.size()) ++count;
  return count;
}

void expect_interpreted_bits(const Function& f, std::size_t piece_statements, Order order = Order::kSecond) {
  CodegenOptions options;
  options.order = order;
  options.use_cache = false;
  options.route = Route::kCompiled;
  options.piece_statements = piece_statements;
  const CompiledFunction compiled = CompiledFunction::make(f, options);
  options.route = Route::kInterpreter;
  const CompiledFunction interpreted = CompiledFunction::make(f, options);
  Random random(31);
  SCOPED_TRACE(random.seed_text());
  for (int k = 0; k < 50; ++k) {
    const auto x = random.vector(f.n_x(), -1, 1),
               w = random.vector(order == Order::kSecond ? f.n_y() : 0, -1, 1);
    const auto a = compiled.evaluate(order, x, {}, w), b = interpreted.evaluate(order, x, {}, w);
    EXPECT_EQ(a.y, b.y);
    EXPECT_EQ(a.jacobian, b.jacobian);
    EXPECT_EQ(a.hessian, b.hessian);
  }
}

TEST(Calls, RecordedFunctionsAndKernelsWithDerivatives) {
  const auto kernel = kepler();
  const Function f = with_calls(kernel);
  expect_interpreted_bits(f, 400);
  expect_interpreted_bits(f, 6);  // a call and its results stay together
}

TEST(Calls, EachCalleeIsPrintedOnce) {
  const auto kernel = kepler();
  const Function f = with_calls(kernel);
  CodegenOptions options;
  options.order = Order::kValue;
  const std::string text = generate_source(f, options).text;
  EXPECT_EQ(occurrences(text, "void DT_NAME(dt_leg_"), 2u) << "a declaration and a definition";
  EXPECT_EQ(occurrences(text, "void DT_NAME(dt_kepler_"), 1u) << "a declaration";
  EXPECT_EQ(occurrences(text, "DT_KERNEL(dt_kepler_"), 1u) << "a definition";
  options.order = Order::kSecond;
  testing::expect_compiles_cleanly({generate_source(f, options).text});
}

TEST(Calls, LongCalleesAreCutToo) {
  const auto callee = recorded_callee(record("long", 3, [](const VectorXad& x) {
    AD a = x[0], b = x[1];
    for (int i = 0; i < 100; ++i) {
      const AD next = sin(a) + b * x[2];
      b = a;
      a = next;
    }
    VectorXad y(2);
    y << a, b;
    return y;
  }));
  const Function f = record("caller", 3, [&](const VectorXad& x) { return call(callee, x); });
  CodegenOptions options;
  options.order = Order::kFirst;
  options.piece_statements = 40;
  const std::string text = generate_source(f, options).text;
  EXPECT_GT(occurrences(text, "DT_PIECE void DT_NAME(dt_long"), 20u);
  testing::expect_compiles_cleanly({text});
  expect_interpreted_bits(f, 40);
}

// Arguments and results of a long call stay in one place: whatever is computed where, read twice, an input, a
// constant; results that are outputs in their order, read by others, or left out.
TEST(Calls, LongOnesCopyNothing) {
  for (const int variant : {0, 1, 2, 3}) {
    SCOPED_TRACE(variant);
    const Function f = testing::with_long_calls(variant);
    expect_interpreted_bits(f, 400, Order::kFirst);
    expect_interpreted_bits(f, 30, Order::kFirst);
    CodegenOptions options;
    options.order = Order::kValue;
    const std::string text = generate_source(f, options).text;
    EXPECT_EQ(occurrences(text, ", y + 0);"), variant < 2 ? 1u : 0u) << text;
    testing::expect_compiles_cleanly({text});
    const auto exact = evaluate_as<long double>(f, {0.25L, -0.5L, 0.75L, 1});
    const auto y = evaluate(f, {0.25, -0.5, 0.75, 1});
    for (std::size_t i = 0; i < y.size(); ++i)
      EXPECT_NEAR(y[i], static_cast<double>(exact[i]), 1e-12 * (1 + std::abs(y[i])));
  }
}

TEST(Calls, OfFunctionsWithoutInputsOrOutputs) {
  Function constant;
  constant.name = "two";
  constant.outputs.push_back(constant.graph.constant(2));
  const auto callee = recorded_callee(constant);
  const Function f = record("f", 1, [&](const VectorXad& x) {
    return VectorXad::Constant(1, x[0] * call(callee, VectorXad(0))[0]).eval();
  });
  expect_interpreted_bits(f, 400);
}

}  // namespace
}  // namespace dyntape
