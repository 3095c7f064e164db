// SPDX-License-Identifier: BSD-3-Clause
//
// The edge cases in generated C at -O0 and at -O3: the same bits as the interpreter, whose results
// elementary_test.cpp holds to what is known by hand.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <span>

#include <dyntape/codegen/compiled_function.h>

#include "edge_cases.h"

namespace dyntape::testing::elementary_codegen_test {
namespace {

// All cases side by side: each with variables and an output of its own, so that one library holds them.
struct AllCases {
  std::vector<EdgeCase> cases = edge_cases();
  std::vector<double> x;
  Function function;

  AllCases() {
    for (const EdgeCase& c : cases) x.insert(x.end(), c.x.begin(), c.x.end());
    function = record("edges", x.size(), [this](const VectorXad& v) {
      VectorXad y(static_cast<Eigen::Index>(cases.size()));
      Eigen::Index first = 0;
      for (std::size_t i = 0; i < cases.size(); ++i) {
        const auto n = static_cast<Eigen::Index>(cases[i].x.size());
        y[static_cast<Eigen::Index>(i)] = cases[i].f(v.segment(first, n));
        first += n;
      }
      return y;
    });
  }
  // The case that variable i belongs to.
  const std::string& name_of_variable(std::size_t i) const {
    for (const EdgeCase& c : cases) {
      if (i < c.x.size()) return c.name;
      i -= c.x.size();
    }
    return cases.back().name;
  }
};

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

class GeneratedEdges : public ::testing::TestWithParam<const char*> {};

// 5, 47, 57, 106, 109, H19 | naive: a compiler is free with NaN, infinities and branches | holds: all edges with
// their derivatives and curvatures have the bits of the interpreter | routes: C at -O0 and at -O3
TEST_P(GeneratedEdges, HaveTheInterpretersBits) {
  const AllCases all;
  const std::vector<double> weights(all.cases.size(), 1.0);
  const Derivatives d = derive(all.function, Order::kSecond);
  const std::vector<double> expected = evaluate(d.function, all.x, {}, weights);

  CodegenOptions options;
  options.order = Order::kSecond;
  options.route = Route::kCompiled;
  options.use_cache = false;
  options.flags = {GetParam()};
  const CompiledFunction f = CompiledFunction::make(all.function, options);
  ASSERT_EQ(f.jacobian_pattern(), d.jacobian);
  ASSERT_EQ(f.hessian_pattern(), d.hessian);
  const CompiledFunction::Evaluation got = f.evaluate(Order::kSecond, all.x, {}, weights);
  for (std::size_t i = 0; i < d.n_y; ++i) {
    EXPECT_TRUE(same_bits(got.y[i], expected[i]))
        << all.cases[i].name << ": " << got.y[i] << " and " << expected[i];
  }
  for (std::size_t k = 0; k < d.jacobian.nnz(); ++k) {
    EXPECT_TRUE(same_bits(got.jacobian[k], expected[d.n_y + k]))
        << all.cases[d.jacobian.row[k]].name << ", slope: " << got.jacobian[k] << " and "
        << expected[d.n_y + k];
  }
  for (std::size_t k = 0; k < d.hessian.nnz(); ++k) {
    const double e = expected[d.n_y + d.jacobian.nnz() + k];
    EXPECT_TRUE(same_bits(got.hessian[k], e))
        << all.name_of_variable(d.hessian.row[k]) << ", curvature: " << got.hessian[k] << " and " << e;
  }
}

// 59, 118 | naive: a NaN in one lane, or a branch, decides for its neighbours | holds: hard and harmless points side
// by side have the bits of the interpreter | routes: lanes of C
TEST(EdgesInLanes, HaveTheInterpretersBits) {
  const AllCases all;
  constexpr std::size_t kPoints = 11;
  const std::size_t n = all.x.size(), m = all.cases.size();
  const Derivatives d = derive(all.function, Order::kFirst);
  CodegenOptions options{
      .order = Order::kFirst, .route = Route::kCompiled, .lanes = Lanes::kNative, .use_cache = false};
  options.flags = {"-O3"};
  const CompiledFunction f = CompiledFunction::make(all.function, options);
  std::vector<double> x, y(kPoints * m), J(kPoints * d.jacobian.nnz());
  for (std::size_t k = 0; k < kPoints; ++k) {
    for (std::size_t i = 0; i < n; ++i) x.push_back(k % 3 == 1 ? 0.5 + 0.001 * double(i) : all.x[i]);
  }
  CompiledFunction::Workspace workspace(f);
  ASSERT_FALSE(f.run(Order::kFirst, {.count = kPoints, .x = x.data(), .y = y.data(), .jacobian = J.data()},
                     workspace));
  for (std::size_t k = 0; k < kPoints; ++k) {
    const std::vector<double> expected = evaluate(d.function, std::span(x).subspan(k * n, n));
    for (std::size_t i = 0; i < m; ++i)
      EXPECT_TRUE(same_bits(y[k * m + i], expected[i])) << all.cases[i].name << ", point " << k;
    for (std::size_t i = 0; i < d.jacobian.nnz(); ++i)
      EXPECT_TRUE(same_bits(J[k * d.jacobian.nnz() + i], expected[m + i]))
          << all.cases[d.jacobian.row[i]].name << ", slope, point " << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Levels, GeneratedEdges, ::testing::Values("-O0", "-O3"),
                         [](const auto& level) { return std::string(level.param).substr(1); });

}  // namespace
}  // namespace dyntape::testing::elementary_codegen_test
