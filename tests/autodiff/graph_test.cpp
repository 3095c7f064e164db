// SPDX-License-Identifier: BSD-3-Clause
//
// The graph itself: what is shared, what is folded, what is left alone; its hash and its text.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/graph/dump.h>
#include <dyntape/autodiff/graph/nonzero_outputs.h>
#include <dyntape/autodiff/record/record.h>

#include "dense.h"
#include "random_program.h"

namespace dyntape::testing::graph_test {
namespace {

VectorXad one(const AD& y) { return VectorXad::Constant(1, y); }

TEST(Graph, EqualNodesAreOneNode) {
  Graph g;
  const NodeId x = g.input(Block::kVariables, 0), y = g.input(Block::kParameters, 0);
  EXPECT_NE(x, y);
  EXPECT_EQ(g.input(Block::kVariables, 0), x);
  EXPECT_EQ(g.make(Op::Mul, g.make(Op::Sin, x), y), g.make(Op::Mul, y, g.make(Op::Sin, x)));
  EXPECT_NE(g.make(Op::Sub, x, y), g.make(Op::Sub, y, x));
  EXPECT_NE(g.constant(0.0), g.constant(-0.0));  // bit for bit
  EXPECT_EQ(g.constant(std::nan("")), g.constant(std::nan("")));
  EXPECT_NE(g.constant(0.1 + 0.2), g.constant(0.3));
}

// Random look-ups among many nodes of every shape, against a map from what a node says to its number.
TEST(Graph, LookUpsFindWhatIsThereThroughGrowthAndExtraction) {
  Random random(7);
  Graph g;
  std::vector<NodeId> nodes;
  for (std::uint32_t i = 0; i < 20; ++i) nodes.push_back(g.input(Block::kVariables, i));
  std::vector<std::pair<std::array<NodeId, 2>, NodeId>> made;
  for (int i = 0; i < 60000; ++i) {
    const NodeId a = random.below(2) ? nodes[random.below(20)] : nodes[nodes.size() - 1 - random.below(20)];
    const NodeId b = nodes[random.below(nodes.size())];
    made.push_back({{a, b}, g.make(Op::Div, a, b)});
    nodes.push_back(made.back().second);
  }
  const NodeId hub = nodes.back();  // the newest argument of thousands
  for (int i = 0; i < 5000; ++i) {
    const NodeId a = nodes[random.below(nodes.size())];
    made.push_back({{a, hub}, g.make(Op::Div, a, hub)});
  }
  const std::size_t size = g.size();
  for (const auto& [arguments, id] : made) ASSERT_EQ(g.make(Op::Div, arguments[0], arguments[1]), id);
  EXPECT_EQ(g.size(), size);
  // A copy has no table at first and builds it when asked.
  std::vector<NodeId> image;
  Graph copy = g.extract(std::vector<std::uint8_t>(size, 1), size, image);
  for (const auto& [arguments, id] : made) {
    ASSERT_EQ(copy.make(Op::Div, image[arguments[0]], image[arguments[1]]), image[id]);
  }
  EXPECT_EQ(copy.size(), size);
}

// A long graph takes the memory of one that was destroyed before: nothing of that is left in it.
TEST(Graph, LongGraphsInMemoryOfOthersAreTheSame) {
  const auto chain = [](Op op, std::size_t length) {
    Graph g;
    const NodeId x = g.input(Block::kVariables, 0), y = g.input(Block::kVariables, 1);
    NodeId last = x;
    for (std::size_t i = 0; i < length; ++i) last = g.make(i % 3 ? op : Op::Add, last, i % 5 ? y : x);
    return g;
  };
  const auto copy_of = [](const Graph& g) {
    std::vector<NodeId> image;
    return g.extract(std::vector<std::uint8_t>(g.size(), 1), g.size(), image);
  };
  const Graph longer = chain(Op::Mul, 22000), shorter = chain(Op::Div, 20000);
  for (const Graph* const g : {&longer, &shorter, &longer}) {
    { const Graph before = copy_of(longer); }
    EXPECT_EQ(copy_of(*g).nodes(), g->nodes());
  }
  // A copy knows its nodes too, as does what was moved.
  Graph copy = shorter;
  const std::size_t size = copy.size();
  EXPECT_EQ(copy.make(Op::Add, 0, 0), 2u);  // the first of the chain
  Graph moved = std::move(copy);
  EXPECT_EQ(moved.make(Op::Add, 0, 0), 2u);
  EXPECT_EQ(moved.size(), size);
  copy = shorter;
  EXPECT_EQ(copy.make(Op::Add, 0, 0), 2u);
  EXPECT_EQ(copy.nodes(), shorter.nodes());
}

TEST(Graph, Case119_CompensatedSumsAreLeftAlone) {
  const auto kahan = [](const auto& x) {
    using T = std::decay_t<decltype(x[0] + 0.0)>;
    T sum = 0.0, c = 0.0;
    for (int i = 0; i < 5; ++i) {
      const T y = x[i] - c, t = sum + y;
      c = (t - sum) - y;
      sum = t;
    }
    return sum;
  };
  const std::vector<double> x = {1, 1e-16, 1e-16, 1e-16, 1e-16};
  const Function f = record("kahan", 5, [&](const VectorXad& v) { return one(kahan(v)); });
  EXPECT_EQ(evaluate(f, x)[0], kahan(x));
  EXPECT_GT(kahan(x), 1);  // which a plain sum is not
}

TEST(Graph, AStrongZeroOfAConstantIsAProduct) {
  Graph g;
  const NodeId x = g.input(Block::kVariables, 0);
  for (const double c : {2.0, -0.5, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_EQ(g[g.make(Op::Azmul, g.constant(c), x)].op, Op::Mul) << c;
  EXPECT_TRUE(g.is_constant(g.make(Op::Azmul, g.constant(0), x), 0));
}

TEST(Graph, Case30_IntegerPowersAreProducts) {
  const Function f = record("powers", 1, [](const VectorXad& x) {
    VectorXad y(2);
    y << pow(x[0], 5), pow(x[0], 17);
    return y;
  });
  std::size_t powers = 0;
  for (const Node& node : f.graph.nodes()) powers += node.op == Op::Pow;
  EXPECT_EQ(powers, 1u);
  EXPECT_EQ(evaluate(f, {3}), (std::vector<double>{243, std::pow(3.0, 17)}));
}

// Where x^n overflows and 1 / x^n does not vanish, and the other way round.
TEST(Graph, NegativeIntegerPowersReachAsFarAsTheLibrarys) {
  const Function f = record("powers", 1, [](const VectorXad& x) {
    VectorXad y(16);
    for (int n = 1; n <= 16; ++n) y[n - 1] = pow(x[0], -n);
    return y;
  });
  for (const Node& node : f.graph.nodes()) EXPECT_NE(node.op, Op::Pow);
  for (int exponent = -1074; exponent < 1024; ++exponent) {
    for (const double mantissa : {1.0, -1.4142}) {
      const double x = std::ldexp(mantissa, exponent);
      const std::vector<double> y = evaluate(f, {x});
      for (int n = 1; n <= 16; ++n) {
        const double expected = std::pow(x, -n), found = y[static_cast<std::size_t>(n - 1)];
        const bool close = std::abs(found - expected) <= 2e-15 * std::abs(expected) + n * 5e-324;
        EXPECT_TRUE(found == expected || close) << x << "^-" << n << ": " << found << ", not " << expected;
      }
    }
  }
}

// The four sums of a rounded product are closed under signs: no negation is left that a compiler could take in.
TEST(Graph, NegationsAreAPartOfFusedOperations) {
  Random random(31);
  SCOPED_TRACE(random.seed_text());
  constexpr Op kFused[] = {Op::Fma, Op::Fms, Op::Fnma, Op::Fnms};
  for (const Op op : kFused) {
    for (int signs = 0; signs < 16; ++signs) {
      Function f;
      f.inputs = {3, 0, 0};
      NodeId in[3];
      for (std::uint32_t i = 0; i < 3; ++i) {
        in[i] = f.graph.input(Block::kVariables, i);
        if (signs >> i & 1) in[i] = f.graph.make(Op::Neg, in[i]);
      }
      const NodeId sum = f.graph.make(op, in[0], in[1], in[2]);
      f.outputs = {signs & 8 ? f.graph.make(Op::Neg, sum) : sum};
      EXPECT_EQ(total_operations(compact(f)), 1u) << info(op).name << " " << signs;
      const std::vector<double> x = random.vector(3, -2, 2);
      const auto sign = [&](int i) { return signs >> i & 1 ? -1.0 : 1.0; };
      EXPECT_EQ(evaluate(f, x)[0],
                sign(3) * evaluate<double>(op, sign(0) * x[0], sign(1) * x[1], sign(2) * x[2]));
    }
  }
}

TEST(Graph, NegationsMoveOutOfProductsAndSums) {
  const Function f = record("signs", 2, [](const VectorXad& x) {
    VectorXad y(6);
    y << (-x[0]) * (-x[1]), x[0] - (-x[1]), -(-x[0]), -(x[0] - x[1]) - (x[1] - x[0]),
        (-x[0]) / x[1] + x[0] / x[1], x[0] / 4;
    return y;
  });
  for (const OperationCount& entry : count_operations(f)) {
    EXPECT_NE(entry.op, Op::Neg) << to_text(f);
  }
  EXPECT_EQ(evaluate(f, {3, 5}), (std::vector<double>{15, 8, 3, 0, 0, 0.75}));
}

// Sums, products and quotients of random signs: the recording, which carries signs along with its values, leaves what the
// graph's own laws do when it is made node by node, and computes what doubles do.
TEST(Graph, ARecordingMovesSignsAsTheGraphDoes) {
  Random random(11);
  const double constants[] = {0, -0.0, 1, -1, 2, -0.5};
  const auto program = [&](auto x) {  // the operands x, and a hundred operations
    using own::sin;
    using T = typename decltype(x)::value_type;
    for (int i = 0; i < 100; ++i) {
      const T a = x[random.below(x.size())], b = x[random.below(x.size())];
      const double c = constants[random.below(6)];
      const T first = random.below(3) ? a : T(c), second = random.below(3) ? b : T(-c);
      switch (random.below(6)) {
        case 0:
          x.push_back(T(-a));
          break;
        case 1:
          x.push_back(first + second);
          break;
        case 2:
          x.push_back(first - second);
          break;
        case 3:
          x.push_back(first * second);
          break;
        case 4:
          x.push_back(first / (second * second + T(3)));
          break;
        default:
          x.push_back(sin(T(first - T(c) * second)));
      }
    }
    return x;
  };
  for (int round = 0; round < 200; ++round) {
    const Random begin = random;
    const Function f = record("signs", 3, [&](const VectorXad& x) {
      const std::vector<AD> y = program(std::vector<AD>(x.begin(), x.end()));
      return VectorXad(VectorXad::Map(y.data(), static_cast<Eigen::Index>(y.size())));
    });
    random = begin;
    const std::vector<double> x = {0.3, -0.7, 1.9}, y = program(x), recorded = evaluate(f, x);
    ASSERT_EQ(recorded, y) << "round " << round;

    Function again;
    again.inputs = f.inputs;
    again.outputs = splice(f.graph, f.outputs, again.graph,
                           [&](Block block, std::uint32_t i) { return again.graph.input(block, i); });
    EXPECT_EQ(total_operations(again), total_operations(f)) << "round " << round;
    for (const Node& node : f.graph.nodes()) {
      EXPECT_FALSE(node.op == Op::Neg && (f.graph[node.a].op == Op::Sub || f.graph[node.a].op == Op::Neg));
    }
  }
}

TEST(Function, CompactIsIdempotentAndKeepsTheMeaning) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.seed_text());
    const Program program = random_program(random, 60);
    const Function f = recorded(program), twice = compact(f);
    EXPECT_EQ(f.graph.nodes(), twice.graph.nodes());
    EXPECT_EQ(f.outputs, twice.outputs);
    EXPECT_EQ(content_hash(f), content_hash(twice));
    // What splice() builds by make() is what extract() copies: simplification has nothing left to do.
    Function respliced = f;
    respliced.graph = Graph();
    respliced.outputs = splice(f.graph, f.outputs, respliced.graph,
                               [&](Block block, std::uint32_t i) { return respliced.graph.input(block, i); });
    EXPECT_EQ(content_hash(f), content_hash(respliced));
    // Derived functions as well.
    const Function d = derive(f, Order::kSecond).function;
    EXPECT_EQ(d.graph.nodes(), compact(d).graph.nodes());
  }
}

TEST(Function, TheHashSeesWhatIsComputedAndNothingElse) {
  const auto make = [](double constant, const char* name) {
    return record(name, 2, [&](const VectorXad& x) { return one(x[0] * constant + x[1]); });
  };
  const std::string hash = content_hash(make(0.1, "a"));
  EXPECT_EQ(hash.size(), 32u);
  EXPECT_EQ(hash, content_hash(make(0.1, "b")));
  EXPECT_NE(hash, content_hash(make(std::nextafter(0.1, 1), "a")));  // the last bit
  Function more = make(0.1, "a");
  more.inputs[1] = 1;
  EXPECT_NE(hash, content_hash(more));
  Function outputs = make(0.1, "a");
  outputs.outputs.push_back(outputs.outputs[0]);
  EXPECT_NE(hash, content_hash(outputs));
}

TEST(Function, BindingIsPartialEvaluation) {
  const Function f = record("f", 2, 2, [](const VectorXad& x, const VectorXad& p) {
    return one(p[0] * sin(x[0]) + p[1] * exp(x[1]));
  });
  const Function g = bind(f, Block::kParameters, {{1, 0.0}});
  EXPECT_EQ(total_operations(g), 2u);  // the exponential is gone
  EXPECT_EQ(evaluate(g, {1, 2}, {3, 99})[0], 3 * own::sin(1.0));
  EXPECT_EQ(evaluate(bind(f, Block::kVariables, {{0, 1.0}, {1, 2.0}}), {}, {3, 4})[0],
            evaluate(f, {1, 2}, {3, 4})[0]);
}

TEST(Function, ABlockThatIsBoundAsAWholeIsGone) {
  RecordOptions options;
  options.parameter_names = {"a", "b"};
  const Function f = record(
      "f", 1, 2, [](const VectorXad& x, const VectorXad& p) { return one(p[0] * x[0] + p[1]); }, options);
  const Function half = bind(f, Block::kParameters, {{1, 5.0}});
  EXPECT_EQ(half.n_p(), 2u) << "the others keep their places";
  EXPECT_EQ(half.input_names[1], options.parameter_names);
  const Function whole = bind(f, Block::kParameters, {{1, 5.0}, {0, 2.0}});
  EXPECT_EQ(whole.n_p(), 0u);
  EXPECT_TRUE(whole.input_names[1].empty());
  EXPECT_EQ(evaluate(whole, {3})[0], 11);
  EXPECT_EQ(recorded_callee(whole)->n_in, 1u);
}

TEST(Function, AllAsVariablesKeepsTheOrderVariablesWeightsParameters) {
  const Function f =
      vjp(record("f", 1, 1, [](const VectorXad& x, const VectorXad& p) { return one(p[0] * x[0] * x[0]); }));
  EXPECT_EQ(evaluate(f, {3}, {5}, {7})[0], 2 * 3 * 5 * 7);
  EXPECT_EQ(evaluate(all_as_variables(f), {3, 7, 5})[0], 2 * 3 * 5 * 7);
}

TEST(Function, NonzeroOutputsAreEachWrittenOnce) {
  const Function whole = record("f", 2, [](const VectorXad& x) {
    VectorXad y(7);
    y << x[0], 0.0, x[0] * x[1], -0.0, 3.0, x[1] * x[0], x[0] - x[0] * 1.0;
    return y;
  });
  const NonzeroOutputs nonzero = nonzero_outputs(whole);
  EXPECT_EQ(nonzero.function.n_y(), 4u) << "the last one is not zero where x is infinite";
  EXPECT_EQ(nonzero.place,
            (std::vector<std::int32_t>{0, NonzeroOutputs::kZero, 1, NonzeroOutputs::kNegativeZero, 2, 1, 3}));
  double y[7];
  nonzero.expand(evaluate(nonzero.function, {2.0, 5.0}).data(), y);
  EXPECT_EQ(std::vector<double>(y, y + 7), (std::vector<double>{2, 0, 10, -0.0, 3, 10, 0}));
  EXPECT_TRUE(std::signbit(y[3]) && !std::signbit(y[1]));
}

TEST(Interpreter, NamesTheFirstOperationThatIsNotFinite) {
  RecordOptions options;
  options.variable_names = {"height"};
  const Function f = record(
      "f", 1, [](const VectorXad& x) { return one(exp(log(x[0]) + 1)); }, options);
  const auto first = [&](double x) { return first_not_finite(f, &x, nullptr, nullptr); };
  EXPECT_EQ(first(1), "");
  EXPECT_NE(first(-1).find("(Log): of (-1) = "), std::string::npos) << first(-1);
  EXPECT_NE(first(std::nan("")).find("variable 0 (height)"), std::string::npos);
}

TEST(Dump, TextAndDrawing) {
  RecordOptions options;
  options.variable_names = {"angle"};
  options.output_names = {"height"};
  const Function f = record(
      "swing", 1, 1, [](const VectorXad& x, const VectorXad& p) { return one(p[0] * cos(x[0]) + 0.1); },
      options);
  const std::string text = to_text(f);
  EXPECT_EQ(text,
            "swing: 1 variables, 1 parameters, 0 weights -> 1 outputs\n"
            "  n0 = angle\n"
            "  n1 = p[0]\n"
            "  n2 = Cos n0\n"
            "  n3 = Mul n1, n2\n"
            "  n4 = 0.1\n"
            "  n5 = Add n3, n4\n"
            "  height = n5\n");
  const std::string dot = to_dot(f);
  EXPECT_NE(dot.find("n2 -> n3;"), std::string::npos);
  EXPECT_NE(dot.find("label=\"angle\", shape=box"), std::string::npos);
  EXPECT_THROW(to_dot(f, 3), ArgumentError);
}

}  // namespace
}  // namespace dyntape::testing::graph_test
