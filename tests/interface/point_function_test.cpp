// SPDX-License-Identifier: BSD-3-Clause
//
// All points of a mesh in one call, by every option that solve has.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/transcription/point_function.h>

namespace dyntape {
namespace {

struct Results {
  std::vector<double> y, jacobian, hessian;
  bool operator==(const Results&) const = default;
};

Function pendulum() {
  return record("pendulum", 3, 1, [](const VectorXad& x, const VectorXad& p) {
    VectorXad y(2);
    y << x[1] * cos(x[0]) + p[0], (x[2] - sin(x[0]) * x[1] * x[1]) / (2.0 + cos(x[0]));
    return y;
  });
}

Results results(const CodegenOptions& options, unsigned threads, std::size_t points) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto draw = [&](std::size_t n) {
    std::vector<double> x(n);
    for (double& v : x) v = number(random);
    return x;
  };
  PointFunction f(pendulum(), points, options, threads);
  const std::vector<double> z = draw(3 * points), p = draw(points), w = draw(2 * points);
  Results r{std::vector<double>(2 * points), std::vector<double>(f.jacobian().nnz() * points),
            std::vector<double>(f.hessian().nnz() * points)};
  EXPECT_TRUE(f.second(z.data(), p.data(), w.data(), r.y.data(), r.jacobian.data(), r.hessian.data()));
  return r;
}

// Threads, and lanes in strict with portable functions, change no bit; fast stays within rounding.
TEST(PointFunction, EveryOptionGivesTheSame) {
  constexpr std::size_t kPoints = 83;
  const CodegenOptions interpreted{.order = Order::kSecond, .route = Route::kInterpreter};
  const Results expected = results(interpreted, 1, kPoints);
  for (unsigned threads : {1u, 2u, 3u, 0u}) {
    EXPECT_EQ(results(interpreted, threads, kPoints), expected) << threads << " threads";
    EXPECT_EQ(results({.order = Order::kSecond}, threads, kPoints), expected) << threads << " threads";
    EXPECT_EQ(results({.order = Order::kSecond, .lanes = Lanes::kNative}, threads, kPoints), expected);
  }
  const Results fast =
      results({.order = Order::kSecond, .profile = Profile::kFast, .lanes = Lanes::kNative}, 2, kPoints);
  for (std::size_t i = 0; i < expected.hessian.size(); ++i)
    EXPECT_NEAR(fast.hessian[i], expected.hessian[i], 1e-13 * (1 + std::abs(expected.hessian[i])));
}

// The violation of a branch is that of its point, whichever thread meets it.
TEST(PointFunction, LeavesABranchAtOnePoint) {
  const Function f = record(
      "side", 1, [](const VectorXad& x) { return VectorXad::Constant(1, x[0] > 0.0 ? x[0] * x[0] : -x[0]); });
  std::vector<double> z(64, 0.5), y(64);
  for (unsigned threads : {1u, 2u}) {
    PointFunction g(f, 64, {.order = Order::kValue, .route = Route::kInterpreter}, threads);
    EXPECT_TRUE(g.values(z.data(), nullptr, y.data()));
    z[40] = -1;
    EXPECT_FALSE(g.values(z.data(), nullptr, y.data()));
    EXPECT_NE(g.complaint().find("point_function_test.cpp"), std::string::npos) << g.complaint();
    z[40] = 0.5;
  }
}

}  // namespace
}  // namespace dyntape
