// SPDX-License-Identifier: BSD-3-Clause
//
// When a mesh that will be refined counts as solved, and how steps that leave a curved valley are shortened.  tests/full/solves/known_optima.cpp has
// a problem that needs both.
#include <dyntape/interface/control/nlp/hessian_shift.h>
#include <dyntape/interface/control/nlp/settling.h>
#include <gtest/gtest.h>

namespace dyntape::settled_mesh_test {
namespace {

IterationRecord at(double objective, double violation, bool restores = false) {
  IterationRecord record{};
  record.objective = objective, record.primal_infeasibility = violation, record.restoration = restores;
  return record;
}

TEST(Settling, NeedsFifteenIterationsWithoutChange) {
  Settling settling;
  for (int i = 1; i < 15; ++i) EXPECT_FALSE(settling.note(at(100 + 0.005 * i, 1e-4))) << i;
  EXPECT_TRUE(settling.note(at(100, 1e-4)));
}

TEST(Settling, BeginsAnewWhereTheCostMovesOrARowIsViolated) {
  for (const IterationRecord& disturbance : {at(101, 1e-4), at(100, 1e-2), at(100, 1e-4, true)}) {
    Settling settling;
    for (int i = 1; i < 15; ++i) settling.note(at(100, 1e-4));
    EXPECT_FALSE(settling.note(disturbance));
    for (int i = 1; i < 15; ++i) EXPECT_FALSE(settling.note(at(100, 1e-4))) << i;
  }
}

// A cost that creeps by less than the tolerance at each iteration has not settled.
TEST(Settling, CreepingIsNoRest) {
  Settling settling;
  double cost = 100;
  for (int i = 0; i < 200; ++i) EXPECT_FALSE(settling.note(at(cost *= 1 - 2e-4, 1e-4))) << i;
}

TEST(StepDamping, GrowsWithHalvingsAndGoesAway) {
  StepDamping damping;
  damping.note(1, 0);
  EXPECT_EQ(damping.shift(), 0);
  damping.note(11, 0);
  EXPECT_EQ(damping.shift(), 1e-4);
  damping.note(11, damping.shift());
  EXPECT_EQ(damping.shift(), 8e-4);
  damping.note(4, damping.shift());  // neither long nor short
  EXPECT_EQ(damping.shift(), 8e-4);
  for (int i = 0; i < 10; ++i) damping.note(1, damping.shift());
  EXPECT_EQ(damping.shift(), 0);
}

}  // namespace
}  // namespace dyntape::settled_mesh_test
