// SPDX-License-Identifier: BSD-3-Clause
//
// Conditions: what is the same is one condition, and large ones do not make the derivation slow.
#include <dyntape/autodiff/derive/condition.h>
#include <gtest/gtest.h>

namespace dyntape::testing::condition_test {
namespace {

struct ConditionsOf : ::testing::Test {
  ConditionId is(std::uint32_t index) { return all.is(graph.input(Block::kWeights, index)); }

  Graph graph;
  Conditions all{graph};
};

TEST_F(ConditionsOf, AlternativesAreOneConditionHoweverTheyComeTogether) {
  const ConditionId a = is(0), b = is(1), c = is(2), d = is(3);
  const ConditionId abc = all.either(all.either(a, b), c);
  EXPECT_EQ(all.either(a, all.either(c, b)), abc);
  EXPECT_EQ(all.either(all.either(b, c), all.either(a, b)), abc);
  EXPECT_EQ(all.either(abc, b), abc);
  EXPECT_EQ(all.either(all.either(a, c), abc), abc);
  EXPECT_NE(all.either(all.either(a, c), d), all.either(abc, d));
}

TEST_F(ConditionsOf, AlternativesOfConjunctionsAreKeptApart) {
  const ConditionId a = is(0), b = is(1), c = is(2);
  const ConditionId both = all.both(a, b);
  EXPECT_EQ(all.either(all.either(both, c), both), all.either(c, both));
  EXPECT_NE(all.either(both, c), all.either(a, c));
  EXPECT_EQ(all.either(both, a), a);
}

// Each node holds what it says for all values of three weights.
TEST_F(ConditionsOf, TruthIsThatOfItsParts) {
  const ConditionId a = is(0), b = is(1), c = is(2);
  const ConditionId condition =
      all.both(all.either(all.either(a, b), c), all.is(graph.input(Block::kWeights, 1), false));
  const NodeId node = all.truth(condition);
  for (int bits = 0; bits < 8; ++bits) {
    const auto value = [&](auto&& self, NodeId id) -> double {
      const Node& n = graph[id];
      if (n.op == Op::Const) return graph.constant_value(id);
      if (n.op == Op::Input) return (bits >> n.b) & 1;
      return evaluate<double>(n.op, self(self, n.a), self(self, n.b), self(self, n.c));
    };
    EXPECT_EQ(value(value, node) != 0, bits != 0 && (bits & 2) == 0) << bits;
  }
}

// A sum of a hundred thousand weighted terms: beyond a few parts sets are not compared.
TEST_F(ConditionsOf, ManyAlternativesComeTogetherInTime) {
  constexpr std::uint32_t kMany = 100000;
  ConditionId any = kNever;
  for (std::uint32_t i = 0; i < kMany; ++i) any = all.either(any, is(i));
  const std::size_t before = graph.size();
  (void)all.truth(any);
  EXPECT_LT(graph.size() - before, kMany + 10);
}

}  // namespace
}  // namespace dyntape::testing::condition_test
