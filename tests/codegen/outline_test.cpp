// SPDX-License-Identifier: BSD-3-Clause
//
// Repeated parts as functions: what is found, that the text gets shorter and that no bit changes.
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/options/lane_widths.h>
#include <dyntape/codegen/passes/outline.h>
#include <dyntape/codegen/passes/repeats.h>
#include <dyntape/codegen/pipeline.h>
#include <gtest/gtest.h>

#include "compilers.h"
#include "random_function.h"

namespace dyntape::outline_test {
namespace {

using testing::Random;
using testing::same;

// A body with legs: what happens along a leg begins with the body's state, what the legs exert comes together at
// the body, and goes out to the legs once more.
struct Walker {
  int legs = 4, steps = 60;
  bool mirrored = true;  // the legs differ in constants and their signs
  int odd_leg = -1;      // this one is built differently
  bool guarded = false;
};

Function record_walker(const Walker& walker) {
  const int n = 3 + 4 * walker.legs;
  return record("walker", n, [&](const VectorXad& x) {
    VectorXad y = VectorXad::Zero(3 + 7 * walker.legs);
    const auto run = [&](int leg, AD a, AD b, int steps) {
      const VectorXad q = x.segment(3 + 4 * leg, 4);
      const double side = walker.mirrored ? (leg % 2 ? -0.5 : 0.5) : 0.5,
                   length = walker.mirrored ? 1.5 + 0.25 * leg : 1.5;
      for (int k = 0; k < steps; ++k) {
        const AD s = sin(q[k % 4]), c = leg == walker.odd_leg ? exp(q[k % 4]) : cos(q[(k + 1) % 4]);
        const AD next = a * s + b * c * (side + k);
        b = (b * s - a * c) * length + 0.125;
        a = next / (2.0 + next * next);
      }
      return a + b * q[3];
    };
    std::vector<AD> exerted;
    for (int leg = 0; leg < walker.legs; ++leg) {
      exerted.push_back(run(leg, x[0] + 0.5 * (leg + 1), x[1], walker.steps));
      if (walker.guarded && x[3 + 4 * leg] < 100.0) exerted.back() += x[4 + 4 * leg];
      for (int k = 0; k < 6; ++k) y[3 + 7 * leg + k] = exerted[leg] * x[3 + 4 * leg] + cos(x[2]) * (k + 1.0);
    }
    AD sum = x[2];
    for (const AD& e : exerted) sum += e;
    for (int leg = 0; leg < walker.legs; ++leg)
      y[9 + 7 * leg] = run(leg, sum, exerted[leg] * sum, walker.steps / 2);
    y[0] = sum, y[1] = sum * x[0];
    return y;
  });
}

std::size_t operations_of(const Function& f) {
  std::size_t operations = 0;
  for (const Node& node : f.graph.nodes()) operations += static_cast<int>(node.op) < kTableOps;
  return operations;
}

// Each callee once.
std::size_t operations_in_text(const Function& f) {
  std::size_t operations = operations_of(f);
  for (const auto& callee : f.graph.callees()) operations += operations_of(*callee->recorded()->function);
  return operations;
}

TEST(Repeats, LegsAreFoundWhateverTheirConstants) {
  for (const int legs : {2, 3, 4, 6}) {
    for (const bool mirrored : {true, false}) {
      SCOPED_TRACE(std::to_string(legs) + " legs" + (mirrored ? ", mirrored" : ""));
      const Function f = compact(record_walker({legs, 60, mirrored, -1, false}));
      const codegen::Repeats repeats = codegen::find_repeats(f);
      ASSERT_EQ(repeats.count, static_cast<std::size_t>(legs));
      EXPECT_GT(repeats.nodes.size() * repeats.count, total_operations(f) * 6 / 10);
      for (const auto& nodes : repeats.nodes) {
        ASSERT_EQ(nodes.size(), repeats.count);
        for (NodeId id : nodes) EXPECT_EQ(f.graph[id].op, f.graph[nodes[0]].op);
      }
    }
  }
}

TEST(Outline, TheTextOfFourLegsIsHalf) {
  const Function f = compact(record_walker({4, 120, true, -1, false}));
  const Function shorter = codegen::outlined(f);
  EXPECT_LT(operations_in_text(shorter) * 2, total_operations(f));
  EXPECT_FALSE(shorter.graph.callees().empty());
}

TEST(Outline, NothingToShareOrTooShortStaysAsItIs) {
  Random random(801);
  SCOPED_TRACE(random.seed_text());
  const Function shortest = compact(record_walker({2, 20, true, -1, false}));
  const Function chain = compact(record("chain", 8, [](const VectorXad& x) {
    AD a = x[0];
    for (int k = 0; k < 2000; ++k) a = sin(a) * x[k % 8] + cos(a);
    return VectorXad::Constant(1, a).eval();
  }));
  for (const Function* f : {&shortest, &chain}) {
    const Function same_function = codegen::outlined(*f);
    EXPECT_TRUE(same_function.graph.callees().empty());
    EXPECT_EQ(content_hash(same_function), content_hash(*f));
  }
}

TEST(Outline, ALegOfAnotherKindIsLeftAlone) {
  const Function f = compact(record_walker({3, 200, true, 1, false}));
  const Function shorter = codegen::outlined(f);
  EXPECT_LE(operations_in_text(shorter), total_operations(f) + 8);
}

// Compiled against the interpreter.
void expect_interpreted_bits(const Function& f, Order order, Random& random) {
  CodegenOptions options;
  options.order = order;
  options.use_cache = false;
  options.route = Route::kInterpreter;
  const CompiledFunction reference = CompiledFunction::make(f, options);
  options.route = Route::kCompiled;
  const CompiledFunction compiled = CompiledFunction::make(f, options);
  CompiledFunction::Workspace alone(reference), workspace(compiled);
  for (const std::size_t count : {1, 8, 19}) {
    const std::size_t n = f.n_x(), nj = order == Order::kValue ? 0 : reference.jacobian_pattern().nnz();
    const std::vector<double> x = random.vector(n * count, -2, 2);
    std::vector<double> y(f.n_y() * count), j(nj * count), expected_y(y), expected_j(j);
    std::vector<std::uint32_t> status(count, 9), expected_status(count, 9);
    (void)reference.run(order,
                        {count, x.data(), nullptr, nullptr, expected_y.data(), expected_j.data(), nullptr,
                         nullptr, expected_status.data()},
                        alone);
    (void)compiled.run(
        order, {count, x.data(), nullptr, nullptr, y.data(), j.data(), nullptr, nullptr, status.data()},
        workspace);
    EXPECT_EQ(status, expected_status);
    for (std::size_t i = 0; i < y.size(); ++i) ASSERT_TRUE(same(y[i], expected_y[i])) << "y[" << i << "]";
    for (std::size_t i = 0; i < j.size(); ++i)
      ASSERT_TRUE(same(j[i], expected_j[i])) << "jacobian[" << i << "]";
  }
}

TEST(Outline, BitsAreThoseOfTheInterpreter) {
  Random random(802);
  SCOPED_TRACE(random.seed_text());
  for (const Walker& walker : {Walker{4, 120, true, -1, false}, Walker{2, 180, false, -1, true}}) {
    const Function f = compact(record_walker(walker));
    EXPECT_FALSE(codegen::outlined(f).graph.callees().empty());
    expect_interpreted_bits(f, Order::kValue, random);
  }
  expect_interpreted_bits(record_walker({3, 130, true, -1, false}), Order::kValue, random);
  expect_interpreted_bits(record_walker({4, 24, true, -1, true}), Order::kFirst, random);
}

TEST(Outline, TheTextPleasesCompilersAtEveryWidth) {
  CodegenOptions options;
  options.order = Order::kValue;
  const std::string text = generate_source(record_walker({4, 90, true, -1, true}), options).text;
  EXPECT_NE(text.find("dt_1_part"), std::string::npos);
  testing::expect_compiles_cleanly({text});
  for (unsigned width : codegen::lane_widths(Lanes::kNative))
    testing::expect_compiles_cleanly({text}, codegen::lane_flags(width));
}

}  // namespace
}  // namespace dyntape::outline_test
