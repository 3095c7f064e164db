// SPDX-License-Identifier: BSD-3-Clause
//
// Points of a mesh and its end in one call, by every option that solve has.
#include <gtest/gtest.h>

#include <random>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/control/discretize/evaluation.h>

namespace dyntape::evaluation_test {
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
  std::vector<Evaluator> all;  // the end is one like the others
  add_evaluator(all, pendulum(), options, {.count = points - 1, .threads = threads});
  add_evaluator(all, pendulum(), options, {.variable = 3 * (points - 1)});
  const std::vector<double> z = draw(3 * points), p = draw(points);
  all.front().parameters.assign(p.begin(), p.end() - 1), all.back().parameters = {p.back()};
  for (const Evaluator& e : all) e.function.wait();
  Evaluation evaluation(all, Order::kSecond);
  evaluation.weights = draw(2 * points);
  EXPECT_TRUE(evaluation.run(all, Order::kSecond, z.data()));
  const Results r{evaluation.y, evaluation.jacobian, evaluation.hessian};
  EXPECT_EQ(r.y.size(), 2 * points);
  return r;
}

// Threads and lanes change no bit.
TEST(Evaluation, EveryOptionGivesTheSame) {
  constexpr std::size_t kPoints = 83;
  const CodegenOptions interpreted{.order = Order::kSecond, .route = Route::kInterpreter};
  const Results expected = results(interpreted, 1, kPoints);
  for (unsigned threads : {1u, 2u, 3u, 0u}) {
    EXPECT_EQ(results(interpreted, threads, kPoints), expected) << threads << " threads";
    EXPECT_EQ(results({.order = Order::kSecond}, threads, kPoints), expected) << threads << " threads";
    EXPECT_EQ(results({.order = Order::kSecond, .lanes = Lanes::kNative}, threads, kPoints), expected);
  }
}

// Interpreted, and some day compiled: the same.
TEST(Evaluation, Tiers) {
  EXPECT_EQ(results({.order = Order::kSecond, .route = Route::kTiered}, 2, 83),
            results({.order = Order::kSecond, .route = Route::kInterpreter}, 1, 83));
}

TEST(Evaluation, ABranchIsLeftAtOnePointOrAtTheEnd) {
  const Function f = record(
      "side", 1, [](const VectorXad& x) { return VectorXad::Constant(1, x[0] > 0.0 ? x[0] * x[0] : -x[0]); });
  const CodegenOptions interpreted{.order = Order::kValue, .route = Route::kInterpreter};
  for (unsigned threads : {1u, 2u}) {
    std::vector<Evaluator> all;
    add_evaluator(all, f, interpreted, {.count = 64, .threads = threads});
    add_evaluator(all, f, interpreted, {.variable = 64});
    Evaluation evaluation(all, Order::kValue);
    std::vector<double> z(65, 0.5);
    EXPECT_TRUE(evaluation.run(all, Order::kValue, z.data()));
    z[64] = -1;
    EXPECT_FALSE(evaluation.run(all, Order::kValue, z.data()));
    EXPECT_TRUE(evaluation.run(all, Order::kValue, z.data(), {0, 1}));
    z[64] = 0.5, z[40] = -1;
    EXPECT_FALSE(evaluation.run(all, Order::kValue, z.data()));
    EXPECT_TRUE(evaluation.run(all, Order::kValue, z.data(), {1, 2}));
  }
}

}  // namespace
}  // namespace dyntape::evaluation_test
