// SPDX-License-Identifier: BSD-3-Clause
//
// Derivatives of dynamics as callees beside those of the same dynamics recorded, and beside their compiled code.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <utility>
#include <vector>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/codegen/compiled_function.h>

#include "autodiff/random.h"

namespace dyntape::test {

// Entries at [first, ...) of both by their places, as parts of the largest.  What is analytic may find zeros that
// differentiation does not see.
inline void expect_near(const Pattern& p, const Pattern& q, const std::vector<double>& got,
                        std::size_t first_got, const std::vector<double>& expected,
                        std::size_t first_expected, double tolerance) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, double> differences;
  double largest = 0;
  for (std::size_t i = 0; i < q.nnz(); ++i) {
    differences[{q.row[i], q.col[i]}] = expected[first_expected + i];
    largest = std::max(largest, std::abs(expected[first_expected + i]));
  }
  for (std::size_t i = 0; i < p.nnz(); ++i) differences[{p.row[i], p.col[i]}] -= got[first_got + i];
  for (const auto& [place, difference] : differences)
    ASSERT_NEAR(difference, 0, tolerance * largest) << place.first << ", " << place.second;
}

// The same values, and derivatives but for rounding, at random points.
inline void expect_same_derivatives(const Derivatives& a, const Derivatives& b, Order order, unsigned seed,
                                    int points, double tolerance) {
  testing::Random random(seed);
  SCOPED_TRACE(random.seed_text());
  for (int k = 0; k < points; ++k) {
    const auto x = random.vector(a.function.n_x(), -1, 1), w = random.vector(a.n_y, -1, 1);
    const auto of_order = order == Order::kSecond ? w : std::vector<double>();
    const auto got = evaluate(a.function, x, {}, of_order), expected = evaluate(b.function, x, {}, of_order);
    for (std::size_t i = 0; i < a.n_y; ++i) ASSERT_EQ(got[i], expected[i]) << i;
    expect_near(a.jacobian, b.jacobian, got, a.n_y, expected, b.n_y, tolerance);
    if (order == Order::kFirst) continue;
    expect_near(a.hessian, b.hessian, got, a.n_y + a.jacobian.nnz(), expected, b.n_y + b.jacobian.nnz(),
                tolerance);
  }
}

// Compiled, to second order.
inline void expect_bits_of_interpreter(const Function& function, CodegenOptions options, int points) {
  options.use_cache = false;
  options.order = Order::kSecond;
  options.route = Route::kCompiled;
  const CompiledFunction compiled = CompiledFunction::make(function, options);
  options.route = Route::kInterpreter;
  const CompiledFunction interpreted = CompiledFunction::make(function, options);
  testing::Random random(4);
  for (int k = 0; k < points; ++k) {
    const auto x = random.vector(function.n_x(), -1, 1), w = random.vector(function.n_y(), -1, 1);
    const auto a = compiled.evaluate(Order::kSecond, x, {}, w),
               b = interpreted.evaluate(Order::kSecond, x, {}, w);
    EXPECT_EQ(a.y, b.y);
    EXPECT_EQ(a.jacobian, b.jacobian);
    EXPECT_EQ(a.hessian, b.hessian);
    EXPECT_EQ(a.y, evaluate(function, x));
  }
}

}  // namespace dyntape::test
