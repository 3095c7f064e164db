// SPDX-License-Identifier: BSD-3-Clause
//
// Calls of recorded functions and of kernels in generated code.
#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/pipeline.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <span>

#include "calls.h"
#include "compilers.h"
#include "random_function.h"

namespace dyntape::calls_test {
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
  EXPECT_EQ(occurrences(text, "_leg)(\n"), 2u) << "a declaration and a definition";
  EXPECT_EQ(occurrences(text, "_kepler)(\n"), 1u) << "a declaration";
  EXPECT_EQ(occurrences(text, "_kepler, 2, 1) {"), 1u) << "a definition";
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
  EXPECT_GT(occurrences(text, "DT_PIECE void DT_NAME(dt_1_long"), 20u);
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

// Names that the text has itself, and names that number themselves.
TEST(Calls, ACalleeMayBeCalledAnything) {
  const std::vector<std::string> names = {"value", "first_order", "value_1", "a",      "a_1",  "a_1_1", "1",
                                          "",      "select",      "names_x", "of_one", "real", "_",     "in"};
  std::vector<std::shared_ptr<const Callee>> callees;
  for (const std::string& name : names) {
    callees.push_back(recorded_callee(record(name, 1, [&](const VectorXad& x) {
      AD y = x[0] + double(callees.size());
      for (int i = 0; i < 8; ++i) y = y * x[0] + 1;
      return VectorXad::Constant(1, y).eval();
    })));
  }
  const Function f = record("value", 1, [&](const VectorXad& x) {
    VectorXad y = x;
    for (const auto& callee : callees) y[0] += call(callee, x)[0];
    return y;
  });
  expect_interpreted_bits(f, 400, Order::kValue);
  expect_interpreted_bits(f, 5, Order::kFirst);  // the callees are in pieces
  CodegenOptions options;
  options.piece_statements = 5;
  testing::expect_compiles_cleanly({generate_source(f, options).text});
  testing::expect_compiles_cleanly({generate_embedded(f, options, {}).source.text});
}

// A function whose values are all alive at once, and a kernel with as many arguments.
std::shared_ptr<const Callee> all_alive(int n) {
  return recorded_callee(record("all_alive", static_cast<std::size_t>(n), [n](const VectorXad& x) {
    const VectorXad squares = x.cwiseAbs2();
    AD y = 0;
    for (int i = n; i-- > 0;) y = y * 0.5 + squares[i];
    return VectorXad::Constant(1, y).eval();
  }));
}
std::shared_ptr<const Callee> weighted_sum(int n) {
  Kernel loop;
  loop.evaluate = [n](const double* in, double* out) {
    out[0] = 0;
    for (int i = 0; i < n; ++i) out[0] = out[0] * 0.5 + in[i];
  };
  loop.c_body = "  int i;\n  out[0] = 0;\n  for (i = 0; i < " + std::to_string(n) +
                "; ++i) out[0] = out[0] * 0.5 + in[i];\n";
  return std::make_shared<const Callee>("weighted_sum", static_cast<std::size_t>(n), 1, loop);
}

// What runs in a thread with a stack of so many bytes.
template <class Run>
void with_stack(std::size_t bytes, Run& run) {
  pthread_attr_t attributes;
  ASSERT_EQ(pthread_attr_init(&attributes), 0);
  ASSERT_EQ(pthread_attr_setstacksize(&attributes, bytes), 0);
  const auto start = [](void* r) -> void* { return (*static_cast<Run*>(r))(), nullptr; };
  pthread_t thread;
  ASSERT_EQ(pthread_create(&thread, &attributes, start, &run), 0);
  pthread_join(thread, nullptr);
  pthread_attr_destroy(&attributes);
}

// Work arrays lie in the workspace.  In 8 lanes those of this function take 160 kB each, and its short calls
// more together.
TEST(Calls, NeedLittleStack) {
  constexpr int kMany = 2500;
  const auto alive = all_alive(kMany), sum = weighted_sum(kMany), few = all_alive(60);
  const Function f = record("deep", 4, [&](const VectorXad& x) {
    VectorXad in(kMany), y(66);
    for (int i = 0; i < kMany; ++i) in[i] = x[i % 4] + double(i % 7);
    y[0] = call(alive, in)[0];
    y[1] = call(sum, in)[0];
    for (int k = 0; k < 64; ++k) y[2 + k] = call(few, in.segment(k, 60))[0];
    return y;
  });
  CodegenOptions options;
  options.order = Order::kValue;
  options.use_cache = false;
  options.route = Route::kCompiled;
  options.flags = {"-O0"};
  options.lanes = Lanes::kNative;
  const CompiledFunction compiled = CompiledFunction::make(f, options);
  Random random(5);
  SCOPED_TRACE(random.seed_text());
  const std::vector<double> x = random.vector(8 * 4, -1, 1);
  std::vector<double> y(8 * f.n_y());
  CompiledFunction::Workspace workspace(compiled);
  auto run = [&] {
    Points points;
    points.count = 8;
    points.x = x.data();
    points.y = y.data();
    EXPECT_FALSE(compiled.run(Order::kValue, points, workspace));
  };
  with_stack(128 * 1024, run);
  for (std::size_t lane = 0; lane < 8; ++lane) {
    const auto expected = evaluate(f, std::span(x).subspan(4 * lane, 4));
    EXPECT_EQ(std::vector<double>(y.begin() + f.n_y() * lane, y.begin() + f.n_y() * (lane + 1)), expected);
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
}  // namespace dyntape::calls_test
