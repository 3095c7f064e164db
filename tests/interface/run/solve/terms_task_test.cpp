// SPDX-License-Identifier: BSD-3-Clause
//
// Tasks that say where a hand shall be and what it keeps clear of.
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/run/solve/pictures.h>
#include <dyntape/interface/run/solve/solve.h>
#include "interface/files/task/task_text.h"
#include "source_folder.h"

namespace dyntape::terms_task_test {
namespace {

namespace fs = std::filesystem;

class Places : public test::TaskText {
 protected:
  Places() : TaskText("places") { load("arm_around_obstacles"); }

  // Removes a block of the first level.
  void remove(const std::string& block) {
    const std::size_t at = text_.find("\n" + block + " {");
    ASSERT_NE(at, std::string::npos) << block;
    text_.erase(at, text_.find("\n}", at) + 2 - at);
  }
};

double least_clearance(const Task& task, const Trajectory& motion, int looks) {
  double least = HUGE_VAL;
  std::vector<double> times;
  for (int p = 0; p + 1 < motion.points(); ++p) {
    for (int k = 0; k < looks; ++k)
      times.push_back(motion.t[p] + (motion.t[p + 1] - motion.t[p]) * k / looks);
  }
  const Trajectory fine = resampled(task.problem, motion, times);
  for (int p = 0; p < fine.points(); ++p) {
    for (const auto& pair : task.around.apart)
      least = std::min(least, clearance(task.scene.model, fine.x.col(p).head(7), pair.a, pair.b));
  }
  return least;
}

TEST_F(Places, TheArmReachesItsPoseAndKeepsClear) {
  const Task task = read();
  ASSERT_EQ(task.around.apart.size(), 4u);
  const SolveReport report = solve_task(task);
  ASSERT_TRUE(report.success()) << report.verdict();
  const Trajectory& motion = report.solution.motion;
  const Eigen::VectorXd end = motion.x.col(motion.points() - 1);

  dynamics::Data<double> data(task.scene.model);
  dynamics::forward_kinematics(task.scene.model, data, Eigen::VectorXd(end.head(7)));
  const auto X = frame_placement(task.scene.model, data, task.scene.model.frame_index("panda_hand"));
  EXPECT_LT((X.p - Eigen::Vector3d(0.4, 0.35, 0.3)).norm(), 1e-6);
  const Eigen::Matrix3d down = Eigen::Vector3d(1, -1, -1).asDiagonal();
  EXPECT_LT((X.R - down).norm(), 1e-6);
  EXPECT_LT(end.tail(7).norm(), 1e-12);

  EXPECT_GT(least_clearance(task, motion, 1), -1e-7);   // at the points of the mesh
  EXPECT_GT(least_clearance(task, motion, 10), -3e-4);  // between them, by what verification allows
}

TEST_F(Places, WithoutObstaclesItWouldCollide) {
  const Task with = read();
  remove("obstacles");
  remove("bodies");
  remove("expected");
  const Task without = read();
  const SolveReport report = solve_task(without);
  ASSERT_TRUE(report.success()) << report.verdict();
  EXPECT_LT(least_clearance(with, report.solution.motion, 1), -0.05);
}

TEST_F(Places, MotionsThatPassThroughAreReported) {
  const Task task = read();
  const StagedNlp nlp = discretize(task.problem, task.optimise.mesh);
  Trajectory motion = nlp.trajectory(nlp.start());
  const std::vector<LimitExcess> excesses = limit_excesses(task, motion);
  const auto is_hand = [](const LimitExcess& e) { return e.joint == "hand from post"; };
  const auto found = std::find_if(excesses.begin(), excesses.end(), is_hand);
  ASSERT_NE(found, excesses.end());
  EXPECT_LT(found->value, -0.05);
  EXPECT_FALSE(found->between_points);
  EXPECT_NE(found->text().find("clearance of hand from post is -0."), std::string::npos) << found->text();
  EXPECT_NE(found->text().find("to be at least 0"), std::string::npos) << found->text();
}

TEST_F(Places, TheGuessEndsInThePose) {
  const Task task = read();
  for (const std::string& note : task.notes) EXPECT_EQ(note.find("out of reach"), std::string::npos) << note;
  const auto& goal = task.problem.terms.front();
  EXPECT_EQ(goal.name, "goal of panda_hand");
  EXPECT_LT(goal.function(task.problem.guess(2)).norm(), 1e-8);
  EXPECT_GT(goal.function(task.problem.guess(0)).norm(), 0.1);
  EXPECT_TRUE(task.problem.goal.head(7).array().isNaN().all());
  EXPECT_TRUE(task.problem.goal.tail(7).isZero(0));
}

TEST_F(Places, WhatIsOutOfReachIsNoted) {
  replace("0.4 0.35 0.3", "1.4 0.35 0.3");
  const Task task = read();
  ASSERT_FALSE(task.notes.empty());
  EXPECT_NE(task.notes.back().find(
                "'panda_hand' is at its goal: the place of 'panda_hand' at its goal is 1.44 m from"),
            std::string::npos)
      << task.notes.back();
  // Within the arm's length, and the joints' limits forbid it.
  replace("1.4 0.35 0.3", "0 0 -0.6");
  EXPECT_NE(read().notes.back().find("'panda_hand' is at its goal, which may be out of reach"),
            std::string::npos)
      << read().notes.back();
  EXPECT_EQ(task.problem.guess(0).x, task.problem.guess(2).x);
}

TEST_F(Places, APositionAloneAndWeightsOnTheWay) {
  replace("    orientation \"3.14159265358979 0 0\"\n", "");
  replace("costs { acceleration 1 }", "costs {\n acceleration 1\n tracking {\n position 2\n }\n}");
  const Task task = read();
  const Stage<double> at = task.problem.guess(1);
  EXPECT_EQ(task.problem.terms.front().function(at).size(), 3);
  const Term& tracking = task.problem.terms.back();
  EXPECT_EQ(tracking.name, "position tracking");
  EXPECT_EQ(tracking.role, Role::kSquares);
  EXPECT_NEAR(tracking.function(at).squaredNorm(), 2 * task.problem.terms.front().function(at).squaredNorm(),
              1e-12);
}

TEST_F(Places, BodiesKeepClearOfEachOther) {
  remove("obstacles");
  replace("bodies {",
          "bodies {\n  sphere chest {\n    frame panda_link0\n    center \"0 0 0.1\"\n    radius 0.15\n  }\n"
          "  clearance 0.02\n  pair \"hand chest\"\n  pair \"forearm chest\"");
  const Task task = read();
  ASSERT_EQ(task.around.apart.size(), 2u);
  EXPECT_EQ(task.around.apart[1].name(), "forearm from chest");
  EXPECT_EQ(task.around.apart[1].least, 0.02);
}

TEST_F(Places, PicturesShowObstacles) {
  const Task task = read();
  StagedNlp program = discretize(task.problem, task.optimise.mesh);
  const Trajectory motion = program.trajectory(program.start());
  const PlayerInput player = motion_player(task, motion);
  EXPECT_EQ(player.surroundings.size(), 4u);  // a bar is a cylinder and two balls
  EXPECT_NE(player_page(player).find(R"("kind":"sphere","body":-1,"p":[0.45,0.0,0.8])"), std::string::npos);
  // Seen along x: outlines from side to side and from bottom to top.
  const io::Plot plot = motion_plot(task, motion);
  const auto shows = [&](double side, double bottom, double top) {
    return std::any_of(plot.panels[0].series.begin(), plot.panels[0].series.end(),
                       [&](const io::Series& series) {
                         const auto [left, right] = std::minmax_element(series.x.begin(), series.x.end());
                         const auto [low, high] = std::minmax_element(series.y.begin(), series.y.end());
                         const double off = std::max({std::abs(*left + side), std::abs(*right - side),
                                                      std::abs(*low - bottom), std::abs(*high - top)});
                         return off < 1e-12;
                       });
  };
  EXPECT_TRUE(shows(0.05, -0.05, 0.55)) << "post";
  EXPECT_TRUE(shows(0.12, 0.68, 0.92)) << "lamp";
}

// The block of the file, 0.2 m wide, at both ends of its way.
TEST_F(Places, PicturesShowBoxesAsTheyAre) {
  load("block_move");
  const Task task = read();
  StagedNlp program = discretize(task.problem, task.optimise.mesh);
  const Trajectory motion = program.trajectory(program.start());
  const std::vector<io::Series> series = motion_plot(task, motion).panels[0].series;
  for (const double x : {motion.x(0, 0), motion.x(0, motion.points() - 1)}) {
    EXPECT_TRUE(std::any_of(series.begin(), series.end(),
                            [&](const io::Series& s) {
                              if (s.x.size() != 5) return false;
                              const auto [left, right] = std::minmax_element(s.x.begin(), s.x.end());
                              const auto [low, high] = std::minmax_element(s.y.begin(), s.y.end());
                              return std::max({std::abs(*left - x + 0.1), std::abs(*right - x - 0.1),
                                               std::abs(*low + 0.1), std::abs(*high - 0.1)}) < 1e-12;
                            }))
        << "at " << x;
  }
}

TEST_F(Places, MistakesAreNamedWithTheirPlace) {
  const std::string sound = text_;
  const auto says = [&](const std::string& old, const std::string& with, const std::string& part) {
    text_ = sound;
    replace(old, with);
    EXPECT_NE(message().find(part), std::string::npos) << part << " not in: " << message();
    EXPECT_NE(message().find("task.info"), std::string::npos) << message();
  };
  says("frame panda_hand {", "frame panda_hnd {",
       "task.info:13:3: 'goal.frame' names 'panda_hnd', which is no link of the robot; did you mean "
       "'panda_hand'?");
  says("frame panda_hand {", "frame panda_joint4 {",
       "'panda_joint4', which is no link of the robot; that is a joint, and its link is 'panda_link4'");
  says("frame panda_hand {", "frame {", "needs the name of a link");
  says("frame panda_hand {", "frame panda_link0 {", "'panda_link0' is fixed to the world");
  says("frame panda_hand {", "q 0\n frame panda_hand {", "'goal' has both 'frame' and 'q'");
  says("position    \"0.4 0.35 0.3\"", "position \"0.4 0.35\"", "has 2 numbers, expected three");
  says("position    \"0.4 0.35 0.3\"", "positon \"0.4 0.35 0.3\"", "did you mean 'position'?");
  says("radius 0.12", "radius -0.12", "'obstacles.sphere.radius' must be positive");
  says("center \"0.45 0 0.8\"", "", "'obstacles.sphere.center' is missing");
  says("frame  panda_link5", "frame panda_lnk5", "did you mean 'panda_link5'?");
  says("frame  panda_link5", "frame \"\"", "'bodies.capsule.frame' is empty, expected the name of a link");
  says("frame  panda_link5", "frame panda_link0",
       "'panda_link0', which carries 'forearm', is fixed to the world");
  says("capsule forearm {", "capsule hand {", "'hand' names two of 'bodies'");
  says("bodies {", "bodies {\n pair \"hand foot\"", "'foot', which is none of 'bodies'");
  says("bodies {", "bodies {\n pair \"hand\"", "names 1 bodies, expected two");
  says("costs { acceleration 1 }", "costs {\n acceleration 1\n tracking {\n q 1\n }\n}",
       "weighs a distance to 'goal.q'");
  says("\"-0.8 0.2 0 -2 0 2.2 0\"", "\"-0.8 0.2 0 -2 0 126 0\"", "in degrees? 126 degrees are 2.19911");
  const auto line =
      1 + std::count(text_.begin(), text_.begin() + std::ptrdiff_t(text_.find("126 0\"")), '\n');
  EXPECT_NE(message().find("task.info:" + std::to_string(line) + ":"), std::string::npos) << message();
  says("\"-0.8 0.2 0 -2 0 2.2 0\"", "\"-0.8 0.2 0 -2 0 4 0\"", "or 'positions none' in 'bounds'");
  EXPECT_EQ(message().find("degrees"), std::string::npos) << "of less than a turn: " << message();
  says("radius 0.12", "radius 0.5", "at the start the clearance of \"forearm\" and \"lamp\" is -0.");
  text_ = sound;
  remove("bodies");
  EXPECT_NE(message().find("'obstacles' have no effect"), std::string::npos) << message();
  text_ = sound;
  remove("obstacles");
  EXPECT_NE(message().find("'bodies' keep clear of nothing"), std::string::npos) << message();
}

// A block that slides along a line to another place.  The thing in its way stands between two looks of a few an interval.
class Slider : public Places {
 protected:
  void write(const std::string& center, const std::string& radius, const std::string& more = "") {
    text_ =
        "robot {\n urdf " + (fs::path(test::source_folder()) / "config/robots/block.urdf").string() +
        "\n}\nhorizon {\n duration 1\n intervals 4\n}\nstart { q 0 }\ngoal { q 1 }\nobstacles {\n ball "
        "thing {\n center \"" +
        center + "\"\n radius " + radius +
        "\n }\n}\nbodies {\n sphere block {\n frame block\n center \"0 0 0\"\n radius 0.004\n }\n}\ncosts "
        "{ control 1 }\n" +
        more;
  }
};

TEST_F(Slider, ThinThingsAreNotPassedThrough) {
  const char* const kVerify[] = {"", "verify { integration_error inf }\n",
                                 "verify { integration_error 1 }\n"};
  for (const char* verify : kVerify) {
    for (const char* center : {"0.42 0 0", "0.43 0 0", "0.44 0 0"}) {
      write(center, "0.004", verify);
      const SolveReport report = solve_task(read());
      EXPECT_FALSE(report.success()) << center << verify << report.verdict();
      // There is no way around it: the points of the mesh step over it.
      if (!report.solution.success()) continue;
      ASSERT_FALSE(report.excesses.empty()) << center << verify;
      EXPECT_LT(report.excesses.back().value, -0.0075) << center << verify;
    }
  }
}

TEST_F(Slider, WhatIsPassedIsFoundAsDeepAsItIs) {
  // Of radius 8 mm together: 7 mm aside it is touched by 1 mm, 8.1 mm aside it is not.
  for (const auto& [center, depth] :
       {std::pair("0.4675 0.007 0", -0.001), std::pair("0.4655 0.0081 0", 0.0)}) {
    write(center, "0.004");
    Task task = read();
    Task free = task;
    std::erase_if(free.problem.terms, [](const Term& term) { return term.role == Role::kInequality; });
    StagedNlp program = discretize(free.problem, task.optimise.mesh);
    const Solution s = optimise(program, program.start(), free.optimise);
    ASSERT_TRUE(s.success());
    const std::vector<LimitExcess> excesses = limit_excesses(task, s.motion);
    ASSERT_EQ(excesses.size(), depth < 0 ? 1u : 0u) << center;
    if (depth == 0) continue;
    // A sixteenth of 8 mm beside the nearest point it is 9 um farther away at most.
    EXPECT_NEAR(excesses[0].value, depth, 1e-5);
    EXPECT_TRUE(excesses[0].between_points);
  }
}

// What the solver leaves of a bound is no contact, however slim the things are.
TEST_F(Places, SlimThingsAreNotTouched) {
  replace("intervals 40", "intervals 80");
  remove("obstacles");
  remove("bodies");
  remove("expected");
  text_ +=
      "\nobstacles {\n capsule post {\n from \"0.55 0 0\"\n to \"0.55 0 0.5\"\n radius 0.015\n }\n}\n"
      "bodies {\n sphere hand {\n frame panda_hand\n center \"0 0 0.05\"\n radius 0.02\n }\n}\n";
  const SolveReport report = solve_task(read());
  EXPECT_TRUE(report.success()) << report.verdict();
}

// Bars whose nearest points jump where the derivatives are checked, and bodies whose distance no joint changes.
TEST_F(Places, KinksAndConstantDistancesAreNoWrongDerivatives) {
  remove("obstacles");
  remove("bodies");
  remove("expected");
  const std::string bare = text_;
  text_ += R"(
obstacles {
  capsule b0 {
    from "-0.00713559 -0.156633 0.565429"
    to "-0.161106 0.15552 0.655674"
    radius 0.02
  }
  capsule b1 {
    from "-0.754882 0.91087 0.63172"
    to "-0.456423 0.967759 0.737944"
    radius 0.02
  }
  capsule b2 {
    from "0.152269 -0.770643 0.156984"
    to "0.429359 -0.951188 -0.288453"
    radius 0.02
  }
  capsule b3 {
    from "0.630949 0.49588 0.916624"
    to "0.495452 0.0539273 1.22809"
    radius 0.02
  }
}
bodies {
  capsule upper {
    frame panda_link3
    from "0 0 -0.3"
    to "0 0 0"
    radius 0.05
  }
  sphere hand {
    frame panda_hand
    center "0 0 0.05"
    radius 0.1
  }
  capsule forearm {
    frame panda_link5
    from "0.06 0 -0.32"
    to "0 0 0"
    radius 0.05
  }
}
)";
  const auto check = [&] {
    const Task task = read();
    StagedNlp program = discretize(task.problem, task.optimise.mesh);
    const std::vector<double> start = program.start();
    for (double g : program.scaling(start).g) EXPECT_GT(g, 1e-9);
    for (unsigned seed = 1; seed < 6; ++seed)
      EXPECT_TRUE(check_derivatives(program, start, {.seed = seed}).good()) << seed;
  };
  check();
  text_ = bare + R"(
bodies {
  pair "hand forearm"
  sphere hand {
    frame panda_hand
    center "0 0 0.05"
    radius 0.03
  }
  capsule forearm {
    frame panda_link5
    from "0.06 0 -0.32"
    to "0 0 0"
    radius 0.03
  }
}
)";
  check();
}

TEST_F(Places, AFailureNamesWhatIsViolated) {
  replace("0.4 0.35 0.3", "1.4 0.35 0.3");
  remove("expected");
  Task task = read();
  task.optimise.solver.max_iterations = 40;
  const SolveReport report = solve_task(task);
  ASSERT_FALSE(report.success());
  EXPECT_NE(report.verdict().find("The constraint violated most is "), std::string::npos) << report.verdict();
  EXPECT_NE(report.verdict().find(report.solution.verification.worst_row), std::string::npos);
}

TEST_F(Places, AGoalThatIsInTheWayIsNoted) {
  replace("center \"0.45 0 0.8\"", "center \"0.4 0.35 0.25\"");
  const Task task = read();
  ASSERT_FALSE(task.notes.empty());
  EXPECT_NE(task.notes.back().find("is at its goal and every body keeps clear"), std::string::npos)
      << task.notes.back();
}

// What was understood, read again, is the same task.
TEST_F(Places, WhatWasUnderstoodIsATask) {
  const Task task = read();
  text_ = task.effective;
  const Task again = read();
  ASSERT_EQ(again.around.apart.size(), 4u);
  const Stage<double> at = task.problem.guess(0.7);
  ASSERT_EQ(again.problem.terms.size(), task.problem.terms.size());
  std::map<std::string, double> values;
  for (const Term& term : task.problem.terms) values[term.name] = term.function(at).norm();
  for (const Term& term : again.problem.terms)
    EXPECT_EQ(values.at(term.name), term.function(at).norm()) << term.name;
}

}  // namespace
}  // namespace dyntape::terms_task_test
