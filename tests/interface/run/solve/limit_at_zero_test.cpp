// SPDX-License-Identifier: BSD-3-Clause
//
// Limits that are zero, or nearly: what solvers leave of a bound is no excess there either.
#include <dyntape/interface/run/solve/solve.h>
#include "interface/files/task/task_text.h"

namespace dyntape::limit_at_zero_test {
namespace {

// A kilogram on a rail that begins at zero, thrown towards its end and back.
class LimitAtZero : public test::TaskText {
 protected:
  LimitAtZero() : TaskText("limit-at-zero") {
    write_file_atomically(
        (folder_ / "slider.urdf").string(),
        "<robot name=\"slider\"><link name=\"world\"/><link name=\"block\"><inertial><mass value=\"1\"/>"
        "<inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>"
        "<joint name=\"rail\" type=\"prismatic\"><parent link=\"world\"/><child link=\"block\"/>"
        "<axis xyz=\"1 0 0\"/><limit lower=\"0\" upper=\"2\" velocity=\"9\" effort=\"99\"/></joint></robot>");
    text_ =
        "robot { urdf slider.urdf }\nhorizon {\n duration 1.5\n intervals 20\n}\nstart {\n q 0.1\n v "
        "-1.5\n}\n"
        "goal {\n q 0.1\n v 1.5\n}\ncosts { control 1 }\n";
  }
};

TEST_F(LimitAtZero, AMotionMayRestOnIt) {
  for (const char* method : {"ipopt", "riccati"}) {
    const std::string text = text_;
    text_ += std::string("solver { method ") + method + " }\n";
    const SolveReport report = solve_task(read());
    EXPECT_TRUE(report.success()) << report.verdict();
    EXPECT_NEAR(report.solution.motion.x.row(0).minCoeff(), 0, 2e-8);  // it does come there
    text_ = text;
  }
}

TEST_F(LimitAtZero, BeyondItIsAnExcess) {
  const Task task = read();
  StagedNlp program = discretize(task.problem, task.optimise.mesh);
  Trajectory motion = program.trajectory(program.start());
  EXPECT_TRUE(limit_excesses(task, motion).empty());
  for (const auto& [beyond, count] : {std::pair(5e-9, 0u), {1e-5, 1u}}) {
    motion.x(0, 20) = -beyond;
    EXPECT_EQ(limit_excesses(task, motion).size(), count) << beyond;
  }
}

}  // namespace
}  // namespace dyntape::limit_at_zero_test
