// SPDX-License-Identifier: BSD-3-Clause
//
// The fast profile: fewer operations, values within a stated tolerance, the same bits on every route.
#include <dyntape/codegen/passes/simplify.h>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/options/flags.h>
#include <dyntape/codegen/pipeline.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <span>

#include "random_function.h"

namespace dyntape::simplify_test {
namespace {

using codegen::simplify;
using testing::Random;

std::size_t count(const Function& f, Op op) {
  for (const OperationCount& entry : count_operations(f)) {
    if (entry.op == op) return entry.count;
  }
  return 0;
}

VectorXad one(const AD& y) { return VectorXad::Constant(1, y); }

// Polynomials over a few divisors: what the rewrites look for.
Function rational(Random& random, std::size_t outputs) {
  Function f;
  f.name = "rational";
  f.inputs = {5, 0, 0};
  std::vector<NodeId> inputs;
  for (std::uint32_t i = 0; i < 5; ++i) inputs.push_back(f.graph.input(Block::kVariables, i));
  for (std::size_t k = 0; k < outputs; ++k) {
    const auto pick = [&] { return inputs[random.below(inputs.size())]; };
    std::vector<NodeId> terms;
    for (int i = 0; i < 6; ++i) {
      const NodeId product = f.graph.make(Op::Mul, pick(), pick());
      terms.push_back(random.below(2)
                          ? product
                          : f.graph.make(Op::Div, product, random.below(3) ? pick() : f.graph.constant(3)));
    }
    while (terms.size() > 1) {
      const NodeId last = terms.back();
      terms.pop_back();
      NodeId& other = terms[random.below(terms.size())];
      other = f.graph.make(random.below(2) ? Op::Add : Op::Sub, other, last);
    }
    f.outputs.push_back(terms[0]);
  }
  return compact(f);
}

TEST(Simplify, StrictChangesNothing) {
  Random random(51);
  const Function f = rational(random, 5);
  for (const bool has_fma : {false, true})
    EXPECT_EQ(content_hash(simplify(f, Profile::kStrict, has_fma)), content_hash(f));
}

TEST(Simplify, ReciprocalsAreShared) {
  const Function f = record("three", 4, [](const VectorXad& x) {
    VectorXad y(3);
    y << x[0] / x[3], x[1] / x[3], x[2] / x[3];
    return y;
  });
  EXPECT_EQ(count(f, Op::Div), 3u);
  EXPECT_EQ(count(simplify(f, Profile::kFast), Op::Div), 1u);
  const Function alone = record("alone", 2, [](const VectorXad& x) { return one(x[0] / x[1]); });
  EXPECT_EQ(count(simplify(alone, Profile::kFast), Op::Div), 1u) << "one division is cheapest as it is";
  const Function constant = record("constant", 1, [](const VectorXad& x) { return one(x[0] / 3.0); });
  EXPECT_EQ(count(simplify(constant, Profile::kFast), Op::Div), 0u);
  const Function tiny = record("tiny", 1, [](const VectorXad& x) { return one(x[0] / 1e-310); });
  EXPECT_EQ(count(simplify(tiny, Profile::kFast), Op::Div), 1u) << "its reciprocal overflows";
}

TEST(Simplify, CommonFactorsAreTakenOut) {
  const Function sum = record("sum", 5, [](const VectorXad& x) {
    return one(x[0] * x[1] + x[0] * x[2] - x[3] * x[0] + x[0] * x[4]);
  });
  EXPECT_EQ(count(sum, Op::Mul), 4u);
  EXPECT_EQ(count(simplify(sum, Profile::kFast), Op::Mul), 1u);
  const Function shared = record("shared", 3, [](const VectorXad& x) {
    VectorXad y(2);
    y << x[0] * x[1] + x[0] * x[2], x[0] * x[1];
    return y;
  });
  EXPECT_EQ(total_operations(simplify(shared, Profile::kFast)), total_operations(shared))
      << "the product is needed anyway";
}

// With x[0], ..., x[7] by name.
template <class F>
Function of_eight(F&& f) {
  return record("eight", 8, [&](const VectorXad& x) {
    const std::vector<AD> y = f(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7]);
    return VectorXad(Eigen::Map<const VectorXad>(y.data(), static_cast<Eigen::Index>(y.size())));
  });
}

TEST(Simplify, ProductsAreFusedIntoSums) {
  const auto fast = [](const Function& f) { return simplify(f, Profile::kFast, true); };
  const Function each = fast(of_eight([](auto a, auto b, auto c, auto...) {
    return std::vector<AD>{a * b + c, a * c - b, a - b * c};
  }));
  EXPECT_EQ(count(each, Op::Fma), 1u);
  EXPECT_EQ(count(each, Op::Fms), 1u);
  EXPECT_EQ(count(each, Op::Fnma), 1u);
  EXPECT_EQ(total_operations(each), 3u);

  const Function shared = fast(of_eight([](auto a, auto b, auto c, auto d, auto...) {
    const AD product = a * b;
    return std::vector<AD>{product + c, d - product};
  }));
  EXPECT_EQ(total_operations(shared), 2u) << "into all of its sums";
  const Function needed = fast(of_eight([](auto a, auto b, auto c, auto...) {
    const AD product = a * b;
    return std::vector<AD>{product + c, sin(product)};
  }));
  EXPECT_EQ(count(needed, Op::Fma), 0u) << "the product is needed anyway";

  const auto tree = of_eight([](auto a, auto b, auto c, auto d, auto e, auto f, auto g, auto h) {
    return std::vector<AD>{(a * b + c * d) + (e * f - g * h)};
  });
  EXPECT_EQ(count(fast(tree), Op::Mul), 1u);
  EXPECT_EQ(total_operations(fast(tree)), 4u);
  const auto mixed = of_eight([](auto a, auto b, auto c, auto d, auto e, auto f, auto...) {
    return std::vector<AD>{(e - f) - (a * b + c * d)};
  });
  EXPECT_EQ(total_operations(fast(mixed)), 3u);
  EXPECT_EQ(total_operations(simplify(tree, Profile::kFast, false)), 7u) << "where there is no instruction";
}

// Where strict subtracts equal numbers fast does too: no root of a rounding error, no logarithm of one.
TEST(Simplify, ExactZerosOfDifferencesStay) {
  using Eight = std::function<AD(const VectorXad&)>;
  struct Zero {
    const char* name;
    Eight f;
  };
  const auto square = [](const AD& a) { return a * a; };
  // Each is zero in strict where the second four entries are the first.
  const Zero zeros[] = {
      {"x x - y y", [&](const VectorXad& x) { return square(x[0]) - square(x[4]); }},
      {"a b - c d", [](const VectorXad& x) { return x[0] * x[1] - x[4] * x[5]; }},
      {"norms", [](const VectorXad& x) { return x.head(4).squaredNorm() - x.tail(4).squaredNorm(); }},
      {"pairs",
       [&](const VectorXad& x) { return (square(x[0]) - square(x[4])) + (x[1] * x[2] - x[5] * x[6]); }},
      {"in turn",
       [&](const VectorXad& x) { return square(x[0]) - square(x[4]) + square(x[1]) - square(x[5]); }},
      {"with a sum", [&](const VectorXad& x) { return (x[2] - x[6]) + square(x[0]) - square(x[4]); }},
      {"quotients", [](const VectorXad& x) { return x[0] / x[3] - x[4] / x[7]; }},
      {"factors",
       [](const VectorXad& x) { return (x[0] * x[1] + x[0] * x[2]) - (x[4] * x[5] + x[4] * x[6]); }},
      {"of opposite signs", [](const VectorXad& x) { return x[0] * x[1] + (-x[4]) * x[5]; }},
  };
  using Edge = std::function<AD(const AD&)>;
  // A kernel may take the root inside without saying so.
  Kernel root;
  root.c_body = "out[0] = sqrt(in[0]);";
  root.evaluate = [](const double* in, double* out) { out[0] = std::sqrt(in[0]); };
  const auto silent = std::make_shared<const Callee>("root", 1, 1, root);
  const Edge edges[] = {[](const AD& d) { return sqrt(d); },
                        [](const AD& d) { return pow(d, 0.5); },
                        [](const AD& d) { return sqrt(3.0 * d + 0.0 * d); },
                        [](const AD& d) { return acos(1 + d) + asin(1 + d); },
                        [](const AD& d) { return acosh(1 + d); },
                        [&](const AD& d) { return call(silent, one(d))[0]; }};
  Random random(61);
  SCOPED_TRACE(random.seed_text());
  for (const Zero& zero : zeros) {
    SCOPED_TRACE(zero.name);
    const Function f = record("edges", 8, [&](const VectorXad& x) {
      VectorXad y(6);
      for (int k = 0; k < 6; ++k) y[k] = edges[k](zero.f(x));
      return y;
    });
    const Function fast = simplify(f, Profile::kFast, true);
    const Function called = simplify(record("call", 8,
                                            [callee = recorded_callee(f), &zero](const VectorXad& x) {
                                              VectorXad in = x;
                                              in[0] = sqrt(zero.f(x)) + x[0];
                                              return call(callee, in);
                                            }),
                                     Profile::kFast, true);
    for (int i = 0; i < 200; ++i) {
      std::vector<double> x = random.vector(4, 0.1, 1);
      x.insert(x.end(), x.begin(), x.begin() + 4);
      const std::vector<double> strict = evaluate(f, x);
      for (double y : strict) ASSERT_FALSE(std::isnan(y));
      ASSERT_EQ(evaluate(fast, x), strict);
      ASSERT_EQ(evaluate(called, x), strict);
    }
  }
  // A difference of two squares by itself: whoever takes its root elsewhere gets zero.
  const Function difference = record("difference", 8, [&](const VectorXad& x) { return one(zeros[0].f(x)); });
  const Function fast = simplify(difference, Profile::kFast, true);
  EXPECT_EQ(count(fast, Op::Sub), 1u);
  for (int i = 0; i < 200; ++i) {
    const double x = random.uniform(-1, 1);
    EXPECT_EQ(evaluate(fast, {x, 0, 0, 0, x, 0, 0, 0})[0], 0);
  }
}

// The orientation of vectors: of parallel ones, of whatever lengths, it is zero in strict and in fast, and everywhere else
// its sign is that of strict.
TEST(Simplify, TheSignOfADifferenceOfProductsIsThatOfStrict) {
  using Four = std::function<AD(const VectorXad&)>;
  const std::pair<const char*, Four> forms[] = {
      {"x0 x3 - x1 x2", [](const VectorXad& x) { return x[0] * x[3] - x[1] * x[2]; }},
      {"- x1 x2 + x0 x3", [](const VectorXad& x) { return -(x[1] * x[2]) + x[0] * x[3]; }},
      {"x0 x3 + (-x1) x2", [](const VectorXad& x) { return x[0] * x[3] + (-x[1]) * x[2]; }},
      {"x1 (-x2) - x0 (-x3)", [](const VectorXad& x) { return x[1] * (-x[2]) - x[0] * (-x[3]); }},
      {"twice", [](const VectorXad& x) { return 2.0 * (x[0] * x[3] - x[1] * x[2]); }},
      {"as a factor", [](const VectorXad& x) { return (x[0] * x[3] - x[1] * x[2]) * (1 + x[0] * x[0]); }},
      {"where a product is used again",
       [](const VectorXad& x) {
         const AD product = x[0] * x[3];
         return (product - x[1] * x[2]) * (2 + tanh(product));
       }},
      {"of differences",
       [](const VectorXad& x) { return (x[0] - 2.0) * (x[3] + 4.0) - (x[1] + 1.0) * (x[2] - 8.0); }}};
  Random random(62);
  SCOPED_TRACE(random.seed_text());
  for (const auto& [name, form] : forms) {
    const Function f = record("turn", 4, [&, of = form](const VectorXad& x) { return one(of(x)); });
    const Function fast = simplify(f, Profile::kFast, true);
    int zeros = 0;
    for (int i = 0; i < 1000; ++i) {
      std::vector<double> x = random.vector(2, -1, 1);
      const double factor = std::ldexp(1, i % 7 - 3) * (i % 2 ? 1 : 1 + std::ldexp(1, -i % 20 - 1));
      x.insert(x.end(), {factor * x[0], factor * x[1]});
      if (std::string(name) == "of differences") x = {2 + x[0], x[1] - 1, x[2] + 8, x[3] - 4};
      const double strict = evaluate(f, x)[0], got = evaluate(fast, x)[0];
      ASSERT_EQ(std::signbit(strict), std::signbit(got)) << name << " " << strict << " " << got;
      ASSERT_EQ(strict == 0, got == 0) << name << " " << strict << " " << got;
      zeros += strict == 0;
    }
    EXPECT_GT(zeros, 100) << name;
  }
  // Within a longer sum it is fused as ever.
  const Function longer =
      record("longer", 6, [](const VectorXad& x) { return one(x[0] * x[3] - x[1] * x[2] + x[4] * x[5]); });
  EXPECT_EQ(count(simplify(longer, Profile::kFast, true), Op::Mul), 1u);
}

TEST(Simplify, AProcessorWithoutFmaGetsNone) {
  using codegen::has_fma;
  EXPECT_FALSE(has_fma({"-march=x86-64"}));
  EXPECT_FALSE(has_fma({"-O3", "-mno-fma"}));
  EXPECT_TRUE(has_fma({"-march=x86-64", "-mfma"}));
  EXPECT_EQ(has_fma({"-march=x86-64", "-march=native"}), has_fma({}));
  const Function f = of_eight([](auto a, auto b, auto c, auto...) { return std::vector<AD>{a * b + c}; });
  CodegenOptions options;
  options.order = Order::kValue;
  options.profile = Profile::kFast;
  options.flags = {"-march=x86-64"};
  EXPECT_EQ(generate_source(f, options).text.find("fma("), std::string::npos);
  EXPECT_EQ(generate_embedded(f, options).source.text.find("fma("), std::string::npos);
  options.flags = {"-mfma"};
  EXPECT_NE(generate_source(f, options).text.find("fma("), std::string::npos);
  EXPECT_EQ(generate_embedded(f, options).source.text.find("fma("), std::string::npos) << "another target";
}

// Values, Jacobian and Hessian in full: fast may find that an entry is zero everywhere and drop it.
std::vector<double> in_full(const Derivatives& d, const std::vector<double>& out) {
  std::vector<double> full(out.begin(), out.begin() + std::ptrdiff_t(d.n_y));
  std::size_t next = d.n_y;
  for (const Pattern* pattern : {&d.jacobian, &d.hessian}) {
    const std::size_t offset = full.size();
    full.resize(offset + pattern->rows * pattern->cols);
    for (std::size_t k = 0; k < pattern->nnz(); ++k)
      full[offset + pattern->row[k] * pattern->cols + pattern->col[k]] = out[next++];
  }
  return full;
}

Derivatives fast_derivatives(const Function& f, Order order, bool has_fma) {
  return simplify(derive(simplify(f, Profile::kFast, has_fma), order), Profile::kFast, has_fma);
}

// In units of an addition: a division takes about four.
std::size_t cost(const Function& function) {
  std::size_t total = 0;
  for (const OperationCount& entry : count_operations(function))
    total += entry.count * (entry.op == Op::Div ? 4 : 1);
  return total;
}

// In Hessians gates of weights stand between terms that could be factored otherwise.
TEST(Simplify, JacobiansCostLess) {
  for (std::uint64_t seed = 60; seed < 80; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.seed_text());
    const Function f = rational(random, 20);
    std::size_t least = cost(derive(f, Order::kFirst).function);
    for (const bool has_fma : {false, true}) {
      const std::size_t less = cost(fast_derivatives(f, Order::kFirst, has_fma).function);
      EXPECT_LT(less, least);
      least = less;
    }
  }
}

TEST(Simplify, ValuesStayWithinTheTolerance) {
  for (std::uint64_t seed = 60; seed < 80; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.seed_text());
    const Function f = rational(random, 20);
    const Derivatives strict = derive(f, Order::kSecond);
    for (const bool has_fma : {false, true}) {
      const Derivatives fast = fast_derivatives(f, Order::kSecond, has_fma);
      for (int k = 0; k < 20; ++k) {
        const auto x = random.vector(5, 0.5, 2.0), w = random.vector(20, -1, 1);
        const auto a = in_full(strict, evaluate(strict.function, x, {}, w)),
                   b = in_full(fast, evaluate(fast.function, x, {}, w));
        ASSERT_EQ(a.size(), b.size());
        // Terms are below 8, their derivatives below 200, and sums have some hundred of them.
        for (std::size_t i = 0; i < a.size(); ++i)
          ASSERT_NEAR(a[i], b[i], 1e-12 * std::max(1.0, std::abs(a[i]))) << i;
      }
    }
  }
}

TEST(Simplify, EveryRouteAndKernelHasTheSameBits) {
  Random random(52);
  SCOPED_TRACE(random.seed_text());
  const Function f = rational(random, 8);
  CodegenOptions options;
  options.order = Order::kSecond;
  options.profile = Profile::kFast;
  options.use_cache = false;
  options.route = Route::kCompiled;
  const CompiledFunction compiled = CompiledFunction::make(f, options);
  options.route = Route::kInterpreter;
  const CompiledFunction interpreted = CompiledFunction::make(f, options);
  for (int k = 0; k < 50; ++k) {
    const auto x = random.vector(5, -2, 2), w = random.vector(8, -1, 1);
    const auto a = compiled.evaluate(Order::kSecond, x, {}, w),
               b = interpreted.evaluate(Order::kSecond, x, {}, w);
    EXPECT_EQ(a.y, b.y);
    EXPECT_EQ(a.jacobian, b.jacobian);
    EXPECT_EQ(a.hessian, b.hessian);
    EXPECT_EQ(a.y, compiled.evaluate(Order::kValue, x).y);
    EXPECT_EQ(a.y, compiled.evaluate(Order::kFirst, x).y);
  }
}

TEST(Simplify, LanesHaveTheBitsOfTheInterpreter) {
  Random random(54);
  SCOPED_TRACE(random.seed_text());
  const Function f = rational(random, 8);
  CodegenOptions options;
  options.order = Order::kValue;
  options.profile = Profile::kFast;
  options.use_cache = false;
  options.lanes = Lanes::kAll;
  const Function fast = simplify(compact(f), Profile::kFast, codegen::has_fma({}));
  for (unsigned width : {2u, 4u, 8u}) {
    options.widest_lanes = width;
    const CompiledFunction compiled = CompiledFunction::make(f, options);
    CompiledFunction::Workspace workspace(compiled);
    constexpr std::size_t kPoints = 40;
    const auto x = random.vector(5 * kPoints, -2, 2);
    std::vector<double> y(8 * kPoints);
    Points points;
    points.count = kPoints;
    points.x = x.data();
    points.y = y.data();
    ASSERT_FALSE(compiled.run(Order::kValue, points, workspace));
    for (std::size_t i = 0; i < kPoints; ++i) {
      const auto expected = evaluate(fast, std::span(&x[5 * i], 5));
      for (std::size_t k = 0; k < 8; ++k)
        ASSERT_TRUE(testing::same(y[8 * i + k], expected[k])) << "of " << width << " lanes, point " << i;
    }
  }
}

TEST(Simplify, NaNAndInfinityAreNotAssumedAway) {
  const Function f = record("limits", 2, [](const VectorXad& x) {
    VectorXad y(2);
    y << x[0] / x[1], 2.0 / x[1] + x[0] * 3.0 - x[0] * 4.0;
    return y;
  });
  const Function fast = simplify(f, Profile::kFast, true);
  const double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  for (const std::vector<double>& x :
       {std::vector{1.0, 0.0}, {0.0, 0.0}, {inf, 2.0}, {nan, 1.0}, {1.0, nan}, {1.0, inf}}) {
    const auto a = evaluate(f, x), b = evaluate(fast, x);
    for (std::size_t i = 0; i < a.size(); ++i)
      EXPECT_TRUE(testing::same(a[i], b[i])) << x[0] << " " << x[1] << ": " << a[i] << " " << b[i];
  }
}

TEST(Simplify, GuardsKeepTheirConditions) {
  const Function f = record("guarded", 3, [](const VectorXad& x) {
    const AD ratio = x[0] / x[2] + x[1] / x[2];
    return one(ratio < 1.0 ? ratio : ratio * 2.0);
  });
  const Function fast = simplify(f, Profile::kFast, true);
  ASSERT_EQ(fast.guards.size(), 1u);
  Random random(53);
  SCOPED_TRACE(random.seed_text());
  for (int k = 0; k < 2000; ++k) {
    const auto x = random.vector(2, 0, 1);
    std::vector<double> at = {x[0], x[1], x[0] + x[1]};  // the ratio is one up to rounding
    const auto violates = [&](const Function& g) {
      try {
        evaluate(g, at);
      } catch (const GuardViolation&) {
        return true;
      }
      return false;
    };
    ASSERT_EQ(violates(f), violates(fast)) << k;
  }
}

}  // namespace
}  // namespace dyntape::simplify_test
