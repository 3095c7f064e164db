// SPDX-License-Identifier: BSD-3-Clause
//
// Tasks without a file: what a program fills in is solved as a file is that says the same.
#include <gtest/gtest.h>

#include <numbers>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/files/task/task_faults.h>
#include <dyntape/interface/run/solve/solve.h>
#include "dynamics/robot_files.h"
#include "task_text.h"

namespace dyntape::task_spec_test {
namespace {

using Eigen::Vector3d;
using Eigen::Vector4d;

TaskSpec swing_up() {
  TaskSpec spec;
  spec.name = "swing-up";
  spec.scene = {dynamics::load_urdf(dynamics::robot_file("cart_pole")), {}, {"slider"}};
  spec.robot.duration = 2;
  spec.start = Vector4d(0, 0, 0, 0);
  spec.goal = Vector4d(1, std::numbers::pi, 0, 0);
  spec.costs.control = 1;
  spec.optimise.mesh.evaluation.route = Route::kInterpreter;
  return spec;
}

class SpecOfFile : public test::TaskText {
 protected:
  SpecOfFile() : TaskText("spec") {}
};

std::string refusal(const TaskSpec& spec) {
  try {
    build_task(spec);
  } catch (const ArgumentError& e) {
    return e.what();
  }
  return "nothing refused";
}

TEST_F(SpecOfFile, ATaskFilledInByAProgramHasTheOptimumOfItsFile) {
  load("cart_pole_swing_up");
  const SolveReport of_file = solve_task(read());
  const SolveReport of_program = solve_task(build_task(swing_up()));
  EXPECT_TRUE(of_program.success()) << of_program.text();
  EXPECT_EQ(of_program.solution.cost(), of_file.solution.cost());
  EXPECT_EQ(of_program.iterations(), of_file.iterations());
  EXPECT_EQ(of_program.solution.motion.x, of_file.solution.motion.x);
}

// A file that is changed as data; built anew it is the task of a file that says so.
TEST_F(SpecOfFile, WhatAFileSaysIsChangedBeforeItIsBuilt) {
  load("cart_pole_swing_up");
  write_file_atomically((folder_ / "task.info").string(), text_);
  TaskSpec spec = read_task_spec((folder_ / "task.info").string());
  EXPECT_EQ(spec.costs.control, 1);
  spec.costs.effort = 0.5;
  spec.terms.push_back({.name = "high",
                        .type = "frame_position",
                        .frame = "tip",
                        .entries = {"z"},
                        .lower = Eigen::VectorXd::Zero(1)});
  spec.terms.back().penalty = Huber{3, 0.2};
  spec.waypoints.push_back({"over there", 0.4, {}, Eigen::Vector2d(0.2, 1)});
  const Task changed = build_task(spec);
  replace("control 1\n", "control 1\n effort 0.5\n");
  text_ +=
      "\nterms {\n term high {\n type frame_position\n frame tip\n entries z\n lower 0\n penalty huber\n"
      " width 0.2\n weight 3\n }\n}\nwaypoints {\n waypoint \"over there\" {\n at 0.4\n q \"0.2 1\"\n }\n}\n";
  const Task said = read();
  ASSERT_EQ(changed.problem.terms.size(), said.problem.terms.size());
  const Stage<double> guess = said.problem.first_guess(0.8);
  const Stage<double> s = said.problem.stage(0.8, guess.x, guess.a, guess.u);
  for (std::size_t k = 0; k < said.problem.terms.size(); ++k) {
    EXPECT_EQ(changed.problem.terms[k].name, said.problem.terms[k].name);
    EXPECT_EQ(changed.problem.terms[k].where, said.problem.terms[k].where);
    EXPECT_EQ(changed.problem.terms[k].function(s), said.problem.terms[k].function(s));
  }
}

// What a reader tells at its place in a file is told of a program by the keys.
TEST(TaskSpecs, WhatDoesNotGoTogetherIsTold) {
  EXPECT_EQ(refusal(swing_up()), "nothing refused");
  const auto expect = [](const TaskSpec& spec, const std::vector<std::string>& words) {
    const std::string told = refusal(spec);
    for (const std::string& word : words)
      EXPECT_NE(told.find(word), std::string::npos) << word << "\n" << told;
  };
  TaskSpec spec = swing_up();
  spec.costs.time = 1, spec.costs.tracking_position = 2;
  expect(spec, {"task \"swing-up\": 'costs.tracking.position' weighs a distance to 'goal.frame.position'",
                "'costs.time' weighs the duration, which is given"});
  spec = swing_up(), spec.start = Vector3d(0, 0, 0);
  expect(spec, {"'start' has 3 entries, expected 4"});
  spec = swing_up(), spec.by_ddp = true;
  expect(spec, {"'goal' is to be met at the end, which the method ddp does not support"});
  spec = swing_up(), spec.goal[0] = 7;
  expect(spec, {"task \"swing-up\": the goal of \"q.slider\" is 7, the robot's limits are -2 and 2"});
  const auto with_term = [](TermSpec term) {
    TaskSpec with = swing_up();
    with.terms.push_back(std::move(term));
    return with;
  };
  expect(with_term({.name = "here", .type = "frame_positon"}),
         {"terms.here.type", "'frame_positon'", "frame_position"});
  expect(with_term({.name = "here", .type = "com", .entries = {"w"}}), {"terms.here.entries", "'w'"});
  expect(with_term({.name = "here", .type = "com", .role = Role::kInequality}),
         {"an inequality needs 'lower', 'upper' or both"});
  expect(with_term({.name = "here", .type = "torque", .moves = CircularTarget{}}), {"does not move"});
}

// What is left out of a program is what is left out of a file.
TEST(TaskSpecs, EmptyStatesAreOpenAndEmptyWeightsZero) {
  TaskSpec spec = swing_up();
  spec.goal = {};
  EXPECT_TRUE(faults_of(spec).empty());
  const TaskSpec full = completed(spec);
  EXPECT_TRUE(full.goal.size() == 4 && full.goal.array().isNaN().all());
  EXPECT_EQ(full.costs.tracking_q, Eigen::VectorXd::Zero(2));
  spec = swing_up();
  spec.phases.resize(2);
  spec.phases[0].name = "first", spec.phases[0].duration = 0.5, spec.phases[1].name = "second";
  const Task task = build_task(spec);
  ASSERT_EQ(task.parts.size(), 2u);
  EXPECT_EQ(task.parts[0].problem.duration, 0.5);
  EXPECT_EQ(task.parts[1].problem.duration, 2);
  EXPECT_EQ(task.parts[1].optimise.mesh.intervals, 40);
}

}  // namespace
}  // namespace dyntape::task_spec_test
