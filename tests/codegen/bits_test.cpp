// SPDX-License-Identifier: BSD-3-Clause
//
// Generated code against the interpreter, bit for bit: every operator, special values, every optimisation
// level, cut into pieces or not, and derivatives.
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/algebra/float128.h>
#include <gtest/gtest.h>

#include <array>

#include "compilers.h"
#include "random_function.h"

namespace dyntape::bits_test {
namespace {

using testing::Random;
using testing::same;
using Quad = dynamics::Float128;

struct Variant {
  std::vector<std::string> flags;
  std::size_t piece_statements;
};

CompiledFunction compiled(const Function& f, const Variant& variant, Order order) {
  CodegenOptions options;
  options.order = order;
  options.route = Route::kCompiled;
  options.use_cache = false;
  options.flags = variant.flags;
  options.piece_statements = variant.piece_statements;
  return CompiledFunction::make(f, options);
}

// Compares all outputs at random and special points; returns the number of comparisons.
std::size_t expect_same_bits(const Function& f, const CompiledFunction& c, Order order, Random& random,
                             int points) {
  CodegenOptions options;
  options.order = order;
  options.route = Route::kInterpreter;
  const CompiledFunction reference = CompiledFunction::make(f, options);
  std::size_t compared = 0;
  for (int k = 0; k < points; ++k) {
    const auto x = testing::random_arguments(random, f.n_x()), p = testing::random_arguments(random, f.n_p());
    const auto w = random.vector(order == Order::kSecond ? f.n_y() : 0, -1, 1);
    const auto a = c.evaluate(order, x, p, w), b = reference.evaluate(order, x, p, w);
    const auto compare = [&](const char* what, const std::vector<double>& found,
                             const std::vector<double>& expected) {
      ASSERT_EQ(found.size(), expected.size());
      for (std::size_t i = 0; i < found.size(); ++i, ++compared)
        ASSERT_TRUE(same(found[i], expected[i])) << what << " " << i << " at point " << k << ": compiled "
                                                 << found[i] << ", interpreted " << expected[i];
    };
    compare("y", a.y, b.y);
    compare("jacobian", a.jacobian, b.jacobian);
    compare("hessian", a.hessian, b.hessian);
    if (::testing::Test::HasFatalFailure()) return compared;
  }
  return compared;
}

class Bits : public ::testing::TestWithParam<int> {};

const std::array<Variant, 5> kVariants = {{{{"-O0"}, 400},
                                           {{}, 400},
                                           {{}, 100000},
                                           {{"-O3", testing::kOldProcessor}, 250},
                                           {{"-O3", "-march=native"}, 400}}};

TEST_P(Bits, RandomGraphsOverEveryOperator) {
  Random random(101 + GetParam());
  SCOPED_TRACE(random.seed_text());
  const Function f = testing::random_functions(random, 220, 12);
  std::array<bool, kTableOps> used{};
  const Function live = compact(f);
  for (const Node& node : live.graph.nodes()) {
    if (static_cast<int>(node.op) < kTableOps) used[static_cast<int>(node.op)] = true;
  }
  for (int op = 0; op < kTableOps; ++op) EXPECT_TRUE(used[op]) << kOpInfo[op].name;
  const CompiledFunction c = compiled(f, kVariants[GetParam()], Order::kValue);
  EXPECT_EQ(expect_same_bits(f, c, Order::kValue, random, 150), 150u * 660u);
}

TEST_P(Bits, DerivativesOfRandomGraphs) {
  Random random(201 + GetParam());
  SCOPED_TRACE(random.seed_text());
  const Function f = testing::random_functions(random, 40, 7);
  const CompiledFunction c = compiled(f, kVariants[GetParam()], Order::kSecond);
  EXPECT_GT(expect_same_bits(f, c, Order::kSecond, random, 200), 10000u);
}

// Products added and subtracted side by side: what gcc's vectoriser turns into vfmaddsub, contraction off or not.
TEST_P(Bits, ProductsOfComplexNumbers) {
  Random random(301 + GetParam());
  SCOPED_TRACE(random.seed_text());
  const Function f = record("complex", 16, [](const VectorXad& x) {
    VectorXad y(64);
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        const AD a = x[2 * i], b = x[2 * i + 1], c = x[8 + 2 * j], d = x[9 + 2 * j];
        const int k = 4 * (4 * i + j);
        y[k] = a * c - b * d;
        y[k + 1] = a * d + b * c;
        y[k + 2] = y[k] * a - d * d;
        y[k + 3] = y[k] * b + c * c;
      }
    }
    return y;
  });
  const CompiledFunction c = compiled(f, kVariants[GetParam()], Order::kFirst);
  EXPECT_GT(expect_same_bits(f, c, Order::kFirst, random, 200), 10000u);
}

// Differences of equal products: with one of them unrounded they are not zero, and a root or acosh of them is NaN.
TEST_P(Bits, ExactZerosOfDifferencesStay) {
  Random random(601 + GetParam());
  SCOPED_TRACE(random.seed_text());
  const Function f = record("zeros", 8, [](const VectorXad& x) {
    const auto square = [](const AD& a) { return AD(a * a); };
    // Each is zero where the second four entries are the first.
    const AD zeros[] = {square(x[0]) - square(x[4]),
                        x[0] * x[1] - x[4] * x[5],
                        x.head(4).squaredNorm() - x.tail(4).squaredNorm(),
                        (square(x[0]) - square(x[4])) + (x[1] * x[2] - x[5] * x[6]),
                        (x[2] - x[6]) + square(x[0]) - square(x[4]),
                        x[0] / x[3] - x[4] / x[7],
                        (x[0] * x[1] + x[0] * x[2]) - (x[4] * x[5] + x[4] * x[6]),
                        x[0] * x[1] + (-x[4]) * x[5]};
    VectorXad y(24);
    for (int i = 0; i < 8; ++i)
      y[3 * i] = zeros[i], y[3 * i + 1] = sqrt(zeros[i]), y[3 * i + 2] = acosh(1 + zeros[i]);
    return y;
  });
  const CompiledFunction c = compiled(f, kVariants[GetParam()], Order::kValue);
  for (int k = 0; k < 200; ++k) {
    std::vector<double> x = random.vector(4, 0.1, 1);
    x.insert(x.end(), x.begin(), x.begin() + 4);
    for (const double y : c.evaluate(Order::kValue, x).y) ASSERT_EQ(y, 0) << "point " << k;
  }
}

// Zeros of either sign, which compilers that take a negation into fma get wrong: all signs of all operands, negated
// again, asked by atan2 and by a quotient.
TEST_P(Bits, NegatedFusedProducts) {
  Random random(501 + GetParam());
  SCOPED_TRACE(random.seed_text());
  const Function f = record("negated", 3, [](const VectorXad& x) {
    VectorXad y(64);
    for (int signs = 0; signs < 16; ++signs) {
      const auto sign = [&](int i, const AD& a) { return signs >> i & 1 ? -a : a; };
      const AD a = sign(0, x[0]), b = sign(1, x[1]), c = sign(2, x[2]);
      const AD forms[] = {fma(a, b, c), fms(a, b, c), fnma(a, b, c), fnms(a, b, c)};
      for (int k = 0; k < 4; ++k) y[4 * signs + k] = atan2(sign(3, forms[k]), AD(-1)) - 1 / sign(3, forms[k]);
    }
    return y;
  });
  const CompiledFunction c = compiled(f, kVariants[GetParam()], Order::kValue);
  EXPECT_GT(expect_same_bits(f, c, Order::kValue, random, 100), 6000u);
  for (double x : {1.0, -1.0, 0.0, -0.0}) {
    for (double y : {1.0, -1.0, 0.0, -0.0}) {
      for (double z : {1.0, -1.0, 0.0, -0.0}) {
        const std::vector<double> found = c.evaluate(Order::kValue, {x, y, z}).y,
                                  expected = evaluate(f, {x, y, z});
        for (std::size_t i = 0; i < found.size(); ++i)
          EXPECT_TRUE(same(found[i], expected[i])) << i << " at " << x << " " << y << " " << z;
      }
    }
  }
}

// What is lost in rounding is what these compute: an optimiser that takes sums for real numbers leaves zero.
TEST_P(Bits, Case119_CompensatedArithmetic) {
  Random random(401 + GetParam());
  SCOPED_TRACE(random.seed_text());
  const Function f = record("compensated", 5, [](const VectorXad& x) {
    const AD sum = x[0] + x[1], part = sum - x[0];
    const AD two_sum = (x[0] - (sum - part)) + (x[1] - part);
    const auto split = [](const AD& a) {
      const AD c = 134217729.0 * a, high = c - (c - a);
      return std::pair(high, AD(a - high));
    };
    const AD product = x[0] * x[1];
    const auto [a, b] = split(x[0]);
    const auto [c, d] = split(x[1]);
    const AD two_product = b * d - (((product - a * c) - b * c) - a * d);
    AD kahan = 0.0, lost = 0.0;
    for (int i = 0; i < 5; ++i) {
      const AD y = x[i] - lost, t = kahan + y;
      lost = (t - kahan) - y;
      kahan = t;
    }
    VectorXad y(5);
    y << two_sum, two_product, kahan, lost, (1.0 + x[4] * 1e-17) - 1.0;
    return y;
  });
  const CompiledFunction c = compiled(f, kVariants[GetParam()], Order::kFirst);
  EXPECT_GT(expect_same_bits(f, c, Order::kFirst, random, 200), 2000u);
  const std::vector<double> y = c.evaluate(Order::kValue, {0.1, 3e-9, 1e-17, 0.3, 0.7}).y;
  EXPECT_EQ(y[0], static_cast<double>((Quad(0.1) + 3e-9) - (0.1 + 3e-9)));
  EXPECT_EQ(y[1], static_cast<double>(Quad(0.1) * 3e-9 - (0.1 * 3e-9)));
  EXPECT_EQ(y[4], 0);
  EXPECT_GT(c.evaluate(Order::kValue, {1, 1e-16, 1e-16, 1e-16, 1e-16}).y[2], 1);  // which a plain sum is not
}

INSTANTIATE_TEST_SUITE_P(Variants, Bits, ::testing::Range(0, int(kVariants.size())));

}  // namespace
}  // namespace dyntape::bits_test
