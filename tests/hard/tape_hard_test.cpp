// SPDX-License-Identifier: BSD-3-Clause
//
// Differentiation again and again, parameters that are special while recording, derivatives without a branch.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include <dyntape/dynamics/algebra/stumpff.h>

#include "every_route.h"

namespace dyntape::testing::tape_hard_test {
namespace {

struct Known {
  const char* name;
  std::function<AD(const AD&)> f;
  double x;
  Values derivatives;  // of order 0 to 5
};

class ToFifthOrder : public ::testing::TestWithParam<Known> {};

// 1, 7, 22, 81, 82, H04 | naive: each derivation of a quotient or a root makes poles of its own, and the third order
// is noise | holds: derivatives to the fifth order, one derivation after the other, are those known by hand to 1e-12,
// through a root, broken powers, and sin(t)/t at zero | routes: interpreter, C at -O3
TEST_P(ToFifthOrder, DerivativesAreThoseKnownByHand) {
  const Known& known = GetParam();
  Function f =
      record(known.name, 1, [&](const VectorXad& x) { return VectorXad::Constant(1, known.f(x[0])); });
  for (std::size_t order = 0; order < known.derivatives.size(); ++order) {
    const Values ones(f.n_w(), 1.0), got = evaluate(f, {known.x}, {}, ones);
    EXPECT_NEAR(got[0], known.derivatives[order], 1e-12 * std::max(1.0, std::abs(known.derivatives[order])))
        << order;
    if (order + 1 < known.derivatives.size()) f = jvp(f);
  }
  // The last of them in C; its directions as variables.
  const Function last = all_as_variables(f);
  Values x = {known.x};
  x.resize(last.n_x(), 1.0);
  CodegenOptions options{
      .order = Order::kFirst, .route = Route::kCompiled, .use_cache = false, .flags = {"-O3"}};
  const CompiledFunction compiled = CompiledFunction::make(last, options);
  options.route = Route::kInterpreter;
  const CompiledFunction interpreted = CompiledFunction::make(last, options);
  const auto a = compiled.evaluate(Order::kFirst, x), b = interpreted.evaluate(Order::kFirst, x);
  EXPECT_TRUE(same_bits(a.y, b.y));
  EXPECT_TRUE(same_bits(a.jacobian, b.jacobian));
}

INSTANTIATE_TEST_SUITE_P(
    Of, ToFifthOrder,
    ::testing::Values(
        Known{"root_of_a_square", [](const AD& x) { return sqrt(x * x); }, 0.5, {0.5, 1, 0, 0, 0, 0}},
        Known{"broken_power",
              [](const AD& x) { return pow(x, 2.5); },
              1,
              {1, 2.5, 3.75, 1.875, -0.9375, 1.40625}},
        Known{"fifth_power", [](const AD& x) { return pow(x, 5.0); }, 2, {32, 80, 160, 240, 240, 120}},
        Known{"reciprocal", [](const AD& x) { return 1 / x; }, 2, {0.5, -0.25, 0.25, -0.375, 0.75, -1.875}},
        Known{"logarithm", [](const AD& x) { return log(x); }, 1, {0, 1, -1, 2, -6, 24}},
        Known{"tanh", [](const AD& x) { return tanh(x); }, 0, {0, 1, 0, -2, 0, 16}},
        Known{"bell", [](const AD& x) { return exp(-x * x); }, 0, {1, 0, -2, 0, 12, 0}},
        Known{"atan", [](const AD& x) { return atan(x); }, 0, {0, 1, 0, -2, 0, 24}},
        Known{"erf_slope",
              [](const AD& x) { return erf(x) * (std::sqrt(std::acos(-1.0)) / 2); },
              0,
              {0, 1, 0, -2, 0, 12}},
        Known{"sine_over_angle",
              [](const AD& z) { return dynamics::stumpff<1>(z); },
              0,
              {1, -1 / 6.0, 1 / 60.0, -1 / 840.0, 1 / 15120.0, -1 / 332640.0}}),
    [](const auto& info) { return info.param.name; });

// 29, 39 | naive: a power whose exponent is a parameter is specialised to the exponent while recording | holds:
// recorded at p = 0, it is x^p with both derivatives at p = 2, 1, 0.5, -1 and 0 | routes: interpreter, C at -O0 and
// at -O3
TEST(Parameters, ThatArePowersAreNotThoseOfTheRecording) {
  RecordOptions at_zero;
  at_zero.parameters = {0};
  const Function f = record(
      "power", 1, 1,
      [](const VectorXad& x, const VectorXad& p) { return VectorXad::Constant(1, pow(x[0], p[0])); },
      at_zero);
  std::vector<CompiledFunction> routes;
  CodegenOptions options{.order = Order::kSecond, .route = Route::kInterpreter, .use_cache = false};
  routes.push_back(CompiledFunction::make(f, options));
  options.route = Route::kCompiled;
  for (const char* level : {"-O0", "-O3"}) {
    options.flags = {level};
    routes.push_back(CompiledFunction::make(f, options));
  }
  for (const CompiledFunction& route : routes) {
    for (const double p : {2.0, 1.0, 0.5, -1.0, 0.0}) {
      const double x = 1.7;
      const auto got = route.evaluate(Order::kSecond, {x}, {p}, {1});
      EXPECT_NEAR(got.y[0], std::pow(x, p), 1e-15 * std::pow(x, p)) << p;
      EXPECT_NEAR(got.jacobian[0], p * std::pow(x, p - 1), 1e-15) << p;
      EXPECT_NEAR(got.hessian[0], p * (p - 1) * std::pow(x, p - 2), 1e-14) << p;
    }
    const auto at_origin = route.evaluate(Order::kSecond, {0}, {2}, {1});
    EXPECT_EQ(at_origin.jacobian[0], 0);
    EXPECT_EQ(at_origin.hessian[0], 2);
  }
}

// 36 | naive: derivatives of atan2 branch on signs and zeros: no lanes, no constant time | holds: value and Jacobian
// of atan2 hold no comparison and no selection, and nothing is guarded | routes: graph
TEST(WithoutBranches, Atan2AndItsSlopesCompareNothing) {
  const auto kinds = [](const Function& f) {
    std::set<Op> names;
    for (const auto& [op, count] : count_operations(derive(f, Order::kFirst).function)) names.insert(op);
    return names;
  };
  const Function angle =
      record("angle", 2, [](const VectorXad& x) { return VectorXad::Constant(1, atan2(x[0], x[1])); });
  for (const Op kind : {Op::Select, Op::Lt, Op::Le, Op::Eq, Op::Ne, Op::Min, Op::Max, Op::Sign})
    EXPECT_EQ(kinds(angle).count(kind), 0u) << static_cast<int>(kind);
  EXPECT_TRUE(angle.guards.empty());
}

}  // namespace
}  // namespace dyntape::testing::tape_hard_test
