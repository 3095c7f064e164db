// SPDX-License-Identifier: BSD-3-Clause
//
// The way from a recording to a loaded library.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <gtest/gtest.h>

namespace dyntape::pipeline_test {
namespace {

Function recorded() {
  return record("two outputs", 3, 1, [](const VectorXad& x, const VectorXad& p) {
    VectorXad y(2);
    y[0] = sin(x[0]) * p[0] + x[1] * x[1];
    y[1] = x[2] < 5.0 ? x[2] * x[0] / x[1] : x[2];
    return y;
  });
}

TEST(Pipeline, CompiledValueIsTheInterpretedOne) {
  CodegenOptions options;
  options.order = Order::kSecond;
  options.use_cache = false;
  const CompiledFunction f = CompiledFunction::make(recorded(), options);
  ASSERT_EQ(f.route(), Route::kCompiled);
  EXPECT_EQ(f.evaluate(Order::kSecond, {0.3, 0.4, 0.5}, {2.0}, {1, 1}).y,
            evaluate(recorded(), {0.3, 0.4, 0.5}, {2.0}));
  EXPECT_THROW(f.evaluate(Order::kValue, {0.3, 0.4, 5.5}, {2.0}), GuardViolation);
}

}  // namespace
}  // namespace dyntape::pipeline_test
