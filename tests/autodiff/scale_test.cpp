// SPDX-License-Identifier: BSD-3-Clause
//
// Long chains, wide sums, large patterns (hard cases 65-72, 92-94): the stack does not grow, the work is
// linear. Operation and node counts are asserted; times (of the processor) only where quadratic work would take
// seconds: four times the size may take seven times as long.
#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <functional>
#include <random>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/derive/sparsity.h>
#include <dyntape/autodiff/derive/sweep.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>

#include "dense.h"

namespace dyntape::testing::scale_test {
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

template <class Work>
double seconds_of(Work&& work) {
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

// Of f(n), the derivatives up to an order.
void expect_linear_derivation(std::size_t n, Order order, const std::function<Function(std::size_t)>& f) {
  const Function small = f(n / 4), large = f(n);
  const double some = seconds_of([&] { derive(small, order); });
  EXPECT_LT(seconds_of([&] { derive(large, order); }), 7 * some + 0.2) << large.name;
}

// v = sin(v) + start, n times.
AD long_chain(AD start, std::size_t n) {
  AD v = start;
  for (std::size_t i = 0; i < n; ++i) v = sin(v) + start;
  return v;
}

TEST(Scale, WhatOutputsShareIsNotSweptForEach) {
  const auto shared = [](std::size_t n, bool of_parameters) {
    return record("shared", n, 1, [&](const VectorXad& x, const VectorXad& p) {
      const AD v = long_chain(of_parameters ? p[0] : x[0], n);
      VectorXad y = x;
      for (AD& entry : y) entry *= v * entry;
      return y;
    });
  };
  for (Order order : {Order::kFirst, Order::kSecond}) {
    expect_linear_derivation(32000, order, [&](std::size_t n) { return shared(n, true); });
    expect_linear_derivation(32000, order, [&](std::size_t n) { return shared(n, false); });
  }
}

TEST(Scale, CallsAreNotClearedForEverySweep) {
  const auto callee =
      recorded_callee(record("product", 2, [](const VectorXad& x) { return one(x[0] * sin(x[1])); }));
  const auto calls = [&](std::size_t n) {
    return record("calls", n + 1, [&](const VectorXad& x) {
      VectorXad y(static_cast<Eigen::Index>(n));
      for (Eigen::Index i = 0; i < y.size(); ++i) y[i] = call(callee, VectorXad(x.segment(i, 2)))[0];
      return y;
    });
  };
  expect_linear_derivation(40000, Order::kFirst, calls);
  expect_linear_derivation(40000, Order::kSecond, calls);
}

// A dense row, rows that couple neighbours and, where there is one, a dense column with a long way to it.
Function arrow(std::size_t n, bool has_column) {
  return record("arrow", n, [&](const VectorXad& x) {
    const AD v = long_chain(x[0], has_column ? n : 0);
    VectorXad y(x.size());
    y[0] = 0;
    for (Eigen::Index i = 1; i < y.size(); ++i) {
      y[0] = y[0] + x[i] * x[i];
      y[i] = x[i - 1] * x[i] + (has_column ? v : AD(0));
    }
    return y;
  });
}

TEST(Scale, ADenseRowAmongCoupledRowsIsSweptApart) {
  for (const bool has_column : {false, true}) {
    expect_linear_derivation(20000, Order::kFirst, [&](std::size_t n) { return arrow(n, has_column); });
    expect_linear_derivation(20000, Order::kSecond, [&](std::size_t n) { return arrow(n, has_column); });
    const Derivatives d = derive(arrow(20000, has_column), Order::kFirst);  // larger than what is tried
    EXPECT_EQ(d.jacobian, jacobian_sparsity(arrow(20000, has_column)));
    const std::vector<double> y = evaluate(d.function, std::vector<double>(20000, 0.5));
    for (std::size_t k = 0; k < d.jacobian.nnz(); ++k) {
      if (d.jacobian.col[k] == 0) continue;
      ASSERT_EQ(y[20000 + k], d.jacobian.row[k] == 0 ? 1.0 : 0.5) << k;
    }
  }
}

TEST(Scale, ManyArrowsAreEachSweptApart) {
  expect_linear_derivation(60000, Order::kFirst, [](std::size_t n) {
    const auto length = static_cast<Eigen::Index>(n / 30);
    return record("arrows", n, [&](const VectorXad& x) {
      VectorXad y = VectorXad::Zero(x.size());
      for (Eigen::Index i = 0; i + 1 < y.size(); ++i) {
        if (i % length == length - 1) continue;
        y[i + 1] = x[i] * x[i + 1];
        y[i / length * length] = y[i / length * length] + x[i] * x[i];
      }
      return y;
    });
  });
}

TEST(Scale, DerivativesThatTakeTooMuchMemoryAreRefused) {
  Function f = record("dense", 30, [](const VectorXad& x) {
    VectorXad y(30);
    for (Eigen::Index i = 0; i < 30; ++i) y[i] = sin(x.sum() * static_cast<double>(i + 1));
    return y;
  });
  Sweep sweep(f.graph, Sweep::Variables::kFinite, 40);
  const auto sweep_rows = [&](NodeId count) {
    for (NodeId i = 0; i < count; ++i) sweep.reverse({f.outputs[i]}, {f.graph.constant(1)});
  };
  EXPECT_NO_THROW(sweep_rows(3));
  try {
    sweep_rows(30);
    FAIL();
  } catch (const RecordingError& error) {
    EXPECT_NE(std::string(error.what()).find("more than 40 further ones; derive fewer outputs"),
              std::string::npos)
        << error.what();
  }
}

// Sets of variables that are shared, overlap, or are too many to be listed: against one walk an output.
TEST(Scale, PatternsOfSharedValuesAreExact) {
  constexpr Eigen::Index n = 400;  // more than a few sweeps of 64
  std::mt19937 random(7);
  std::vector<std::vector<std::uint32_t>> expected;
  const Function f = record("pattern", n, [&](const VectorXad& x) {
    std::vector<AD> values(x.begin(), x.end());
    std::vector<std::vector<bool>> sets;
    for (Eigen::Index i = 0; i < n; ++i)
      sets.emplace_back(n, false), sets.back()[static_cast<std::size_t>(i)] = true;
    for (int k = 0; k < 3000; ++k) {
      const std::size_t a = random() % values.size(), b = values.size() - 1 - random() % 300;
      values.push_back(values[a] * sin(values[b]));
      sets.push_back(sets[a]);
      for (std::size_t j = 0; j < n; ++j) sets.back()[j] = sets[a][j] || sets[b][j];
    }
    VectorXad y(1000);
    for (AD& entry : y) {
      const std::size_t k = random() % values.size();
      entry = values[k];
      expected.emplace_back();
      for (std::uint32_t j = 0; j < n; ++j)
        if (sets[k][j]) expected.back().push_back(j);
    }
    return y;
  });
  EXPECT_EQ(jacobian_sparsity(f), pattern_from_rows(expected, n));
}

}  // namespace
}  // namespace dyntape::testing::scale_test
