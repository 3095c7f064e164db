// SPDX-License-Identifier: BSD-3-Clause
//
// Long chains, wide sums, large patterns (hard cases 65-72, 92-94): the stack does not grow, the work is
// linear. Times are not asserted (machines differ); operation and node counts are.
#include <gtest/gtest.h>

#include <cmath>

#include <dyntape/autodiff/record.h>
#include <dyntape/autodiff/sparsity.h>

#include "dense.h"

namespace dyntape::testing {
namespace {

VectorXad one(const AD& y) { return VectorXad::Constant(1, y); }

TEST(Scale, Case65_AChainOfAMillionSteps) {
  constexpr int kSteps = 1000000;
  const Function f = record("chain", 2, [](const VectorXad& x) {
    AD v = x[0];
    for (int i = 0; i < kSteps; ++i) v = 0.999999 * v + x[1];
    return one(v);
  });
  EXPECT_EQ(f.graph.size(), 2u * kSteps + 3);
  const Derivatives d = derive(f, Order::kFirst);
  EXPECT_LE(d.function.graph.size(), 3u * f.graph.size());
  const std::vector<double> y = evaluate(d.function, {0.5, 1e-6});
  const double power = std::pow(0.999999, kSteps);
  EXPECT_NEAR(y[1], power, 1e-10);
  EXPECT_NEAR(y[2], (1 - power) / 1e-6, 1e-10 * y[2]);
  EXPECT_LT(f.graph.bytes(),
            20u * f.graph.size());  // without a look-up table, which a recorded function has no use for
}

TEST(Scale, ANonlinearChainToSecondOrder) {
  constexpr int kSteps = 50000;
  const Function f = record("map", 1, [](const VectorXad& x) {
    AD v = x[0];
    for (int i = 0; i < kSteps; ++i) v = sin(v) + 1e-3 * x[0];
    return one(v);
  });
  const Derivatives d = derive(f, Order::kSecond);
  EXPECT_LT(d.function.graph.size(), 12 * f.graph.size());
  EXPECT_TRUE(std::isfinite(evaluate(d.function, {0.5}, {}, {1}).back()));
}

TEST(Scale, Case67_DoublingSharesInsteadOfGrowing) {
  const Function f = record("doubling", 2, [](const VectorXad& x) {
    AD before = x[0], v = x[1];
    for (int i = 0; i < 60; ++i) {
      const AD next = v * v * 0.25 + before;
      before = v;
      v = next;
    }
    return one(v);
  });
  EXPECT_LT(total_operations(f), 200u);
  EXPECT_LT(total_operations(derive(f, Order::kSecond).function), 2500u);
}

TEST(Scale, Case68_AMillionTermsAndAMillionUses) {
  constexpr int kTerms = 1000000;
  const Function f = record("sum", 1, [](const VectorXad& x) {
    AD sum = 0;
    for (int i = 1; i <= kTerms; ++i) sum += x[0] * static_cast<double>(i);  // a million users of one input
    return one(sum);
  });
  EXPECT_EQ(jacobian_sparsity(f).nnz(), 1u);
  EXPECT_EQ(evaluate(vjp(f), {1}, {}, {1})[0], 0.5 * kTerms * (kTerms + 1.0));
}

TEST(Scale, Case69_AHundredThousandInputs) {
  constexpr std::size_t n = 100000;
  const Function f = record("squares", n, [](const VectorXad& x) {
    AD sum = 0;
    for (const AD& t : x) sum += t * t;
    return one(sum);
  });
  const SparseFunction h = sparse_hessian(f);
  EXPECT_EQ(h.pattern.nnz(), n);
  EXPECT_EQ(h.pattern.row, h.pattern.col);
  EXPECT_EQ(total_operations(h.function), 1u);  // 2 l, for all
  EXPECT_EQ(evaluate(h.function, std::vector<double>(n, 1.0), {}, {1.5}), std::vector<double>(n, 3.0));
}

TEST(Scale, Case70_DuplicatesAreFound) {
  const Function f = record("duplicates", 2, [](const VectorXad& x) {
    AD sum = 0;
    for (int i = 0; i < 100000; ++i) sum = sum + sin(x[0] * x[1]) * cos(x[1] * x[0]) - sum;
    return one(sum);
  });
  std::size_t sines = 0;
  for (const Node& node : f.graph.nodes()) sines += node.op == Op::Sin || node.op == Op::Cos;
  EXPECT_EQ(sines, 2u);
}

TEST(Scale, Case71_TheOrderOfASumIsKept) {
  std::vector<double> x(1 << 12);
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = std::sin(static_cast<double>(i)) * std::exp2(static_cast<double>(i % 40));
  const auto left = [](auto v) {
    auto sum = v[0];
    for (std::size_t i = 1; i < v.size(); ++i) sum = sum + v[i];
    return sum;
  };
  const auto balanced = [](auto v) {
    for (; v.size() > 1; v.resize(v.size() / 2)) {
      for (std::size_t i = 0; i < v.size() / 2; ++i) v[i] = v[2 * i] + v[2 * i + 1];
    }
    return v[0];
  };
  const auto check = [&](auto sum) {
    const Function f = record(
        "sum", x.size(), [&](const VectorXad& v) { return one(sum(std::vector<AD>(v.begin(), v.end()))); });
    EXPECT_EQ(evaluate(f, x)[0], sum(x));
  };
  check(left);
  check(balanced);
}

TEST(Scale, Case72_AMillionOutputs) {
  constexpr std::size_t n = 1000000;
  const Derivatives d = derive(record("identity", n, [](const VectorXad& x) { return x; }), Order::kFirst);
  EXPECT_EQ(d.jacobian.nnz(), n);
  EXPECT_EQ(d.jacobian.row, d.jacobian.col);
  EXPECT_EQ(total_operations(d.function), 0u);
}

// Operations that the weighted Hessian takes, per input.
template <class F>
double hessian_operations(std::size_t n, F f) {
  const SparseFunction h = sparse_hessian(record("f", n, [&](const VectorXad& x) { return one(f(x)); }));
  return static_cast<double>(total_operations(h.function)) / static_cast<double>(n);
}

TEST(Scale, Case92_AnArrowHessianIsLinear) {
  const auto arrow = [](const VectorXad& x) {
    AD sum = 0;
    for (Eigen::Index i = 1; i < x.size(); ++i) sum += sin(x[0] * x[i]) + x[i] * x[i];
    return sum;
  };
  const double small = hessian_operations(100, arrow), large = hessian_operations(10000, arrow);
  EXPECT_LT(large, 1.1 * small);
  const SparseFunction h =
      sparse_hessian(record("arrow", 10000, [&](const VectorXad& x) { return one(arrow(x)); }));
  EXPECT_EQ(h.pattern.nnz(), 2u * 10000 - 1);
}

TEST(Scale, Case94_BandedAndGridHessiansAreLinear) {
  const auto banded = [](const VectorXad& x) {
    AD sum = 0;
    for (Eigen::Index i = 2; i < x.size(); ++i) sum += exp(x[i] * x[i - 1] * x[i - 2]);
    return sum;
  };
  EXPECT_LT(hessian_operations(10000, banded), 1.1 * hessian_operations(100, banded));
  constexpr Eigen::Index side = 60;
  const SparseFunction h = sparse_hessian(record("grid", side * side, [](const VectorXad& x) {
    AD sum = 0;
    for (Eigen::Index i = 0; i < side; ++i) {
      for (Eigen::Index j = 0; j < side; ++j) {
        if (i + 1 < side) sum += cos(x[i * side + j] - x[(i + 1) * side + j]);
        if (j + 1 < side) sum += cos(x[i * side + j] - x[i * side + j + 1]);
      }
    }
    return one(sum);
  }));
  EXPECT_EQ(h.pattern.nnz(), std::size_t(side * side + 2 * side * (side - 1)));
}

}  // namespace
}  // namespace dyntape::testing
