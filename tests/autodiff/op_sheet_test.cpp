// SPDX-License-Identifier: BSD-3-Clause
//
// The sheet: every row of ops.def is held to what it claims.  A new row is tested without a line here.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/evaluate/interpret.h>

#include "quad.h"
#include "random.h"

namespace dyntape::testing::op_sheet_test {
namespace {

constexpr int kSamples = 60;
constexpr double kEps = std::numeric_limits<double>::epsilon();
// Slopes hold constants such as 2/sqrt(pi) to double precision; everything else is exact to 1e-20.
constexpr double kSlopeTolerance = 1e-15;

class OpSheet : public ::testing::TestWithParam<Op> {
 protected:
  Op op() const { return GetParam(); }
  int arity() const { return info(op()).arity; }
  std::vector<double> sample(Random& random) const {
    std::vector<double> x = random.vector(static_cast<std::size_t>(arity()), info(op()).lo, info(op()).hi);
    if (arity() == 3 && random.below(2)) x[0] = 0;  // the condition of a selection: both ways
    return x;
  }
  // The operator as a function of its arguments.
  Function function() const {
    Function f;
    f.name = info(op()).name;
    f.inputs[0] = static_cast<std::size_t>(arity());
    NodeId in[3] = {kNoNode, kNoNode, kNoNode};
    for (int i = 0; i < arity(); ++i) in[i] = f.graph.input(Block::kVariables, static_cast<std::uint32_t>(i));
    f.outputs = {f.graph.make(op(), in[0], in[1], in[2])};
    return f;
  }
};

template <class T>
T value(Op op, const std::vector<T>& in) {
  return evaluate<T>(op, in[0], in.size() > 1 ? in[1] : T(0), in.size() > 2 ? in[2] : T(0));
}

void expect_close(const Quad& got, const Quad& expected, double tolerance, const std::string& what) {
  EXPECT_LE(abs(got - expected), tolerance * (1 + abs(expected)))
      << what << ": got " << to_text(got, 20) << ", expected " << to_text(expected, 20);
}

std::string text(const std::vector<double>& x) {
  std::string s = "at (";
  for (double t : x) s += std::to_string(t) + " ";
  return s + ")";
}

TEST_P(OpSheet, ValueAgreesWithTheReferenceAndTheInterpreterBitForBit) {
  Random random(1);
  const Function f = function();
  for (int n = 0; n < kSamples; ++n) {
    const std::vector<double> x = sample(random);
    const double got = value<double>(op(), x);
    const Quad expected = value<Quad>(op(), to_quad(x));
    EXPECT_LE(abs(Quad(got) - expected), 4 * kEps * abs(expected)) << text(x);
    EXPECT_EQ(got, evaluate(f, x)[0]) << text(x);
  }
}

TEST_P(OpSheet, SlopesOfBothModesAgreeWithDifferences) {
  Random random(2);
  const Function f = function(), forward = jvp(f), reverse = vjp(f);
  const Derivatives sparse = derive(f, Order::kFirst);
  for (int n = 0; n < kSamples; ++n) {
    const std::vector<double> x = sample(random);
    SCOPED_TRACE(text(x));
    const std::vector<Quad> gradient = evaluate_as<Quad>(reverse, to_quad(x), {}, {Quad(1)});
    const std::vector<Quad> all = evaluate_as<Quad>(sparse.function, to_quad(x));
    std::vector<Quad> from_sparse(x.size(), 0);
    for (std::size_t k = 0; k < sparse.jacobian.nnz(); ++k) from_sparse[sparse.jacobian.col[k]] = all[1 + k];
    for (std::size_t j = 0; j < x.size(); ++j) {
      const Quad expected = difference(f, x, j)[0];
      std::vector<Quad> direction(x.size(), 0);
      direction[j] = 1;
      expect_close(evaluate_as<Quad>(forward, to_quad(x), {}, direction)[0], expected, kSlopeTolerance,
                   "jvp");
      expect_close(gradient[j], expected, kSlopeTolerance, "vjp");
      expect_close(from_sparse[j], expected, kSlopeTolerance, "sparse");
    }
  }
}

// derive, jvp of vjp, vjp of jvp; and a third derivative by one more jvp.
// Where the true slope is a number, no intermediate result overflows or vanishes: arguments of all sizes, the
// same cells in 113 bits with their longer range.  Slopes below the normal numbers have their last place.
TEST_P(OpSheet, SlopesReachAsFarAsTheirTrueValues) {
  constexpr double kMost = std::numeric_limits<double>::max(), kLastPlaces = 4e-323;
  std::vector<double> sizes = {0.3, 1.5, 3, 10, 18, 20, 30, 100, 340, 700};
  for (int e = -307; e <= 307; e += arity() > 1 ? 14 : 3) sizes.push_back(1.3 * std::pow(10, e));
  // Digits are for the tests above; fmod counts a million of them.
  const auto holds = [&](double found, const Quad& expected) {
    const Quad size = abs(expected);
    if (isnan(expected) || size > kMost) return true;
    return abs(found - expected) <= 2e-6 * size + kLastPlaces;
  };
  for (int i = 0; i < arity(); ++i) {
    if (!has_slope(op(), i)) continue;
    for (double a : sizes) {
      for (double b : arity() > 1 ? sizes : std::vector<double>{1}) {
        for (double sign : {-1.0, 1.0}) {
          const double x[3] = {sign * a, b, 1}, v = 1, r = evaluate<double>(op(), x[0], x[1], x[2]);
          const Quad u[3] = {x[0], x[1], x[2]}, s = evaluate<Quad>(op(), u[0], u[1], u[2]);
          if (!std::isfinite(r) || !holds(r, s) || !isfinite(s)) continue;
          const double found = slope<double>(op(), i, x[0], x[1], x[2], r, v);
          const Quad expected = slope<Quad>(op(), i, u[0], u[1], u[2], s, Quad(v));
          EXPECT_TRUE(holds(found, expected)) << "argument " << i << " at (" << x[0] << ", " << x[1]
                                              << "): " << found << ", not " << to_text(expected, 8);
        }
      }
    }
  }
}

TEST_P(OpSheet, HigherDerivativesAgreeWithDifferences) {
  Random random(3);
  const Function f = function(), gradient = vjp(f), forward_reverse = jvp(gradient);
  const Function reverse_forward = vjp(jvp(f));
  const SparseFunction hessian = sparse_hessian(f);
  const Function third = jvp(forward_reverse);
  for (int n = 0; n < kSamples / 4; ++n) {
    const std::vector<double> x = sample(random);
    SCOPED_TRACE(text(x));
    const std::vector<Quad> h = evaluate_as<Quad>(hessian.function, to_quad(x), {}, {Quad(1)});
    for (std::size_t j = 0; j < x.size(); ++j) {
      std::vector<double> e(x.size(), 0);
      e[j] = 1;
      std::vector<double> l_dx = {1}, dx_l = e, l_dx_dx = {1};  // weights: in order of derivation
      l_dx.insert(l_dx.end(), e.begin(), e.end());
      dx_l.push_back(1);
      l_dx_dx.insert(l_dx_dx.end(), e.begin(), e.end());
      l_dx_dx.insert(l_dx_dx.end(), e.begin(), e.end());
      const auto expected = difference(gradient, x, j, {}, {1});
      const auto fr = evaluate_as<Quad>(forward_reverse, to_quad(x), {}, to_quad(l_dx));
      const auto rf = evaluate_as<Quad>(reverse_forward, to_quad(x), {}, to_quad(dx_l));
      std::vector<Quad> column(x.size(), 0);
      for (std::size_t k = 0; k < hessian.pattern.nnz(); ++k) {
        if (hessian.pattern.col[k] == j) column[hessian.pattern.row[k]] = h[k];
        if (hessian.pattern.row[k] == j) column[hessian.pattern.col[k]] = h[k];
      }
      const auto third_expected = difference(forward_reverse, x, j, {}, l_dx);
      const auto third_got = evaluate_as<Quad>(third, to_quad(x), {}, to_quad(l_dx_dx));
      for (std::size_t i = 0; i < x.size(); ++i) {
        expect_close(fr[i], expected[i], 10 * kSlopeTolerance, "jvp of vjp");
        expect_close(rf[i], expected[i], 10 * kSlopeTolerance, "vjp of jvp");
        expect_close(column[i], expected[i], 10 * kSlopeTolerance, "sparse Hessian");
        expect_close(third_got[i], third_expected[i], 100 * kSlopeTolerance, "third derivative");
      }
    }
  }
}

TEST_P(OpSheet, HasSlopeWhereADifferenceIsNotZero) {
  Random random(4);
  const Function f = function();
  for (int j = 0; j < arity(); ++j) {
    bool moves = false;
    for (int n = 0; n < kSamples; ++n) {
      moves = moves || difference(f, sample(random), static_cast<std::size_t>(j))[0] != 0;
    }
    EXPECT_EQ(moves, has_slope(op(), j)) << "argument " << j;
  }
}

TEST_P(OpSheet, HessianPatternHasExactlyTheCurvedPairs) {
  Random random(5);
  const Function f = function(), gradient = vjp(f);
  const Pattern pattern = sparse_hessian(f).pattern;
  for (std::size_t j = 0; j < f.n_x(); ++j) {
    std::vector<bool> curved(f.n_x(), false), listed(f.n_x(), false);
    for (int n = 0; n < kSamples / 4; ++n) {
      const auto d = difference(gradient, sample(random), j, {}, {1});
      for (std::size_t i = j; i < f.n_x(); ++i) curved[i] = curved[i] || abs(d[i]) > 1e-20;
    }
    for (std::size_t k = 0; k < pattern.nnz(); ++k) {
      if (pattern.col[k] == j) listed[pattern.row[k]] = true;
    }
    for (std::size_t i = j; i < f.n_x(); ++i) EXPECT_TRUE(listed[i] || !curved[i]) << i << " " << j;
  }
}

// --- laws ---

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

std::vector<double> finite_arguments() {
  using L = std::numeric_limits<double>;
  std::vector<double> all = {0.0,
                             -0.0,
                             L::denorm_min(),
                             -L::denorm_min(),
                             L::min(),
                             -L::min(),
                             L::max(),
                             -L::max(),
                             L::epsilon(),
                             1.0,
                             -1.0,
                             0.5,
                             2.0,
                             -3.0,
                             1e308,
                             0.1,
                             -0.7,
                             1e-300};
  Random random(6);
  for (int n = 0; n < 60; ++n) {
    const double size = std::ldexp(random.uniform(1, 2), static_cast<int>(random.below(80)) - 40);
    all.push_back(random.below(2) ? size : -size);
  }
  for (int n = 0; n < 60; ++n) all.push_back(random.uniform(-2, 2));
  return all;
}

TEST_P(OpSheet, LawsHoldBitForBitForFiniteArguments) {
  const std::uint32_t laws = info(op()).laws;
  const auto f = [&](double x, double y = 0) { return evaluate<double>(op(), x, y, 0); };
  const std::vector<double> arguments = finite_arguments();
  for (double x : arguments) {
    SCOPED_TRACE("x = " + std::to_string(x));
    if (laws & kZeroLeft) {
      EXPECT_TRUE(same(f(0, x), x));
    }
    if (laws & kZeroRight) {
      EXPECT_TRUE(same(f(x, 0), x));
    }
    if (laws & kOneLeft) {
      EXPECT_TRUE(same(f(1, x), x));
    }
    if (laws & kOneRight) {
      EXPECT_TRUE(same(f(x, 1), x));
    }
    // 0 / 0 is the documented exception: a constant zero divided by anything is zero.
    if (laws & kAbsorbLeft) {
      EXPECT_TRUE(same(f(0, x), 0) || (op() == Op::Div && x == 0));
    }
    if (laws & kAbsorbRight) {
      EXPECT_TRUE(same(f(x, 0), 0));
    }
    if (laws & kOdd) {
      EXPECT_TRUE(same(f(-x), -f(x)));
    }
    if (laws & kEven) {
      EXPECT_TRUE(same(f(-x), f(x)));
    }
    if (laws & kIdempotent) {
      EXPECT_TRUE(same(f(f(x)), f(x)));
    }
    if (laws & kInvolution) {
      EXPECT_TRUE(same(f(f(x)), x));
    }
    if (!(laws & kCommutative)) continue;
    for (double y : arguments) EXPECT_TRUE(same(f(x, y), f(y, x))) << "y = " << y;
  }
}

TEST_P(OpSheet, TheGraphAppliesTheLawsThatAreClaimed) {
  const std::uint32_t laws = info(op()).laws;
  Graph g;
  const NodeId x = g.input(Block::kVariables, 0), y = g.input(Block::kVariables, 1);
  const NodeId zero = g.constant(0), one = g.constant(1), minus = g.make(Op::Neg, x);
  if (laws & kCommutative) {
    const NodeId z = arity() > 2 ? g.input(Block::kVariables, 2) : kNoNode;
    EXPECT_EQ(g.make(op(), x, y, z), g.make(op(), y, x, z));
  }
  if (laws & kZeroLeft) {
    EXPECT_EQ(g.make(op(), zero, x), x);
  }
  if (laws & kZeroRight) {
    EXPECT_EQ(g.make(op(), x, zero), x);
  }
  if (laws & kOneLeft) {
    EXPECT_EQ(g.make(op(), one, x), x);
  }
  if (laws & kOneRight) {
    EXPECT_EQ(g.make(op(), x, one), x);
  }
  if (laws & kAbsorbLeft) {
    EXPECT_TRUE(g.is_constant(g.make(op(), zero, x), 0));
  }
  if (laws & kAbsorbRight) {
    EXPECT_TRUE(g.is_constant(g.make(op(), x, zero), 0));
  }
  if (laws & kOdd) {
    EXPECT_EQ(g.make(op(), minus), g.make(Op::Neg, g.make(op(), x)));
  }
  if (laws & kEven) {
    EXPECT_EQ(g.make(op(), minus), g.make(op(), x));
  }
  if (laws & kIdempotent) {
    EXPECT_EQ(g.make(op(), g.make(op(), x)), g.make(op(), x));
  }
  if (laws & kInvolution) {
    EXPECT_EQ(g.make(op(), g.make(op(), x)), x);
  }
}

TEST_P(OpSheet, TheCColumnNamesEveryArgumentAndNoOther) {
  for (int i = 0; i < 3; ++i) {
    const std::string name = "$" + std::to_string(i);
    EXPECT_EQ(info(op()).c.find(name) != std::string_view::npos, i < arity()) << info(op()).c;
  }
}

std::vector<Op> all_ops() {
  std::vector<Op> ops;
  for (int i = 0; i < kTableOps; ++i) ops.push_back(static_cast<Op>(i));
  return ops;
}

INSTANTIATE_TEST_SUITE_P(Rows, OpSheet, ::testing::ValuesIn(all_ops()),
                         [](const auto& row) { return std::string(dyntape::info(row.param).name); });

}  // namespace
}  // namespace dyntape::testing::op_sheet_test
