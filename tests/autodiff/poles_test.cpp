// SPDX-License-Identifier: BSD-3-Clause
//
// Where derivatives are infinite: the rule that stands in ops.def, held by every operator, every composition and every
// product of two, and random programs, at the points where they have their poles.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <sstream>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/record/record.h>

#include "dense.h"
#include "random.h"

namespace dyntape::testing::poles_test {
namespace {

using Values = std::vector<double>;
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kSpecial[] = {0.0, -0.0, 1.0, -1.0, 0.5, 1000.0};

// NaN as NaN, infinities as such, numbers up to the rounding of another order of products.
bool same(double a, double b) {
  if (std::isnan(a) || std::isnan(b)) return std::isnan(a) && std::isnan(b);
  return a == b || std::abs(a - b) <= 1e-13 * std::max(std::abs(a), std::abs(b)) + 1e-16;
}

bool same(const Values& a, const Values& b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(), [](double s, double t) { return same(s, t); });
}

std::string text(const Values& values) {
  std::ostringstream out;
  for (double v : values) out << " " << v;
  return out.str();
}

Values zeros(std::size_t n) { return Values(n, 0.0); }
Values unit(std::size_t n, std::size_t i) {
  Values e = zeros(n);
  e[i] = 1;
  return e;
}
Values joined(Values a, const Values& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Function with_outputs(std::size_t n_x, Graph graph, std::vector<NodeId> outputs) {
  Function f;
  f.name = "f";
  f.inputs[0] = n_x;
  f.graph = std::move(graph);
  f.outputs = std::move(outputs);
  return f;
}

// An operator on further variables, its first argument or another one given.
struct Maker {
  Graph graph;
  std::uint32_t n_x = 0;

  NodeId variable() { return graph.input(Block::kVariables, n_x++); }
  NodeId apply(Op op, NodeId given, int place) {
    NodeId a[3] = {kNoNode, kNoNode, kNoNode};
    for (int i = 0; i < info(op).arity; ++i) a[i] = i == place ? given : variable();
    return graph.make(op, a[0], a[1], a[2]);
  }
  NodeId apply_called(Op op, NodeId given, int place) {
    Maker inner;
    std::vector<NodeId> arguments;
    const NodeId x = inner.variable(), y = inner.apply(op, x, place);
    for (std::uint32_t i = 0; i < inner.n_x; ++i) arguments.push_back(i == 0 ? given : variable());
    return graph.call(recorded_callee(with_outputs(inner.n_x, inner.graph, {y})), arguments)[0];
  }
  Function function(std::vector<NodeId> outputs) { return with_outputs(n_x, graph, std::move(outputs)); }
};

// A function of one output, and the same with outputs beside it that have nothing to do with it.
class Sheet {
 public:
  Sheet(Maker maker, NodeId y) : n_(maker.n_x), alone_(maker.function({y})) {
    const NodeId u = maker.variable(), v = maker.variable();
    beside_ = maker.function({maker.graph.make(Op::Mul, u, v), y});
    forward_ = jvp(alone_), reverse_ = vjp(alone_), both_ = jvp(reverse_);
    reverse_beside_ = vjp(beside_), forward_beside_ = jvp(beside_);
    all_ = derive(alone_, Order::kSecond), all_beside_ = derive(beside_, Order::kSecond);
  }

  // What is wrong at x, or nothing.
  std::string wrong(const Values& x) const {
    const Values gradient = evaluate(reverse_, x, {}, {1}), at = joined(x, {2, 3});
    Values columns, columns_beside;
    for (std::size_t j = 0; j < n_; ++j) {
      columns.push_back(evaluate(forward_, x, {}, unit(n_, j))[0]);
      columns_beside.push_back(evaluate(forward_beside_, at, {}, unit(n_ + 2, j))[1]);
    }
    std::ostringstream out;
    const auto expect = [&](const char* what, const Values& got, const Values& expected) {
      if (!same(got, expected)) out << what << ":" << text(got) << " instead of" << text(expected) << "; ";
    };
    expect("forward against reverse", columns, gradient);
    expect("sparse", row(all_, x, {1}, 0), gradient);
    expect("sparse, beside another", row(all_beside_, at, {1, 1}, 1), joined(gradient, {0, 0}));
    expect("forward, beside another", columns_beside, gradient);
    expect("reverse, beside another", evaluate(reverse_beside_, at, {}, {0, 1}), joined(gradient, {0, 0}));
    expect("weight zero", evaluate(reverse_, x, {}, {0}), zeros(n_));
    expect("weight zero beside another", evaluate(reverse_beside_, at, {}, {1, 0}),
           joined(zeros(n_), {3, 2}));
    expect("direction zero", evaluate(forward_, x, {}, zeros(n_)), {0});
    expect("Hessian of weight zero", hessian_of(all_, x, {0}), zeros(all_.hessian.nnz()));
    expect("jvp of vjp of weight zero", evaluate(both_, x, {}, joined({0}, Values(n_, 1.0))), zeros(n_));
    expect("vjp in no direction", evaluate(both_, x, {}, joined({1}, zeros(n_))), zeros(n_));
    Values expected = zeros(all_beside_.hessian.nnz());
    for (std::size_t k = 0; k < expected.size(); ++k) expected[k] = all_beside_.hessian.row[k] == n_ + 1;
    expect("Hessian beside one of weight zero", hessian_of(all_beside_, at, {1, 0}), expected);
    return out.str();
  }

  // The gradient in reverse.
  Values gradient(const Values& x) const { return evaluate(reverse_, x, {}, {1}); }
  std::size_t n_x() const { return n_; }

 private:
  static Values row(const Derivatives& d, const Values& x, const Values& l, std::size_t i) {
    const Values all = evaluate(d.function, x, {}, l);
    Values row = zeros(d.jacobian.cols);
    for (std::size_t k = 0; k < d.jacobian.nnz(); ++k) {
      if (d.jacobian.row[k] == i) row[d.jacobian.col[k]] = all[d.n_y + k];
    }
    return row;
  }
  static Values hessian_of(const Derivatives& d, const Values& x, const Values& l) {
    const Values all = evaluate(d.function, x, {}, l);
    return {all.end() - static_cast<std::ptrdiff_t>(d.hessian.nnz()), all.end()};
  }

  std::size_t n_;
  Function alone_, beside_, forward_, reverse_, both_, forward_beside_, reverse_beside_;
  Derivatives all_, all_beside_;
};

std::vector<Values> points(std::size_t n_x, Random& random) {
  std::vector<Values> all;
  for (double x : kSpecial) all.push_back(Values(n_x, x));
  for (std::size_t k = 0; k < (n_x > 1 ? 8u : 0u); ++k) {
    Values x;
    for (std::size_t i = 0; i < n_x; ++i) x.push_back(kSpecial[random.below(std::size(kSpecial))]);
    all.push_back(x);
  }
  return all;
}

bool is_selection(Op op) { return op == Op::Select || op == Op::Min || op == Op::Max || op == Op::Gate; }

class Poles : public ::testing::TestWithParam<Op> {
 protected:
  void hold(const Sheet& sheet, const std::string& what, Random& random) {
    for (const Values& x : points(sheet.n_x(), random)) {
      const std::string wrong = sheet.wrong(x);
      if (!wrong.empty()) ADD_FAILURE() << what << " at" << text(x) << ": " << wrong;
    }
  }
};

TEST_P(Poles, OfACompositionAreTheSameInBothDirections) {
  Random random(11);
  for (int g = 0; g < kTableOps; ++g) {
    for (int place = 0; place < info(GetParam()).arity; ++place) {
      const Op inner = static_cast<Op>(g);
      Maker maker;
      const NodeId x = maker.variable(), y = maker.apply(inner, x, 0);
      const NodeId result = maker.apply(GetParam(), y, place);
      hold({maker, result},
           std::string(info(GetParam()).name) + " of " + std::string(info(inner).name) + ", argument " +
               std::to_string(place),
           random);
    }
  }
}

TEST_P(Poles, OfAProductAreTheSameInBothDirections) {
  Random random(12);
  for (int g = 0; g < kTableOps; ++g) {
    const Op other = static_cast<Op>(g);
    Maker maker;
    const NodeId x = maker.variable(), a = maker.apply(GetParam(), x, 0), b = maker.apply(other, x, 0);
    const NodeId product = maker.graph.make(Op::Mul, a, b);
    hold({maker, product}, std::string(info(GetParam()).name) + " times " + std::string(info(other).name),
         random);
  }
}

// The inner function called: the same as written out, and nothing made of arguments that do not move.  (But the
// branch not taken inside leaves a zero that the caller takes for a number.)
TEST_P(Poles, OfCalledFunctionsAreThoseOfInlinedOnes) {
  Random random(13);
  if (is_selection(GetParam())) return;
  for (Op outer : {Op::Add, Op::Mul, Op::Div, Op::Sqrt, Op::Sin, Op::Exp, Op::Max, Op::Select}) {
    for (int place = 0; place < info(outer).arity; ++place) {
      Maker called, inlined;
      const NodeId x = called.variable(), y = inlined.variable();
      const NodeId u = called.apply(outer, called.apply_called(GetParam(), x, 0), place),
                   v = inlined.apply(outer, inlined.apply(GetParam(), y, 0), place);
      const Sheet a(called, u), b(inlined, v);
      for (const Values& at : points(a.n_x(), random)) {
        EXPECT_EQ(a.wrong(at), "") << info(outer).name << " of a call of " << info(GetParam()).name
                                   << text(at);
        EXPECT_TRUE(same(a.gradient(at), b.gradient(at)))
            << info(outer).name << " of a call of " << info(GetParam()).name << text(at) << ":"
            << text(a.gradient(at)) << " instead of" << text(b.gradient(at));
      }
    }
  }
}

std::vector<Op> all_ops() {
  std::vector<Op> ops;
  for (int i = 0; i < kTableOps; ++i) ops.push_back(static_cast<Op>(i));
  return ops;
}

INSTANTIATE_TEST_SUITE_P(Rows, Poles, ::testing::ValuesIn(all_ops()),
                         [](const auto& row) { return std::string(dyntape::info(row.param).name); });

// --- what is claimed, case by case ---

VectorXad one(const AD& y) { return VectorXad::Constant(1, y); }

// The derivative of f at x[0] alone, forward and in reverse, and beside a product of two more variables.
Values derivatives(const std::function<AD(const AD&)>& f, double x) {
  const Function alone = record("alone", 1, [&](const VectorXad& v) { return one(f(v[0])); });
  const Function added = record("added", 3, [&](const VectorXad& v) { return one(f(v[0]) + v[1] * v[2]); });
  const Function apart = record("apart", 3, [&](const VectorXad& v) {
    VectorXad y(2);
    y << f(v[0]), v[1] * v[2];
    return y;
  });
  return {evaluate(jvp(alone), {x}, {}, {1})[0],
          evaluate(vjp(alone), {x}, {}, {1})[0],
          jacobian(alone, {x})(0, 0),
          evaluate(jvp(added), {x, 2, 3}, {}, {1, 0, 0})[0],
          evaluate(vjp(added), {x, 2, 3}, {}, {1})[0],
          jacobian(added, {x, 2, 3})(0, 0),
          jacobian(apart, {x, 2, 3})(0, 0)};
}

TEST(PolesOf, SlopesMultiplyAsNumbersWhereverTheyStand) {
  const Values nan(7, std::nan("")), infinite(7, kInf);
  EXPECT_TRUE(same(derivatives([](const AD& x) { return x * sqrt(x); }, 0), nan));
  EXPECT_TRUE(same(derivatives([](const AD& x) { return sqrt(x * x); }, 0), nan));
  EXPECT_TRUE(same(derivatives([](const AD& x) { return pow(pow(x, 0.5), 2.0); }, 0), nan));  // 1, and not 0
  EXPECT_TRUE(same(derivatives([](const AD& x) { return cbrt(pow(x, 3.0)); }, 0), nan));
  EXPECT_TRUE(same(derivatives([](const AD& x) { return sqrt(x); }, 0), infinite));
  EXPECT_TRUE(same(derivatives([](const AD& x) { return exp(sqrt(x)); }, 0), infinite));
  EXPECT_TRUE(same(derivatives([](const AD& x) { return 3.0 + asin(sin(x) + 1.0); }, 0), infinite));
}

// Weights (0, 1) of f and of something else: nothing of f is left, whatever its derivatives are.
TEST(PolesOf, AWeightOfZeroLeavesNothing) {
  const std::vector<std::pair<double, std::function<AD(const VectorXad&)>>> cases = {
      {0, [](const VectorXad& v) { return exp(sqrt(v[0])); }},
      {0, [](const VectorXad& v) { return sin(sqrt(v[0])); }},
      {0, [](const VectorXad& v) { return v[1] * sqrt(v[0]); }},
      {0, [](const VectorXad& v) { return v[1] * log(v[0]); }},
      {0, [](const VectorXad& v) { return log(v[0]); }},
      {0, [](const VectorXad& v) { return 1 / v[0]; }},
      {0, [](const VectorXad& v) { return v[1] / v[0]; }},
      {0, [](const VectorXad& v) { return atan2(v[0], 0 * v[1] + v[0]); }},
      {0, [](const VectorXad& v) { return pow(v[0], 1.5) * pow(v[0], v[1]); }},
      {-1, [](const VectorXad& v) { return v[1] * sqrt(v[0]) / log(v[0]); }},
      {1, [](const VectorXad& v) { return v[1] * asin(v[0]) + acos(v[0]) * acosh(v[0]); }},
      {1000, [](const VectorXad& v) { return v[1] * exp(v[0]); }},
      {1000, [](const VectorXad& v) { return exp(v[0]) / cosh(v[0]); }},
  };
  for (std::size_t k = 0; k < cases.size(); ++k) {
    SCOPED_TRACE(k);
    const Function f = record("f", 2, [&](const VectorXad& v) {
      VectorXad y(2);
      y << cases[k].second(v), v[0] * v[0] * v[1];
      return y;
    });
    const double x = cases[k].first;
    const Eigen::MatrixXd h = hessian(f, {x, 3}, {0, 1});
    EXPECT_EQ(h, (Eigen::MatrixXd(2, 2) << 6, 2 * x, 2 * x, 0).finished());
    EXPECT_EQ(evaluate(vjp(f), {x, 3}, {}, {0, 1}), (Values{6 * x, x * x}));
    EXPECT_EQ(evaluate(jvp(vjp(f)), {x, 3}, {}, {0, 1, 1, 0}), (Values{6, 2 * x}));
    EXPECT_EQ(evaluate(vjp(jvp(f)), {x, 3}, {}, {1, 0, 0, 1}), (Values{6, 2 * x}));
  }
}

// Of a constant that is not finite come infinities without a pole.
TEST(PolesOf, AConstantThatIsNotFiniteMeetsNoWeightOfZero) {
  for (double c : {kInf, -kInf, std::nan("")}) {
    const Function f = record("f", 2, [&](const VectorXad& v) {
      VectorXad y(2);
      y << c * v[0] * v[1] + sin(v[1] - c), v[0] * v[1];
      return y;
    });
    EXPECT_EQ(evaluate(vjp(f), {2, 3}, {}, {0, 1}), (Values{3, 2}));
    EXPECT_EQ(evaluate(jvp(f), {2, 3}, {}, {0, 0}), (Values{0, 0}));
    EXPECT_EQ(hessian(f, {2, 3}, {0, 1}), (Eigen::MatrixXd(2, 2) << 0, 1, 1, 0).finished());
  }
}

TEST(PolesOf, TheSlopeOfAQuotientIsANumberOfItsOwn) {
  const auto left = [](const AD& x) { return exp(x) / (1 + exp(x)); };
  const auto right = [](const AD& x) { return 1 / (1 + exp(-x)); };
  const auto both = [&](const AD& x) { return select(x < 0, left(x), right(x)); };
  for (double x : {-1000.0, -709.0, -400.0, -2.0, 0.0, 2.0, 30.0, 1000.0}) {
    const double e = std::exp(-std::abs(x)), slope = e / ((1 + e) * (1 + e));
    for (double got : derivatives(both, x)) EXPECT_LE(std::abs(got - slope), 1e-15 * slope) << x;
  }
  EXPECT_TRUE(same(derivatives(right, -400), zeros(7)));  // as documented: 1.9e-174 is right
  EXPECT_TRUE(same(derivatives(right, -1000), Values(7, std::nan(""))));
}

// The constant 0 is structure: divided by anything it is 0, also where C++ has NaN.
TEST(PolesOf, AConstantZeroDividedByAnythingIsZero) {
  const Function f = record("f", 1, [](const VectorXad& v) { return one(0.0 / v[0]); });
  for (double x : {0.0, -0.0, 1.0, kInf, std::nan("")}) {
    EXPECT_EQ(evaluate(f, {x})[0], 0);
    EXPECT_EQ(evaluate(vjp(f), {x}, {}, {1})[0], 0);
  }
}

// A branch that is not taken, below a pole and above it, in both directions.
TEST(PolesOf, ADeadBranchLeavesNothingInEitherDirection) {
  const Function f = record("f", 2, [](const VectorXad& v) {
    return one(sqrt(select(v[0] < 1, v[0], v[1])) + log(min(v[0], v[1])) + v[0] / max(v[0], v[1]));
  });
  const Values at = {0, 0}, first = evaluate(jvp(f), at, {}, {0, 1});
  EXPECT_EQ(first[0], evaluate(vjp(f), at, {}, {1})[1]);
  EXPECT_EQ(first[0], 0);
}

TEST(PolesOf, WeightsThatBecomeVariablesHaveTheirSlopes) {
  const Function f = record("f", 2, [](const VectorXad& v) {
    VectorXad y(2);
    y << sqrt(v[0]) * log(v[1]), v[0] / v[1];
    return y;
  });
  for (const Function& g : {vjp(f), jvp(f)}) {
    const Function h = all_as_variables(g);
    for (const Values& w : {Values{0, 0}, Values{1, 0}, Values{0.5, 2}}) {
      const Values at = joined({4, 3}, w);
      const Eigen::MatrixXd j = jacobian(h, at);
      EXPECT_GT(j.rightCols(2).cwiseAbs().minCoeff(), 0);
      for (std::size_t i = 0; i < 2; ++i) {  // linear in weights: a column is the value of a unit
        const Values column = evaluate(g, {4, 3}, {}, unit(2, i));
        for (std::size_t k = 0; k < column.size(); ++k)
          EXPECT_DOUBLE_EQ(j(static_cast<int>(k), static_cast<int>(2 + i)), column[k]);
      }
    }
  }
}

TEST(PolesOf, WhatHasNonePaysNothing) {
  const Function f = record("f", 3, [](const VectorXad& v) {
    VectorXad y(2);
    y << sin(v[0]) * v[1] * v[2], cos(v[1] + v[0]) * v[2] / 3.0;
    return y;
  });
  for (const OperationCount& count : count_operations(derive(f, Order::kSecond).function)) {
    EXPECT_NE(count.op, Op::Gate);
    EXPECT_NE(count.op, Op::Select);
  }
}

// d2 (b^e) / db de = b^(e-1) (1 + e log b), whichever is the first variable.
TEST(PolesOf, TheMixedSecondDerivativeOfAPower) {
  constexpr double kAnything = std::numeric_limits<double>::quiet_NaN();
  const struct {
    double base, exponent, mixed;
  } cases[] = {{2, 0, 0.5},
               {2, 1e-300, 0.5},
               {1, 0, 1},
               {3, -1, (1 - std::log(3.0)) / 9},
               {0, 1.5, 0},
               {0, 2.5, 0},
               {0, 1, kAnything},
               {0, 0.5, kAnything},
               {1e-100, 2, 1e-100 * (1 + 2 * std::log(1e-100))}};
  for (int base : {0, 1}) {
    const Function f = record("power", 2, [&](const VectorXad& x) {
      return VectorXad(VectorXad::Constant(1, pow(x[base], x[1 - base])));
    });
    const Derivatives d = derive(f, Order::kSecond);
    ASSERT_EQ(d.hessian.nnz(), 3u);  // (0, 0), (1, 0), (1, 1)
    for (const auto& c : cases) {
      const Values x = base == 0 ? Values{c.base, c.exponent} : Values{c.exponent, c.base};
      const double mixed = evaluate(d.function, x, {}, {1})[1 + d.jacobian.nnz() + 1];
      if (std::isnan(c.mixed)) {
        EXPECT_FALSE(std::isfinite(mixed)) << c.base << "^" << c.exponent;  // -inf
      } else {
        EXPECT_NEAR(mixed, c.mixed, 1e-14 * std::abs(c.mixed)) << c.base << "^" << c.exponent;
      }
    }
  }
}

std::size_t gates_of(const Function& f) {
  std::size_t gates = 0;
  for (const OperationCount& count : count_operations(f)) gates += count.op == Op::Gate ? count.count : 0;
  return gates;
}

// s may be infinite for log(p); the slope of s x1 in s is x1, which is not.
TEST(PolesOf, AFiniteSlopeOfSomethingInfinitePaysNothing) {
  const Function f = record("f", 2, 1, [](const VectorXad& x, const VectorXad& p) {
    const AD s = x[0] + log(p[0]);
    VectorXad y(2);
    y << s * x[1], x[0];
    return y;
  });
  EXPECT_EQ(gates_of(vjp(f)), 1u);  // w0 s, which is the slope in x1
}

// --- random programs ---

// Operations on operands that may be the same ones, at points where many have poles.
Maker random_function(Random& random, std::size_t n_x, std::vector<NodeId>& outputs) {
  Maker maker;
  std::vector<NodeId> nodes;
  for (std::size_t i = 0; i < n_x; ++i) nodes.push_back(maker.variable());
  for (int k = 0; k < 12; ++k) {
    const auto op = static_cast<Op>(random.below(kTableOps));
    const auto pick = [&] {
      return nodes[nodes.size() - 1 - random.below(std::min<std::size_t>(nodes.size(), 6))];
    };
    NodeId a[3] = {kNoNode, kNoNode, kNoNode};
    for (int i = 0; i < info(op).arity; ++i) a[i] = pick();
    if (op == Op::Gate) continue;  // is for weights
    nodes.push_back(maker.graph.make(op, a[0], a[1], a[2]));
  }
  outputs = {nodes[nodes.size() - 1], nodes[nodes.size() - 2]};
  return maker;
}

// The other variables as parameters: what does not move cannot contribute.
Function in_one_variable(const Function& f, std::uint32_t j) {
  Function result;
  result.inputs = {1, f.n_x(), 0};
  result.outputs = splice(f.graph, f.outputs, result.graph, [&](Block, std::uint32_t i) {
    return i == j ? result.graph.input(Block::kVariables, 0) : result.graph.input(Block::kParameters, i);
  });
  return result;
}

TEST(PolesOf, RandomProgramsAreFiniteInBothDirectionsOrInNone) {
  std::size_t infinite = 0, finite = 0;
  for (std::uint64_t seed = 1; seed <= 1500; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    std::vector<NodeId> outputs;
    Maker maker = random_function(random, 3, outputs);
    const Function f = maker.function(outputs), second = maker.function({outputs[1]});
    const Function forward = jvp(f), reverse = vjp(f), gradient = vjp(second);
    const Derivatives all = derive(f, Order::kSecond);
    const SparseFunction h = sparse_hessian(f), h_second = sparse_hessian(second);
    for (const Values& x : points(3, random)) {
      // A weight of zero is as if the output was not there.
      EXPECT_TRUE(same(evaluate(reverse, x, {}, {0, 1}), evaluate(gradient, x, {}, {1}))) << text(x);
      Values zero = evaluate(all.function, x, {}, {0, 0});
      for (std::size_t k = all.n_y + all.jacobian.nnz(); k < zero.size(); ++k)
        EXPECT_EQ(zero[k], 0) << text(x);
      for (std::uint32_t j = 0; j < 3; ++j) {
        const Values column = evaluate(forward, x, {}, unit(3, j));
        EXPECT_TRUE(same(column, evaluate(jvp(in_one_variable(f, j)), {x[j]}, x, {1}))) << text(x);
        for (std::size_t i = 0; i < 2; ++i) {
          const double a = column[i], b = evaluate(reverse, x, {}, unit(2, i))[j];
          const bool is_finite = std::isfinite(a);
          ++(is_finite ? finite : infinite);
          EXPECT_EQ(is_finite, std::isfinite(b))
              << text(x) << " [" << i << ", " << j << "] " << a << " " << b;
          if (is_finite) {
            EXPECT_NEAR(a, b, 1e-10 * (1 + std::abs(a))) << text(x);
          }
        }
      }
    }
  }
  EXPECT_GT(infinite, 1000u);
  EXPECT_GT(finite, 1000u);
}

}  // namespace
}  // namespace dyntape::testing::poles_test
