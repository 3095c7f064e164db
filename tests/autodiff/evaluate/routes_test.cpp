// SPDX-License-Identifier: BSD-3-Clause
//
// 1000 random programs over every operator, and every route to their values and derivatives.  tests/full/fuzz
// runs as many as one likes.
#include <gtest/gtest.h>

#include <set>

#include "routes.h"

namespace dyntape::testing::routes_test {
namespace {

class RandomPrograms : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(RandomPrograms, AllRoutesAgree) {
  std::set<Op> met;
  for (std::uint64_t seed = GetParam(); seed < GetParam() + 100; ++seed) {
    Random random(seed);
    const Program program = random_program(random, 10 + random.below(60));
    for (const Instruction& i : program.instructions) met.insert(i.op);
    const std::string found = disagreement(program, seed);
    if (found.empty()) continue;
    ADD_FAILURE() << random.seed_text() << ": " << found << "\nshrunk, "
                  << shrunk_disagreement(program, seed);
    return;
  }
  EXPECT_EQ(met.size(), static_cast<std::size_t>(kTableOps)) << "an operator was never drawn";
}

INSTANTIATE_TEST_SUITE_P(Hundreds, RandomPrograms,
                         ::testing::Values(0, 100, 200, 300, 400, 500, 600, 700, 800, 900));

}  // namespace
}  // namespace dyntape::testing::routes_test
