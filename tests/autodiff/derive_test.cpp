// SPDX-License-Identifier: BSD-3-Clause
//
// How derivatives are put together: which nodes come next, and which outputs are kept.
#include <dyntape/autodiff/derive/derive.h>

#include <numeric>
#include <random>
#include <set>

#include <dyntape/autodiff/derive/next_nodes.h>
#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <gtest/gtest.h>

#include "random_program.h"

namespace dyntape::testing::derive_test {
namespace {

TEST(NextNodes, ComeInOrderAndOnce) {
  for (const std::size_t size : {1u, 64u, 65u, 4096u, 4097u, 300'000u}) {
    std::mt19937_64 engine(size);
    std::uniform_int_distribution<NodeId> any(0, static_cast<NodeId>(size - 1));
    NextNodes next(size);
    std::set<NodeId> expected;
    EXPECT_TRUE(next.empty());
    for (int i = 0; i < 2000; ++i) {
      const NodeId id = any(engine);
      next.push(id), expected.insert(id);
      if (i % 3 != 0) continue;
      ASSERT_EQ(next.pop(), *expected.begin());
      expected.erase(expected.begin());
    }
    for (NodeId id : expected) {
      ASSERT_FALSE(next.empty());
      ASSERT_EQ(next.pop(), id);
    }
    EXPECT_TRUE(next.empty());
  }
}

// To leave out the values earlier changes nothing of the derivatives.
void expect_outputs_of_derive(const Function& f) {
  const auto chosen = [](const Function& all, std::size_t first) {
    std::vector<std::size_t> outputs(all.n_y() - first);
    std::iota(outputs.begin(), outputs.end(), first);
    return select_outputs(all, outputs);
  };
  const Derivatives first = derive(f, Order::kFirst), second = derive(f, Order::kSecond);
  EXPECT_EQ(content_hash(sparse_jacobian(f).function), content_hash(chosen(first.function, f.n_y())));
  EXPECT_EQ(content_hash(sparse_hessian(f).function),
            content_hash(chosen(second.function, f.n_y() + second.jacobian.nnz())));
}

TEST(SparseDerivatives, AreTheOutputsOfDerive) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    expect_outputs_of_derive(recorded(random_program(random, 40)));
  }
}

TEST(SparseDerivatives, AreTheOutputsOfDeriveOfWhatDissolves) {
  const Function inner = record("inner", 2, [](const VectorXad& x) {
    VectorXad y(2);
    y << sin(x[0]) * x[1], x[0] / x[1];
    return y;
  });
  Function f;
  f.name = "f";
  f.inputs = {2, 0, 0};
  const NodeId x = f.graph.input(Block::kVariables, 0), y = f.graph.input(Block::kVariables, 1);
  f.outputs = f.graph.call(dissolving_callee(inner), {f.graph.make(Op::Mul, x, y), y});
  expect_outputs_of_derive(f);
}

// Where ways to a Jacobian are tried, the cheapest is taken, whichever is tried first: counted by hand.
TEST(Jacobian, IsTheCheapestThatWasTried) {
  const auto operations = [](std::size_t n_x, auto&& body) {
    return total_operations(sparse_jacobian(record("f", n_x, body)).function);
  };
  // Two outputs of many variables: of the sum of squares 39, sine and cosine, and two a variable and output.
  const std::size_t wide = operations(20, [](const VectorXad& x) {
    AD sum = 0;
    for (int i = 0; i < 20; ++i) sum += x[i] * x[i];
    VectorXad y(2);
    y << sin(sum), cos(sum);
    return y;
  });
  EXPECT_LE(wide, 121u);
  // Many outputs of two variables: forward.
  const std::size_t tall = operations(2, [](const VectorXad& x) {
    const AD product = sin(x[0] * x[1]);
    VectorXad y(20);
    for (int i = 0; i < 20; ++i) y[i] = product * (i + 2.0);
    return y;
  });
  EXPECT_LE(tall, 2u + 2u + 2u * 20u);
}

}  // namespace
}  // namespace dyntape::testing::derive_test
