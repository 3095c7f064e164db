// SPDX-License-Identifier: BSD-3-Clause
//
// Selections and guards (hard cases 47-64 that are not in tests/hard/edge_cases.cpp).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <dyntape/autodiff/record/record.h>

#include "dense.h"

namespace dyntape::testing::branches_test {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

VectorXad one(const AD& y) { return VectorXad::Constant(1, y); }

// Case 50, 51: every operator makes something not finite in the branch that is not taken.  Values, first,
// second and third derivatives of the selection are those of the branch that is.
TEST(Branches, Case50_NothingOfADeadBranchIsLeft) {
  for (int i = 0; i < kTableOps; ++i) {
    const auto op = static_cast<Op>(i);
    for (double bad : {0.0, 1.0, -1.0, -2.0, kInf, -kInf, kNan, 1e308}) {
      SCOPED_TRACE(std::string(info(op).name) + " of " + std::to_string(bad));
      Function f;
      f.inputs[0] = 2;
      const NodeId x = f.graph.input(Block::kVariables, 0), live = f.graph.input(Block::kVariables, 1);
      // Twice through the operator, so that poles meet poles.
      const int n = info(op).arity;
      const auto apply = [&](NodeId a) {
        return f.graph.make(op, a, n > 1 ? a : kNoNode, n > 2 ? a : kNoNode);
      };
      const NodeId dead = f.graph.make(Op::Mul, apply(x), apply(apply(x)));
      const NodeId taken = f.graph.make(Op::Mul, live, f.graph.make(Op::Mul, live, live));
      const NodeId condition = f.graph.make(Op::Lt, f.graph.constant(0), live);
      f.outputs = {f.graph.make(Op::Select, condition, taken, dead)};
      const std::vector<double> at = {bad, 2};
      EXPECT_EQ(evaluate(f, at)[0], 8);
      EXPECT_EQ(evaluate(vjp(f), at, {}, {1}), (std::vector<double>{0, 12}));
      EXPECT_EQ(evaluate(jvp(f), at, {}, {1, 1}), std::vector<double>{12});
      EXPECT_EQ(jacobian(f, at), (Eigen::MatrixXd(1, 2) << 0, 12).finished());
      EXPECT_EQ(hessian(f, at, {1}), (Eigen::MatrixXd(2, 2) << 0, 0, 0, 12).finished());
      EXPECT_EQ(evaluate(jvp(vjp(f)), at, {}, {1, 1, 1}), (std::vector<double>{0, 12}));
      EXPECT_EQ(evaluate(vjp(jvp(f)), at, {}, {1, 1, 1}), (std::vector<double>{0, 12}));
      EXPECT_EQ(evaluate(vjp(jvp(vjp(f))), at, {}, {1, 1, 1, 1, 1}), (std::vector<double>{0, 6}));
    }
  }
}

TEST(Branches, Case54_NestedThreeDeepWithSharedParts) {
  const auto body = [](const auto& x, const auto& y) {
    const auto shared = sqrt(x);  // used in a branch of each depth, and outside behind a selection
    const auto inner = select(y > 2.0, shared * y, shared + y);
    const auto middle = select(y > 1.0, inner * shared, 1.0 / x);
    return select(x > 0.0, middle + shared, y * y) + select(x > 0.0, shared, -x);
  };
  const Function f = record("nested", 2, [&](const VectorXad& v) { return one(body(v[0], v[1])); });
  EXPECT_EQ(evaluate(f, {0, 3})[0], 9);
  EXPECT_EQ(jacobian(f, {0, 3}), (Eigen::MatrixXd(1, 2) << -1, 6).finished());
  EXPECT_EQ(hessian(f, {0, 3}, {1}), (Eigen::MatrixXd(2, 2) << 0, 0, 0, 2).finished());
  // sqrt(x) (sqrt(x) y) + 2 sqrt(x) at (4, 3)
  EXPECT_EQ(evaluate(f, {4, 3})[0], 16);
  EXPECT_LE((jacobian(f, {4, 3}) - (Eigen::MatrixXd(1, 2) << 3.5, 4).finished()).norm(), 1e-14);
}

TEST(Branches, Case56_EqualBranchesCollapseAndEqualSelectionsMerge) {
  const Function f = record("collapse", 2, [](const VectorXad& x) {
    VectorXad y(4);
    y << select(x[0] < x[1], x[0] * x[1], x[1] * x[0]), select(AD(1) < AD(2), x[0], x[1]),
        select(x[0] < 0, x[0], x[1]), select(0 > x[0], x[0], x[1]);
    return y;
  });
  std::size_t selections = 0;
  for (const Node& node : f.graph.nodes()) selections += node.op == Op::Select;
  EXPECT_EQ(selections, 1u);
  EXPECT_EQ(f.outputs[1], 0u);
  EXPECT_EQ(f.outputs[2], f.outputs[3]);
}

TEST(Branches, Case57_ConstantsThatAreNotFiniteStayInTheirBranch) {
  const Function f = record("constants", 1, [](const VectorXad& x) {
    return one(select(x[0] > 0, x[0], AD(1.0) / AD(0.0)) + select(x[0] < 0, AD(std::nan("")), x[0]));
  });
  EXPECT_EQ(evaluate(f, {2})[0], 4);
  EXPECT_EQ(jacobian(f, {2})(0, 0), 2);
}

TEST(Branches, Case58_AParameterFlipsTheBranchWithoutANewRecording) {
  const Function f = record("flip", 1, 1, [](const VectorXad& x, const VectorXad& p) {
    return one(select(p[0] > 0, x[0] * x[0], -x[0]));
  });
  EXPECT_TRUE(f.guards.empty());
  EXPECT_EQ(evaluate(f, {3}, {1})[0], 9);
  EXPECT_EQ(evaluate(f, {3}, {-1})[0], -3);
  EXPECT_EQ(jacobian(f, {3}, {1})(0, 0), 6);
  EXPECT_EQ(jacobian(f, {3}, {-1})(0, 0), -1);
}

TEST(Branches, ConditionsCombineWithoutGuards) {
  const Function f = record("logic", 2, [&](const VectorXad& x) {
    VectorXad y(4);
    y << select(x[0] > 0 && x[1] > 0, 1, 0), select(x[0] > 0 || x[1] > 0, 1, 0), select(!(x[0] > 0), 1, 0),
        select(x[0] != x[1], 1, 0);
    return y;
  });
  EXPECT_TRUE(f.guards.empty());
  for (double a : {-1.0, 0.0, 1.0}) {
    for (double b : {-1.0, 0.0, 1.0}) {
      const bool p = a > 0, q = b > 0;
      const std::vector<double> expected = {double(p && q), double(p || q), double(!p), double(a != b)};
      EXPECT_EQ(evaluate(f, {a, b}), expected) << a << " " << b;
    }
  }
}

// With a plain bool && and || are the language's: what they need not evaluate is not there to be evaluated.
TEST(Branches, ConditionsWithPlainBoolsShortCircuit) {
  struct Limit {
    double upper;
  };
  for (const bool limited : {false, true}) {
    const Limit at_two{2};
    const Limit* limit = limited ? &at_two : nullptr;
    int read = 0;
    const auto entry = [&](const VectorXad& x, int i) { return ++read, x[i]; };  // asserts i < 3
    const Function f = record("bounded", 3, [&](const VectorXad& x) {
      AD y = x[0];
      if (limit && x[0] > limit->upper) y = limit->upper;
      if (!limit || x[0] <= limit->upper) y = 2 * y;
      int i = 0;
      while (i < 3 && entry(x, i) > 0.0) y += x[i++];
      for (i = 3; i == 3 || entry(x, i) < 0.0; --i) y += 1;
      return one(y);
    });
    EXPECT_EQ(read, 4);
    EXPECT_EQ(f.guards.size(), limited ? 6u : 4u);
    EXPECT_EQ(evaluate(f, {1, 2, 3})[0], 9);
    EXPECT_THROW(evaluate(f, {1, -2, 3}), GuardViolation);
  }
}

TEST(Branches, AConditionBehindAFlagCanBeSelectedWithoutAGuard) {
  for (const bool flag : {false, true}) {
    const Function f = record("flagged", 1, [&](const VectorXad& x) {
      return one(flag ? select(x[0] > 0, x[0], 2 * x[0]) : 2 * x[0]);
    });
    EXPECT_TRUE(f.guards.empty());
    EXPECT_EQ(evaluate(f, {3})[0], flag ? 3 : 6);
  }
}

// --- guards ---

TEST(Guards, Case60_LeavingTheRecordedBranchIsAnErrorWithThePlace) {
  RecordOptions options;
  options.variables = {2};
  int line = 0;
  const Function f = record(
      "branch", 1,
      [&](const VectorXad& x) {
        line = __LINE__ + 1;
        return one(x[0] > 1 ? x[0] * x[0] : x[0]);
      },
      options);
  ASSERT_EQ(f.guards.size(), 1u);
  EXPECT_EQ(f.guards[0].line, line);
  EXPECT_EQ(evaluate(f, {3})[0], 9);
  try {
    evaluate(f, {0.5});
    FAIL();
  } catch (const GuardViolation& e) {
    const std::string what = e.what();
    EXPECT_NE(what.find("branches_test.cpp:" + std::to_string(line)), std::string::npos) << what;
    EXPECT_NE(what.find("\"branch\""), std::string::npos) << what;
  }
  // Guards survive every derivation.
  for (const Function& g : {jvp(f), vjp(f), derive(f, Order::kSecond).function, jvp(vjp(f))}) {
    EXPECT_EQ(g.guards.size(), 1u);
    EXPECT_THROW(evaluate(g, {0.5}, {}, std::vector<double>(g.n_w(), 1.0)), GuardViolation);
  }
}

TEST(Guards, Case61_OnlyRecordedOperandsAreGuarded) {
  const Function f = record("operands", 1, 1, [](const VectorXad& x, const VectorXad& p) {
    const AD constant = 3;
    AD y = constant > 2 ? x[0] : -x[0];  // constants: none
    y = x[0] * 0.0 < 1 ? y : -y;         // folded to a constant: none
    y = p[0] > 0 ? y : -y;               // a parameter: one
    return one(y);
  });
  ASSERT_EQ(f.guards.size(), 1u);
  EXPECT_THROW(evaluate(f, {1}, {-1}), GuardViolation);
}

TEST(Guards, Case63_StandardAlgorithmsAreGuarded) {
  const Function max = record("max", 2, [](const VectorXad& x) { return one(std::max(x[0], x[1])); });
  EXPECT_EQ(max.guards.size(), 1u);
  const Function sort = record("sort", 3, [](const VectorXad& x) {
    VectorXad y = x;
    std::sort(y.begin(), y.end());
    return y;
  });
  EXPECT_FALSE(sort.guards.empty());
  EXPECT_THROW(evaluate(sort, {3, 2, 1}), GuardViolation);
}

TEST(Guards, Case64_ALoopToConvergenceIsGuardedOncePerIteration) {
  RecordOptions options;
  options.variables = {2};
  const Function f = record(
      "newton", 1,
      [](const VectorXad& x) {
        AD root = 1;
        while (abs(root * root - x[0]) > 1e-12) root = 0.5 * (root + x[0] / root);
        return one(root);
      },
      options);
  EXPECT_EQ(f.guards.size(), 6u);  // five steps and the end
  EXPECT_NEAR(evaluate(f, {2.0001})[0], std::sqrt(2.0001), 1e-12);
  EXPECT_THROW(evaluate(f, {900}), GuardViolation);
}

TEST(Guards, TheSameComparisonIsGuardedOnce) {
  const Function f = record("repeat", 1, [](const VectorXad& x) {
    AD y = x[0];
    for (int i = 0; i < 1000; ++i) {
      if (x[0] > -100) y += 1;
    }
    return one(y);
  });
  EXPECT_EQ(f.guards.size(), 1u);
}

TEST(Guards, AreAnErrorOnRequest) {
  RecordOptions options;
  options.branches = RecordOptions::Branches::kError;
  try {
    record(
        "strict", 1, [](const VectorXad& x) { return one(x[0] > 0 ? x[0] : -x[0]); }, options);
    FAIL();
  } catch (const RecordingError& e) {
    EXPECT_NE(std::string(e.what()).find("branches_test.cpp:"), std::string::npos) << e.what();
  }
}

TEST(Guards, BindingDropsWhatThenAlwaysHoldsAndKeepsWhatIsViolated) {
  const Function f = record(
      "bound", 1, 1, [](const VectorXad& x, const VectorXad& p) { return one(p[0] > 0 ? x[0] : -x[0]); });
  EXPECT_TRUE(bind(f, Block::kParameters, {{0, 5.0}}).guards.empty());
  EXPECT_THROW(evaluate(bind(f, Block::kParameters, {{0, -5.0}}), {1}), GuardViolation);
}

TEST(Guards, ComparisonsWithNumbersOfEveryType) {
  const Function f = record("types", 1, [](const VectorXad& x) {
    VectorXad y(5);
    y << select(x[0] > 1, 1, 0), select(x[0] > 1.0f, 1, 0), select(x[0] > 1u, 1, 0),
        select(std::size_t(1) < x[0], 1, 0), select(1L <= x[0], 1, 0);
    return y;
  });
  EXPECT_EQ(evaluate(f, {2}), std::vector<double>(5, 1.0));
  EXPECT_EQ(evaluate(f, {0}), std::vector<double>(5, 0.0));
}

}  // namespace
}  // namespace dyntape::testing::branches_test
