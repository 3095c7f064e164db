// SPDX-License-Identifier: BSD-3-Clause
//
// One way to solve: the tasks of doors/ by their files, and by solve() of the problems in them.  tests/python/test_doors.py writes the same
// problems in Python.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include <dyntape/interface/control/solve/solve.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/run/solve/solve.h>

#include "source_folder.h"

namespace dyntape {
namespace doors_test {
namespace {

std::vector<std::string> doors() {
  std::vector<std::string> names;
  for (const auto& entry :
       std::filesystem::directory_iterator(test::source_folder() + "/tests/interface/run/solve/doors"))
    names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

class Doors : public ::testing::TestWithParam<std::string> {};

TEST_P(Doors, LeadToTheSameBits) {
  const Task task =
      read_task(test::source_folder() + "/tests/interface/run/solve/doors/" + GetParam() + ".info");
  const SolveReport by_file = solve_task(task);
  SolveOptions options;
  static_cast<OptimiseOptions&>(options) = task.optimise;
  options.demands = task.demands;
  options.refinements = task.demands.refinements;
  options.cost_change = HUGE_VAL;
  options.is_graded = false;
  const Solution by_program = solve(task.problem, options);
  const Solution& solution = by_file.solution;
  EXPECT_EQ(by_file.success(), by_program.success());
  EXPECT_EQ(solution.verdict(), by_program.verdict());
  EXPECT_EQ(solution.cost(), by_program.cost());
  EXPECT_EQ(solution.nlp.x, by_program.nlp.x);
  ASSERT_EQ(solution.meshes.size(), by_program.meshes.size());
  for (std::size_t k = 0; k < solution.meshes.size(); ++k) {
    const MeshRound &a = solution.meshes[k], &b = by_program.meshes[k];
    EXPECT_EQ(a.intervals, b.intervals);
    EXPECT_EQ(a.iterations, b.iterations);
    EXPECT_EQ(a.cost, b.cost);
    EXPECT_EQ(a.relative_defect, b.relative_defect);
    EXPECT_EQ(a.status, b.status);
  }
}

INSTANTIATE_TEST_SUITE_P(Tasks, Doors, ::testing::ValuesIn(doors()),
                         [](const auto& door) { return door.param; });

TEST(Doors, AreTwelve) { EXPECT_EQ(doors().size(), 12u); }

}  // namespace
}  // namespace doors_test
}  // namespace dyntape
