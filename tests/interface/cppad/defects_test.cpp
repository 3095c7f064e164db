// SPDX-License-Identifier: BSD-3-Clause
// Where CppAD (commit dcc87a36, 2026-04-30) gives something else: every row is right here.
#include <dyntape/interface/cppad/library.h>

#include "programs.h"

namespace {

ADFun<double> of_one(double at, ADouble (*code)(const ADouble&)) {
  return recorded({at}, [code](const AVector& x) -> std::vector<ADouble> { return {code(x[0])}; });
}

struct Slopes {
  double value, forward, reverse, second;
};
Slopes slopes_at(ADFun<double>& f, double x) {
  Slopes s;
  s.value = f.Forward(0, DVector{x})[0];
  s.forward = f.Forward(1, DVector{1})[0];
  s.reverse = f.Reverse(1, DVector{1})[0];
  s.second = f.Hessian(DVector{x}, std::size_t(0))[0];
  return s;
}

TEST(CppadDefects, FirstPowerAtZero) {
  ADFun<double> f = of_one(1, [](const ADouble& x) { return pow(x, 1.0); });
  const Slopes s = slopes_at(f, 0);
  EXPECT_EQ(s.value, 0);
  EXPECT_EQ(s.forward, 1);
  EXPECT_EQ(s.reverse, 1);
}

TEST(CppadDefects, SquareAtZeroHasCurvature) {
  ADFun<double> f = of_one(1, [](const ADouble& x) { return pow(x, 2.0); });
  const Slopes s = slopes_at(f, 0);
  EXPECT_EQ(s.reverse, 0);
  EXPECT_EQ(s.second, 2);
  f.Forward(0, DVector{0}), f.Forward(1, DVector{1});
  EXPECT_EQ(f.Forward(2, DVector{0})[0], 1);
}

TEST(CppadDefects, RootsAndReciprocalsAtZero) {
  ADFun<double> root = of_one(1, [](const ADouble& x) { return pow(x, 0.5); });
  const Slopes r = slopes_at(root, 0);
  EXPECT_EQ(r.forward, kInf);
  EXPECT_EQ(r.reverse, kInf);
  ADFun<double> reciprocal = of_one(1, [](const ADouble& x) { return pow(x, -1.0); });
  const Slopes i = slopes_at(reciprocal, 0);
  EXPECT_EQ(i.value, kInf);
  EXPECT_EQ(i.forward, -kInf);
  EXPECT_EQ(i.reverse, -kInf);
}

TEST(CppadDefects, ReverseOfAPowerAddsToWhatIsThere) {
  ADFun<double> f = of_one(1, [](const ADouble& x) {
    const ADouble p = pow(x, 2.0);
    return p - 7 * x;
  });
  const Slopes s = slopes_at(f, 0);
  EXPECT_EQ(s.forward, -7);
  EXPECT_EQ(s.reverse, -7);
}

TEST(CppadDefects, PowerOfTwoVariables) {
  ADFun<double> f =
      recorded({1, 2}, [](const AVector& x) -> std::vector<ADouble> { return {pow(x[0], x[1])}; });
  expect_near(f.Forward(0, DVector{0, 2}), {0});
  expect_near(f.Reverse(1, DVector{1}), {0, 0});
  expect_near(f.Forward(1, DVector{1, 0}), {0});
  expect_near(f.Forward(1, DVector{0, 1}), {0});
  expect_near(f.Forward(0, DVector{-2, 3}), {-8});
  EXPECT_EQ(f.Reverse(1, DVector{1})[0], 12);
  EXPECT_EQ(f.Forward(1, DVector{1, 0})[0], 12) << "only x moves";
}

TEST(CppadDefects, PowerAtTheOriginIsDocumented) {
  ADFun<double> f =
      recorded({1, 2}, [](const AVector& x) -> std::vector<ADouble> { return {pow(x[0], x[1])}; });
  expect_near(f.Forward(0, DVector{0, 0}), {1});
  const DVector reverse = f.Reverse(1, DVector{1});
  EXPECT_EQ(reverse[0], 0);
  EXPECT_EQ(reverse[1], -kInf);
  EXPECT_EQ(f.Forward(1, DVector{0, 1})[0], -kInf);
}

TEST(CppadDefects, ZeroToAPowerIsNotFolded) {
  ADFun<double> f = of_one(2, [](const ADouble& y) { return pow(ADouble(0.0), y); });
  EXPECT_EQ(f.Forward(0, DVector{2})[0], 0);
  EXPECT_EQ(f.Forward(0, DVector{0})[0], 1);
}

TEST(CppadDefects, RootsOfSquaresAgreeInBothModes) {
  ADFun<double> root = of_one(1, [](const ADouble& x) { return sqrt(x); });
  EXPECT_EQ(slopes_at(root, 0).forward, kInf);
  ADFun<double> norm = of_one(1, [](const ADouble& x) { return sqrt(x * x); });
  const Slopes s = slopes_at(norm, 0);
  EXPECT_TRUE(std::isnan(s.forward) && std::isnan(s.reverse));
  ADFun<double> safe = of_one(1, [](const ADouble& x) { return hypot(x, ADouble(0)); });
  EXPECT_EQ(slopes_at(safe, 0).reverse, 0);
}

TEST(CppadDefects, Atan2AtTheOriginAndAtMinusZero) {
  ADFun<double> f =
      recorded({1, 1}, [](const AVector& x) -> std::vector<ADouble> { return {atan2(x[0], x[1])}; });
  EXPECT_EQ(f.Forward(0, DVector{0, 0})[0], 0);
  EXPECT_TRUE(std::isnan(f.Reverse(1, DVector{1})[0])) << "documented";
  EXPECT_EQ(f.Forward(0, DVector{-0.0, -1})[0], -std::acos(-1.0));
}

TEST(CppadDefects, Atan2OfSmallNumbersIsScaled) {
  ADFun<double> f =
      recorded({1, 1}, [](const AVector& x) -> std::vector<ADouble> { return {atan2(x[0], x[1])}; });
  expect_near(f.Jacobian(DVector{1e-300, 1e-300}), {5e299, -5e299});
  // of second order 2 x y / (x^2 + y^2)^2, whose square root is representable and whose divisor is not
  const DVector H = f.Hessian(DVector{1e-150, 1e-150}, std::size_t(0));
  EXPECT_NEAR(H[0] / -5e299, 1, 1e-12);
  EXPECT_NEAR(H[3] / 5e299, 1, 1e-12);
  EXPECT_NEAR(H[1] / 5e299, 0, 1e-12);
}

TEST(CppadDefects, ReciprocalTimesItselfAgreesInBothModes) {
  ADFun<double> f = of_one(1, [](const ADouble& x) { return x * (1 / x); });
  const Slopes s = slopes_at(f, 0);
  EXPECT_TRUE(std::isnan(s.forward));
  EXPECT_TRUE(std::isnan(s.reverse));
}

TEST(CppadDefects, WhatIsNotTakenIsZeroAlsoInGeneratedCode) {
  ADFun<double> f = of_one(1, [](const ADouble& x) { return CondExpGt(x, ADouble(0), sqrt(x), ADouble(0)); });
  dyntape::CodegenOptions options;
  options.order = dyntape::Order::kSecond;
  const dyntape::CompiledFunction g = CppAD::to_library(f, options);
  for (const double x : {0.0, -1.0}) {
    const Slopes s = slopes_at(f, x);
    EXPECT_EQ(s.value, 0);
    EXPECT_EQ(s.forward, 0);
    EXPECT_EQ(s.reverse, 0);
    EXPECT_EQ(s.second, 0);
    const auto all = g.evaluate(dyntape::Order::kSecond, {x}, {}, {1});
    EXPECT_EQ(all.jacobian[0], 0);
    EXPECT_EQ(all.hessian[0], 0);
  }
}

TEST(CppadDefects, LengthWithoutOverflow) {
  ADFun<double> f =
      recorded({1, 1}, [](const AVector& x) -> std::vector<ADouble> { return {hypot(x[0], x[1])}; });
  expect_near(f.Forward(0, DVector{1e200, 1e200}), {std::sqrt(2.0) * 1e200});
  expect_near(f.Reverse(1, DVector{1}), {std::sqrt(0.5), std::sqrt(0.5)});
}

TEST(CppadDefects, AbsAtBothZeros) {
  ADFun<double> f = of_one(1, [](const ADouble& x) { return abs(x); });
  EXPECT_EQ(slopes_at(f, 0.0).reverse, 0);
  EXPECT_EQ(slopes_at(f, -0.0).forward, 0);
}

TEST(CppadDefects, LeavingABranchIsSaid) {
  ADFun<double> f = of_one(2, [](const ADouble& x) { return x > 1 ? x * x : x; });
  f.Forward(0, DVector{0.5});
  EXPECT_EQ(f.compare_change_number(), 1u);
  f.check_branches(true);
  EXPECT_THROW(f.Forward(0, DVector{0.5}), dyntape::GuardViolation);
  const dyntape::CompiledFunction g = CppAD::to_library(f);
  const std::string sentence =
      sentence_of<dyntape::GuardViolation>([&] { g.evaluate(dyntape::Order::kValue, {0.5}); });
  EXPECT_NE(sentence.find("defects_test.cpp"), std::string::npos) << sentence;
}

// Expressions that its optimiser leaves as they are, and large tapes on which it stops looking for equal ones.
TEST(CppadDefects, EqualExpressionsAreOneHoweverMany) {
  for (const std::size_t n : {1000u, 100000u}) {
    AVector ax(n), ay(n);
    for (std::size_t i = 0; i < n; ++i) ax[i] = 0.1;
    Independent(ax);
    for (std::size_t i = 0; i < n; ++i) ay[i] = exp(1.5 * ax[i]) + exp(1.5 * ax[i]);
    ADFun<double> f;
    f.Dependent(ax, ay);
    f.optimize();
    EXPECT_EQ(f.size_var(), 4 * n) << "a variable, a product, an exponential, a sum";
  }
}

TEST(CppadDefects, ConditionsAreShared) {
  ADFun<double> f = recorded({1, 2}, [](const AVector& x) -> std::vector<ADouble> {
    const ADouble a = CondExpLt(x[0], x[1], x[0], x[1]), b = CondExpLt(x[0], x[1], x[0], x[1]);
    return {a * b, -(-x[0]), pow(x[0], 2) + x[0] * x[0]};
  });
  EXPECT_EQ(f.size_var(), 2u + 3u + 2u);
}

// Its generator of C leaves these two out in release builds.
TEST(CppadDefects, MinusAndConditionsReachTheC) {
  ADFun<double> f = recorded({1, 2}, [](const AVector& x) -> std::vector<ADouble> {
    return {-x[0], CondExpLt(x[0], x[1], x[0] * 3, x[1])};
  });
  const auto y = CppAD::to_library(f).evaluate(dyntape::Order::kValue, {1, 2}).y;
  EXPECT_EQ(y, (std::vector<double>{-1, 3}));
}

// Constants with all their digits, and those that are no numbers.
TEST(CppadDefects, ConstantsReachTheCExactly) {
  ADFun<double> f = recorded({1}, [](const AVector& x) -> std::vector<ADouble> {
    return {x[0] * (0.1 + 0.2), x[0] + 12345678901234567.0, CondExpLt(x[0], ADouble(0), x[0], ADouble(kInf))};
  });
  const auto y = CppAD::to_library(f).evaluate(dyntape::Order::kValue, {1}).y;
  EXPECT_EQ(y, (std::vector<double>{0.1 + 0.2, 12345678901234568.0, kInf}));
}

}  // namespace
