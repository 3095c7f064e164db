// SPDX-License-Identifier: BSD-3-Clause
//
// The interpreter's program: slots that are used again, operations in another order, points side by side.  All
// of it against an evaluation node by node, bit for bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>

#include "autodiff/random_program.h"

namespace dyntape::testing::interpret_lanes_test {
namespace {

// Of a NaN only that it is one.
bool same(double a, double b) {
  return (std::isnan(a) && std::isnan(b)) ||
         std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

// Also what is not finite: it must stay in its lane.
double argument(Random& random) {
  constexpr double kSpecials[] = {0.0, -0.0, 1.0, -1.0, 5e-324, 1e300, INFINITY, -INFINITY, NAN};
  return random.below(6) ? random.uniform(-2, 2) : kSpecials[random.below(std::size(kSpecials))];
}

// Nodes of every operator on nodes of all ages; outputs and guards anywhere, some of them more than once.
Function random_graph(Random& random, std::size_t size) {
  Function f;
  f.name = "random";
  f.inputs = {4, 2, 1};
  std::vector<NodeId> nodes;
  for (int block = 0; block < kBlocks; ++block) {
    for (std::uint32_t i = 0; i < f.inputs[block]; ++i)
      nodes.push_back(f.graph.input(static_cast<Block>(block), i));
  }
  nodes.push_back(f.graph.constant(0.75));
  nodes.push_back(f.graph.constant(-3));
  while (nodes.size() < size) {
    const auto op = static_cast<Op>(random.below(kTableOps));
    const auto pick = [&] {
      return nodes[random.below(2) ? random.below(nodes.size()) : nodes.size() - 1 - random.below(8)];
    };
    const int arity = info(op).arity;
    NodeId a = pick(), b = arity > 1 ? pick() : kNoNode, c = arity > 2 ? pick() : kNoNode;
    // The sign of a NaN is nobody's promise, and copysign would show it.
    if (op == Op::Copysign) b = f.graph.make(Op::Select, f.graph.make(Op::Eq, b, b), b, f.graph.constant(1));
    nodes.push_back(f.graph.make(op, a, b, c));
  }
  for (std::size_t i = 0; i < size / 5; ++i) f.outputs.push_back(nodes[random.below(nodes.size())]);
  for (int i = 0; i < 6; ++i) f.guards.push_back({nodes[random.below(nodes.size())], i % 2 == 0, "here", i});
  return f;
}

// Outputs of one point and its status, node by node.
std::pair<std::vector<double>, std::uint32_t> expected(const Function& f, const double* const* blocks) {
  std::vector<double> value(f.graph.size());
  std::vector<std::vector<double>> results(f.graph.size());
  for (NodeId id = 0; id < f.graph.size(); ++id) {
    const Node& node = f.graph[id];
    if (node.op == Op::Const) {
      value[id] = f.graph.constant_value(id);
    } else if (node.op == Op::Input) {
      value[id] = blocks[node.a][node.b];
    } else if (node.op == Op::Call) {
      const Callee& callee = *f.graph.callees()[node.a];
      std::vector<double> in;
      f.graph.for_each_argument(id, [&](NodeId a) { in.push_back(value[a]); });
      results[id].resize(callee.n_out);
      evaluate(callee, in.data(), results[id].data());
    } else if (node.op == Op::Result) {
      value[id] = results[node.a][node.b];
    } else {
      const int n = info(node.op).arity;
      value[id] =
          evaluate<double>(node.op, value[node.a], n > 1 ? value[node.b] : 0.0, n > 2 ? value[node.c] : 0.0);
    }
  }
  std::vector<double> y;
  for (NodeId id : f.outputs) y.push_back(value[id]);
  std::uint32_t status = 0;
  for (std::size_t g = f.guards.size(); g-- > 0;) {
    if ((value[f.guards[g].condition] != 0) != f.guards[g].expected)
      status = static_cast<std::uint32_t>(g) + 1;
  }
  return {y, status};
}

// Points with gaps between them, one by one and side by side.
void expect_same_bits(const Function& f, std::size_t points, Random& random) {
  const std::size_t gap = random.below(3);
  PointRange range;
  range.points = points;
  range.stride_x = f.n_x() + gap;
  range.stride_p = random.below(2) ? 0 : f.n_p() + gap;  // 0: the same for all
  range.stride_w = f.n_w() + gap, range.stride_y = f.n_y() + gap;
  std::vector<double> x(points * range.stride_x), p(points * (f.n_p() + gap)), w(points * range.stride_w);
  for (auto* block : {&x, &p, &w})
    std::generate(block->begin(), block->end(), [&] { return argument(random); });
  constexpr double kUntouched = 12345;
  std::vector<double> y(points * range.stride_y, kUntouched), one(f.n_y());
  std::vector<std::uint32_t> status(points, 99);
  range.x = x.data(), range.p = p.data(), range.w = w.data(), range.y = y.data();
  range.status = status.data();

  const Interpreter run(f);
  Interpreter::Workspace workspace(run, 8);
  run(range, workspace);
  for (std::size_t i = 0; i < points; ++i) {
    const double* const at[] = {x.data() + i * range.stride_x, p.data() + i * range.stride_p,
                                w.data() + i * range.stride_w};
    const auto [values, word] = expected(f, at);
    EXPECT_EQ(run(at[0], at[1], at[2], one.data(), workspace), word);
    EXPECT_EQ(status[i], word) << "point " << i << " of " << points;
    for (std::size_t k = 0; k < f.n_y(); ++k) {
      ASSERT_TRUE(same(one[k], values[k])) << "output " << k << ": " << one[k] << ", " << values[k];
      ASSERT_TRUE(same(y[i * range.stride_y + k], values[k]))
          << "output " << k << " of point " << i << " of " << points << ": " << y[i * range.stride_y + k]
          << ", " << values[k];
    }
    for (std::size_t k = f.n_y(); k < range.stride_y; ++k) ASSERT_EQ(y[i * range.stride_y + k], kUntouched);
  }
}

TEST(InterpretLanes, RandomGraphsOverEveryOperator) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.seed_text());
    expect_same_bits(random_graph(random, 20 + random.below(3000)), 1 + random.below(20), random);
    if (HasFatalFailure()) return;
  }
}

TEST(InterpretLanes, AnyNumberOfPoints) {
  Random random(7);
  SCOPED_TRACE(random.seed_text());
  const Function f = random_graph(random, 300);
  for (std::size_t points = 0; points <= 26; ++points) expect_same_bits(f, points, random);
}

TEST(InterpretLanes, DerivativesOfPrograms) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.seed_text());
    const testing::Program program = random_program(random, 150);
    expect_same_bits(derive(recorded(program), Order::kSecond).function, 11, random);
    if (HasFatalFailure()) return;
  }
}

// A kernel by hand, and recorded functions that call each other.
TEST(InterpretLanes, Calls) {
  Kernel by_hand;
  by_hand.evaluate = [](const double* in, double* out) {
    out[0] = (in[0] + in[1] + in[2]) / 3;
    out[1] = *std::max_element(in, in + 3);
  };
  const auto kernel = std::make_shared<const Callee>("mean_and_largest", 3, 2, by_hand);
  const auto inner = recorded_callee(record("inner", 2, [&](const VectorXad& v) {
    VectorXad in(3), y(2);
    in << v[0] * v[1], v[0], sin(v[1]);
    y << call(kernel, in);
    return y;
  }));
  const auto outer = recorded_callee(record("outer", 2, [&](const VectorXad& v) {
    VectorXad swapped(2), y(3);
    swapped << v[1], v[0];
    const VectorXad a = call(inner, v), b = call(inner, swapped);
    y << a[0] - b[1], a[1] * b[0], a[0];
    return y;
  }));
  const Function f = record("f", 3, [&](const VectorXad& x) {
    const VectorXad a = call(outer, x.head(2)), b = call(outer, x.tail(2));
    VectorXad c(2), y(4);
    c << a[2], b[0];  // neither a[1] nor b[2] is needed
    y << call(inner, c), a[0] * x[1], b[1];
    return y;
  });
  Random random(11);
  SCOPED_TRACE(random.seed_text());
  for (std::size_t points : {1, 3, 8, 21}) expect_same_bits(f, points, random);
}

TEST(InterpretLanes, AnOutputMayLieWhereAnInputWas) {
  const Function f = record("swap", 2, [](const VectorXad& x) {
    VectorXad y(2);
    y << x[1], x[0] + x[1];
    return y;
  });
  const Interpreter run(f);
  Interpreter::Workspace workspace(run);
  double x[2] = {3, 5};
  run(x, nullptr, nullptr, x, workspace);
  EXPECT_EQ(x[0], 5);
  EXPECT_EQ(x[1], 8);
}

TEST(InterpretLanes, OutputsThatAreInputsOrConstants) {
  Function f;
  f.inputs = {1, 0, 0};
  const NodeId x = f.graph.input(Block::kVariables, 0), two = f.graph.constant(2);
  f.outputs = {two, x, x, f.graph.make(Op::Mul, two, x), two};
  EXPECT_EQ(evaluate(f, {7}), (std::vector<double>{2, 7, 7, 14, 2}));
}

TEST(InterpretLanes, SlotsAreUsedAgainAndWhatIsNotNeededIsLeftOut) {
  constexpr int kSteps = 100000;
  const Function f = record("chain", 1, [](const VectorXad& x) {
    AD v = x[0];
    for (int i = 0; i < kSteps; ++i) v = sin(v) + x[0];
    return VectorXad::Constant(1, v);
  });
  EXPECT_LE(detail::Program(f).slots(), 8u);
  Function cut = f;
  cut.outputs = {2};  // of 200 000 nodes, three are needed
  const detail::Program program(cut);
  std::size_t steps = 0;
  for (const auto& run : program.runs()) steps += run.count;
  EXPECT_LE(steps, 4u);
}

// What makes one lane fast: a run for many operations.
TEST(InterpretLanes, OperationsOfOneKindAreGathered) {
  const Function f = record("products", 40, [](const VectorXad& x) {
    AD sum = 0;
    for (int i = 0; i < 40; ++i) {
      for (int j = 0; j < 40; ++j) sum += x[i] * x[j];
    }
    return VectorXad::Constant(1, sum);
  });
  EXPECT_GT(total_operations(f), 20 * detail::Program(f).runs().size());
}

}  // namespace
}  // namespace dyntape::testing::interpret_lanes_test
