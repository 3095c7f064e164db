// SPDX-License-Identifier: BSD-3-Clause
//
// All points of a mesh and its end in one call, by every option that solve has.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/control/discretize/stage_functions.h>

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
  StageFunctions f(pendulum(), {pendulum()}, options, points - 1, threads);  // the end is one like the others
  f.node().wait();
  const std::vector<double> z = draw(3 * points), p = draw(points), w = draw(2 * points);
  Results r{std::vector<double>(f.values()), std::vector<double>(f.jacobians()),
            std::vector<double>(f.hessians())};
  EXPECT_EQ(r.y.size(), 2 * points);
  const Points at{.x = z.data(),
                  .p = p.data(),
                  .w = w.data(),
                  .y = r.y.data(),
                  .jacobian = r.jacobian.data(),
                  .hessian = r.hessian.data()};
  const StageFunctions::At end[] = {{&z[3 * (points - 1)], &p.back()}};
  EXPECT_TRUE(f.run(Order::kSecond, at, end));
  return r;
}

// Threads, and lanes in strict with portable functions, change no bit; fast stays within rounding.
TEST(StageFunctions, EveryOptionGivesTheSame) {
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

// Interpreted, and some day compiled: the same.
TEST(StageFunctions, Tiers) {
  EXPECT_EQ(results({.order = Order::kSecond, .route = Route::kTiered}, 2, 83),
            results({.order = Order::kSecond, .route = Route::kInterpreter}, 1, 83));
}

TEST(StageFunctions, ABranchIsLeftAtOnePointOrAtTheEnd) {
  const Function f = record(
      "side", 1, [](const VectorXad& x) { return VectorXad::Constant(1, x[0] > 0.0 ? x[0] * x[0] : -x[0]); });
  std::vector<double> z(64, 0.5), y(65);
  const double good = 1, bad = -1;
  const StageFunctions::At inside[] = {{&good, nullptr}}, outside[] = {{&bad, nullptr}};
  for (unsigned threads : {1u, 2u}) {
    StageFunctions g(f, {f}, {.order = Order::kValue, .route = Route::kInterpreter}, 64, threads);
    const Points at{.x = z.data(), .y = y.data()};
    EXPECT_TRUE(g.run(Order::kValue, at, inside));
    EXPECT_FALSE(g.run(Order::kValue, at, outside));
    z[40] = -1;
    EXPECT_FALSE(g.run(Order::kValue, at, inside));
    z[40] = 0.5;
  }
}

}  // namespace
}  // namespace dyntape
