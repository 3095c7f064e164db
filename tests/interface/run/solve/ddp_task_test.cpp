// SPDX-License-Identifier: BSD-3-Clause
//
// Task files solved by differential dynamic programming: what comes of them, and what the method does not know.
#include <nlohmann/json.hpp>

#include <dyntape/interface/run/solve/solve.h>
#include "interface/files/task/task_text.h"

namespace dyntape::ddp_task_test {
namespace {

class DdpTasks : public test::TaskText {
 protected:
  DdpTasks() : TaskText("ddp") { load("cart_pole_ddp"); }

  // Changed, it has another optimum.
  Task changed() const {
    Task task = read();
    task.expected.reset();
    return task;
  }
};

// The lower of the known optima with a goal that is demanded is 57.94502 (M. Kelly's problem, from a guess that swings the other
// way); where costs draw to it, the goal is missed a little and the cost less.
TEST_F(DdpTasks, TheShippedTaskSwingsUp) {
  const Task task = read();
  SolveReport report = solve_task(task);
  EXPECT_TRUE(report.success()) << report.text();
  EXPECT_LT(report.solution.cost(), 57.94502);
  EXPECT_GT(report.solution.cost(), 57.9);
  ASSERT_TRUE(report.ddp);
  EXPECT_EQ(report.ddp->is_minimum, true);
  EXPECT_LT(report.ddp->off_goal, 0.01);
  EXPECT_GT(report.ddp->off_goal, 0);
  EXPECT_LT(report.ddp->slope, 1e-4);
  EXPECT_EQ(report.sizes.variables, 100u);
  const std::string out = (folder_ / "out").string();
  write_results(task, report, out);
  for (const std::string& sentence : report.unwritten) ADD_FAILURE() << sentence;
  for (const std::string& file : result_files())
    EXPECT_TRUE(std::filesystem::exists(std::filesystem::path(out) / file)) << file;
  const auto json = nlohmann::json::parse(report.json());
  EXPECT_TRUE(json["success"].get<bool>());
  EXPECT_EQ(json["ddp"]["from_goal"].get<double>(), report.ddp->off_goal);
  EXPECT_NE(explain(task).find("100 steps of"), std::string::npos);
}

// The same file by the other methods, in one line.
TEST_F(DdpTasks, AnotherMethodIsAnotherLine) {
  replace("intervals 100", "intervals 25");
  for (const char* method : {"riccati", "ipopt"}) {
    replace(method == std::string("riccati") ? "method ddp" : "method riccati",
            std::string("method ") + method);
    const SolveReport report = solve_task(changed());
    EXPECT_TRUE(report.success()) << report.text();
    EXPECT_FALSE(report.ddp);
  }
}

TEST_F(DdpTasks, LongStepsAreHalved) {
  replace("intervals 100", "intervals 12");
  const SolveReport report = solve_task(changed());
  EXPECT_TRUE(report.success()) << report.text();
  EXPECT_GT(report.meshes.size(), 1u);
  EXPECT_EQ(report.meshes[1].intervals, 24);
  EXPECT_LE(report.solution.verification.worst_relative, 1e-3);
}

// Limits of controls are kept, and said.
TEST_F(DdpTasks, LimitsOfControlsHold) {
  replace("method ddp", "method ddp\n  max_iterations 2000");
  replace("solver {", "bounds {\n  efforts 12\n}\nsolver {");
  const SolveReport report = solve_task(changed());
  EXPECT_TRUE(report.solution.success()) << report.text();
  EXPECT_LE(report.solution.motion.u.cwiseAbs().maxCoeff(), 12);
  EXPECT_GT(report.active.size(), 3u);
  EXPECT_EQ(report.active.front().substr(0, 16), "u.slider at node");
}

TEST_F(DdpTasks, EulerAndGaussNewton) {
  replace("solver {", "transcription {\n  scheme euler\n  hessian gauss_newton\n}\nsolver {");
  replace("method ddp", "method ddp\n  tolerance 1e-5\n  max_iterations 2000");
  replace("intervals 100", "intervals 400");
  replace("solver {", "verify {\n  integration_error 1\n}\nsolver {");
  const SolveReport report = solve_task(changed());
  EXPECT_TRUE(report.success()) << report.text();
  EXPECT_FALSE(report.ddp->is_minimum);  // nobody knows
}

TEST_F(DdpTasks, WhatTheMethodDoesNotKnowIsRefusedWhereItStands) {
  const std::string whole = text_;
  const auto refusal = [&](const std::string& old, const std::string& with) {
    text_ = whole;
    replace(old, with);
    return message();
  };
  const auto expect = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect(refusal("  tracking {\n    end {\n      q 1e4\n      v 1e3\n    }\n  }\n", ""),
         "'goal' is to be met at the end, which the method ddp does not support; expected weights of the "
         "distance from it");
  expect(refusal("duration  2", "duration 2\n min_duration 1\n max_duration 3"),
         "'horizon.min_duration' is of a duration to be found, which the method ddp does not support; "
         "expected a given one");
  expect(refusal("solver {", "transcription {\n scheme trapezoid\n}\nsolver {"),
         "expected runge-kutta-4, which is the default, or semi-implicit-euler");
  expect(refusal("solver {", "transcription {\n dynamics inverse\n}\nsolver {"), "expected forward");
  expect(refusal("solver {", "transcription {\n hessian limited_memory\n}\nsolver {"),
         "expected exact or gauss_newton");
  expect(refusal("solver {", "bounds {\n positions robot\n}\nsolver {"),
         "'bounds.positions' are limits of states, which the method ddp does not support; expected none");
  expect(refusal("method ddp", "method ddp\n ipopt {\n mu_init 0.1\n }"), "expected the method ipopt");
  expect(refusal("method ddp", "method dpp"), "ddp");
  expect(refusal("start {", "start {\n free pivot"),
         "'solver.method' is ddp: problem \"task\": the start of the state \"q.pivot\" is free");
}

TEST_F(DdpTasks, AStopBeforeTheFirstIterationLeavesNoMotion) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(solve_task(read(), {.stop = stop.get_token()}), Interrupted);
}

}  // namespace
}  // namespace dyntape::ddp_task_test
