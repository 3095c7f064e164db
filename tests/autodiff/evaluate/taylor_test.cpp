// SPDX-License-Identifier: BSD-3-Clause
// Series of every row of the table: against derivatives of derivatives, and reverse against jets of forward.
#include <gtest/gtest.h>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/evaluate/taylor.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/autodiff/scalars/jet.h>

#include "autodiff/random_program.h"

namespace dyntape::taylor_test {
namespace {

using S = Series<double>;

constexpr std::size_t kOrder = 5;

class RowInSeries : public ::testing::TestWithParam<int> {
 protected:
  Op op() const { return static_cast<Op>(GetParam()); }
  std::size_t arity() const { return static_cast<std::size_t>(info(op()).arity); }
  double point(std::size_t i) const {
    const double lo = info(op()).lo, hi = info(op()).hi;
    return lo + (hi - lo) * (0.37 + 0.21 * static_cast<double>(i));
  }
  // Along x + d t + e t^2.
  static double direction(std::size_t i) { return 0.4 - 0.3 * static_cast<double>(i); }
  static double bend(std::size_t i) { return 0.1 + 0.05 * static_cast<double>(i); }

  std::shared_ptr<const Function> function() const {
    Function f;
    f.name = "row";
    f.inputs = {arity(), 0, 0};
    NodeId arguments[3] = {kNoNode, kNoNode, kNoNode};
    for (std::size_t i = 0; i < arity(); ++i)
      arguments[i] = f.graph.input(Block::kVariables, static_cast<std::uint32_t>(i));
    f.outputs = {f.graph.make(op(), arguments[0], arguments[1], arguments[2])};
    return std::make_shared<const Function>(std::move(f));
  }
  // The row of those arguments as a function of t.
  Function of_time() const {
    Function f;
    f.name = "row_of_t";
    f.inputs = {1, 0, 0};
    Graph& g = f.graph;
    const NodeId t = g.input(Block::kVariables, 0);
    NodeId arguments[3] = {kNoNode, kNoNode, kNoNode};
    for (std::size_t i = 0; i < arity(); ++i) {
      const NodeId linear = g.make(Op::Mul, t, g.constant(direction(i)));
      const NodeId square = g.make(Op::Mul, g.make(Op::Mul, t, t), g.constant(bend(i)));
      arguments[i] = g.make(Op::Add, g.make(Op::Add, g.constant(point(i)), linear), square);
    }
    f.outputs = {g.make(op(), arguments[0], arguments[1], arguments[2])};
    return f;
  }
};

TEST_P(RowInSeries, AgreesWithDerivativesOfDerivatives) {
  std::vector<S> x;
  for (std::size_t i = 0; i < arity(); ++i) {
    x.push_back(S::zeros(kOrder + 1));
    x[i][0] = point(i), x[i][1] = direction(i), x[i][2] = bend(i);
  }
  Taylor<double> run(function());
  run.forward(x);
  Function f = of_time();
  double factorial = 1;
  for (std::size_t k = 0; k <= kOrder; ++k) {
    if (k > 0) factorial *= static_cast<double>(k);
    const double expected = evaluate(f, {0.0}, {}, {})[0] / factorial;
    EXPECT_NEAR(run.output(0).at(k), expected, 1e-10 * (1 + std::abs(expected))) << "order " << k;
    f = bind(jvp(f), Block::kWeights, {{0, 1.0}});
  }
}

// Reverse of each order against jets that perturb each coefficient of each argument.
TEST_P(RowInSeries, ReverseIsTheTransposeOfForward) {
  using Dual = Jet<double, 1>;
  const auto f = function();
  for (std::size_t q = 0; q <= kOrder; ++q) {
    std::vector<S> x;
    for (std::size_t i = 0; i < arity(); ++i) {
      x.push_back(S::zeros(q + 1));
      for (std::size_t k = 0; k <= q; ++k)
        x[i][k] = k == 0 ? point(i) : direction(i) / static_cast<double>(k);
    }
    Taylor<double> run(f);
    run.forward(x);
    S weights = S::zeros(q + 1);  // of y's coefficients from the highest down
    for (std::size_t k = 0; k <= q; ++k) weights[k] = 1 + 0.5 * static_cast<double>(k);
    const auto adjoints = run.reverse({weights});
    if (q == 0) {
      std::vector<double> numbers;
      for (const S& series : x) numbers.push_back(series[0]);
      Taylor<double> at_point(f);
      at_point.forward_at(numbers);
      EXPECT_EQ(at_point.output(0)[0], run.output(0)[0]);
      const auto slopes = at_point.reverse({weights});
      for (std::size_t i = 0; i < arity(); ++i)
        EXPECT_EQ(slopes[i].at(0), adjoints[i].at(0)) << "argument " << i;
    }
    for (std::size_t i = 0; i < arity(); ++i) {
      for (std::size_t k = 0; k <= q; ++k) {
        std::vector<Series<Dual>> dual;
        for (std::size_t j = 0; j < arity(); ++j) {
          dual.push_back(Series<Dual>::zeros(q + 1));
          for (std::size_t l = 0; l <= q; ++l)
            dual[j][l] = j == i && l == k ? Dual::variable(x[j][l], 0) : Dual(x[j][l]);
        }
        Taylor<Dual> perturbed(f);
        perturbed.forward(dual);
        double expected = 0;
        for (std::size_t l = 0; l <= q; ++l)
          expected += weights[q - l] * perturbed.output(0).at(l).tangent(0);
        EXPECT_NEAR(adjoints[i].at(q - k), expected, 1e-9 * (1 + std::abs(expected)))
            << "order " << q << ", coefficient " << k << " of argument " << i;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Table, RowInSeries, ::testing::Range(0, kTableOps), [](const auto& row) {
  return std::string(dyntape::info(static_cast<Op>(row.param)).name);
});

TEST(Series, WhatDoesNotMoveMeetsNoInfinity) {
  const S still = S::of({0.0});
  EXPECT_EQ(sqrt(still).size(), 1u);
  EXPECT_EQ(log(still)[0], -HUGE_VAL);
  const S t = S::of({0.0, 1.0, 0.0});
  EXPECT_EQ((sqrt(still) + t)[1], 1);
}

TEST(Series, PowersWithAnExponentThatMovesCostNoMoreThanOthers) {
  S x = S::zeros(21), y = S::zeros(21);
  x[0] = 1, x[1] = 1, y[0] = 0, y[1] = 1;
  const S r = pow(x, y);  // (1 + t)^t
  EXPECT_NEAR(r[2], 1, 1e-14);
  EXPECT_NEAR(r[3], -0.5, 1e-14);
  EXPECT_NEAR(r[4], 5.0 / 6, 1e-13);
}

TEST(Taylor, FollowsCallsOfRecordedFunctions) {
  const auto square = recorded_callee(
      record("square", 1, [](const VectorXad& x) { return VectorXad::Constant(1, x[0] * x[0]); }));
  const Function f =
      record("twice", 1, [&](const VectorXad& x) -> VectorXad { return call(square, call(square, x)); });
  Taylor<double> run(std::make_shared<const Function>(f));
  run.forward({S::of({1, 1, 0, 0})});
  EXPECT_EQ(run.output(0)[1], 4);
  EXPECT_EQ(run.output(0)[2], 6);
  EXPECT_EQ(run.output(0)[3], 4);
  EXPECT_EQ(run.reverse({S::of({1})})[0].at(0), 4);
}

// Programs over every operator, with poles in branches that are not taken: values, Jacobians, weighted Hessians.
TEST(Taylor, RandomProgramsAgreeWithDerivation) {
  for (std::uint64_t seed = 7000; seed < 7200; ++seed) {
    testing::Random random(seed);
    const testing::Program program = testing::random_program(random, 10 + random.below(50));
    const auto f = std::make_shared<const Function>(testing::recorded(program));
    std::vector<double> w(f->n_y());
    for (double& weight : w) weight = random.uniform(-1, 1);
    const Derivatives derived = derive(*f, Order::kSecond);
    const std::vector<double> all = evaluate(derived.function, program.x, program.p, w);
    const double* const J = all.data() + f->n_y();
    const double* const H = J + derived.jacobian.nnz();
    std::vector<S> p, adjoints;
    for (double value : program.p) p.push_back(S::constant(value));
    for (double weight : w) adjoints.push_back(S::constant(weight));
    const auto close = [&](double got, double expected, const char* what) {
      EXPECT_NEAR(got, expected, 1e-9 * (1 + std::abs(expected))) << random.seed_text() << ", " << what;
    };
    Taylor<double> at_point(f);
    at_point.forward_at(program.x, program.p);
    for (std::size_t i = 0; i < f->n_y(); ++i) close(at_point.output(i)[0], all[i], "value");
    std::vector<double> slopes(f->n_x());
    for (std::size_t k = 0; k < derived.jacobian.nnz(); ++k)
      slopes[derived.jacobian.col[k]] += w[derived.jacobian.row[k]] * J[k];
    std::vector<S> moving;  // with weights for a coefficient that the values do not have
    for (double weight : w) moving.push_back(S::of({weight, 2 * weight}));
    const auto of_numbers = at_point.reverse(adjoints), of_moving = at_point.reverse(moving);
    for (std::size_t j = 0; j < f->n_x(); ++j) {
      close(of_numbers[j].at(0), slopes[j], "slopes at the point");
      close(of_moving[j].at(0), slopes[j], "slopes at the point, in series");
      close(of_moving[j].at(1), 2 * slopes[j], "slopes at the point, second coefficient");
    }
    for (std::size_t j = 0; j < f->n_x(); ++j) {
      std::vector<S> x;
      for (std::size_t i = 0; i < f->n_x(); ++i)
        x.push_back(i == j ? S::of({program.x[i], 1}) : S::constant(program.x[i]));
      Taylor<double> run(f);
      run.forward(x, p);
      const auto column = run.reverse(adjoints);
      for (std::size_t k = 0; k < derived.jacobian.nnz(); ++k) {
        if (derived.jacobian.col[k] == j) close(run.output(derived.jacobian.row[k]).at(1), J[k], "slope");
      }
      for (std::size_t k = 0; k < derived.hessian.nnz(); ++k) {
        if (derived.hessian.col[k] == j) close(column[derived.hessian.row[k]].at(1), H[k], "second order");
        if (derived.hessian.row[k] == j)
          close(column[derived.hessian.col[k]].at(1), H[k], "second order, transposed");
      }
    }
  }
}

}  // namespace
}  // namespace dyntape::taylor_test
