// SPDX-License-Identifier: BSD-3-Clause
//
// The order of statements for cards: every value before its users, and fewer live values.
#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/schedule/few_live.h>
#include <dyntape/codegen/schedule/schedule.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "codegen/calls.h"
#include "codegen/random_function.h"

namespace dyntape::few_live_test {
namespace {

using codegen::most_live;
using codegen::with_few_live;

std::vector<NodeId> recorded_order(const Function& f) {
  std::vector<NodeId> order;
  for (NodeId id = 0; id < f.graph.size(); ++id) {
    const Op op = f.graph[id].op;
    if (op != Op::Const && op != Op::Input && op != Op::Result) order.push_back(id);
  }
  return order;
}

// Every value is computed before its users, and none is missing or twice.
void expect_computable(const Function& f, const std::vector<NodeId>& order) {
  std::vector<NodeId> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(sorted, recorded_order(f));
  std::vector<bool> known(f.graph.size(), false);
  for (const NodeId id : order) {
    f.graph.for_each_argument(id, [&](NodeId a) {
      const Node& node = f.graph[a];
      if (node.op == Op::Const || node.op == Op::Input) return;
      EXPECT_TRUE(known[node.op == Op::Result ? node.a : a]) << a << " before " << id;
    });
    known[id] = true;
  }
}

// Two passes over n links, as in forward dynamics: what the first computes the second uses from the other end.
Function two_passes(int n) {
  return record("passes", std::size_t(n), [n](const VectorXad& q) {
    std::vector<AD> turned, moved;
    AD sum = 1;
    for (int i = 0; i < n; ++i) turned.push_back(sin(q[i]) * cos(q[i]));
    for (int i = 0; i < n; ++i) moved.push_back(turned[std::size_t(i)] * turned[std::size_t(i)] + q[i]);
    for (int i = n; i-- > 0;) sum = sum * moved[std::size_t(i)] + turned[std::size_t(i)];
    return VectorXad::Constant(1, sum).eval();
  });
}

TEST(FewLive, ValuesAreComputedBeforeTheirFirstUse) {
  const Function f = two_passes(50);
  const std::vector<NodeId> before = recorded_order(f), order = with_few_live(f, before);
  expect_computable(f, order);
  EXPECT_GE(most_live(f, before), 100u);
  EXPECT_LE(most_live(f, order), 6u);
  const auto of_schedule = [&](codegen::StatementOrder how) {
    return codegen::schedule(f, {{0, 1}}, 1000, Functions::kLibm, how).live;
  };
  EXPECT_GE(of_schedule(codegen::StatementOrder::kRecorded), 100u);
  EXPECT_LE(of_schedule(codegen::StatementOrder::kFewLive), 6u);
}

TEST(FewLive, RandomProgramsAndCalls) {
  testing::Random random(81);
  SCOPED_TRACE(random.seed_text());
  for (int k = 0; k < 20; ++k) {
    const Function f = testing::random_functions(random, 10, 60);
    const std::vector<NodeId> before = recorded_order(f), order = with_few_live(f, before);
    expect_computable(f, order);
    EXPECT_LE(most_live(f, order), most_live(f, before));
  }
  for (int variant = 0; variant < 4; ++variant) {
    const Function f = testing::with_long_calls(variant);
    expect_computable(f, with_few_live(f, recorded_order(f)));
  }
  const Function f = testing::with_calls(testing::kepler());
  expect_computable(f, with_few_live(f, recorded_order(f)));
}

// A recorded order with few live values stays as it is.
TEST(FewLive, AGoodOrderIsKept) {
  const Function f = record("chain", 1, [](const VectorXad& x) {
    AD y = x[0];
    for (int i = 0; i < 100; ++i) y = y * x[0] + 0.5;
    return VectorXad::Constant(1, y).eval();
  });
  EXPECT_EQ(with_few_live(f, recorded_order(f)), recorded_order(f));
}

}  // namespace
}  // namespace dyntape::few_live_test
