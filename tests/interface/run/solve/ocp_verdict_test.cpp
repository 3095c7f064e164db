// SPDX-License-Identifier: BSD-3-Clause
//
// What a verdict is worth: a motion that its controls do not make, or that the robot cannot make, is not called found and
// verified, and a solve that is stopped gives what it has.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/run/solve/solve.h>

#include "source_folder.h"

namespace dyntape::ocp_verdict_test {
namespace {

namespace fs = std::filesystem;

class Verdicts : public ::testing::Test {
 protected:
  Verdicts() : folder_(fs::temp_directory_path() / ("dyntape-verdict-" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  ~Verdicts() override { fs::remove_all(folder_); }

  Task read(const std::string& text) const {
    const std::string path = (folder_ / "task.info").string();
    write_file_atomically(path, text);
    Task task = read_task(path);
    task.optimise.mesh.evaluation.route = Route::kInterpreter;
    return task;
  }

  // A kilogram on a rail, rated for these, to be moved by 1 m.
  Task slider(const std::string& velocity, const std::string& effort, const std::string& more,
              const std::string& goal = "1") const {
    write_file_atomically(
        (folder_ / "slider.urdf").string(),
        "<robot name=\"slider\"><link name=\"world\"/><link name=\"block\"><inertial><mass value=\"1\"/>"
        "<inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>"
        "<joint name=\"rail\" type=\"prismatic\"><parent link=\"world\"/><child link=\"block\"/>"
        "<axis xyz=\"1 0 0\"/><limit lower=\"-2\" upper=\"2\" velocity=\"" +
            velocity + "\" effort=\"" + effort + "\"/></joint></robot>");
    return read(
        "robot\n{\n urdf slider.urdf\n}\nhorizon\n{\n duration 1.5\n intervals 10\n}\nstart\n{\n q 0\n}\n"
        "goal\n{\n q " +
        goal + "\n}\ncosts\n{\n control 1\n}\n" + more);
  }

  static Task cart_pole(int intervals) {
    Task task = read_task(test::source_folder() + "/config/tasks/cart_pole_swing_up.info");
    task.optimise.mesh.evaluation.route = Route::kInterpreter;
    task.optimise.mesh.intervals = intervals;
    task.expected.reset();
    return task;
  }

  fs::path folder_;
};

TEST_F(Verdicts, LimitsOfTheRobotHoldUnlessTheTaskSaysOtherwise) {
  const SolveReport kept = solve_task(slider("0.84", "100", ""));
  EXPECT_TRUE(kept.success()) << kept.verdict();
  EXPECT_LE(kept.solution.motion.x.row(1).maxCoeff(), 0.84 * (1 + 1e-6));

  const SolveReport beyond = solve_task(slider("0.84", "100", "bounds\n{\n velocities none\n}\n"));
  ASSERT_EQ(beyond.excesses.size(), 1u);
  EXPECT_EQ(beyond.excesses[0].joint, "rail");
  EXPECT_EQ(beyond.excesses[0].quantity, "velocity");
  EXPECT_NEAR(beyond.excesses[0].value, 1.0, 1e-6);  // 1.5 times the mean speed, half-way
  EXPECT_EQ(beyond.excesses[0].limit, 0.84);
  EXPECT_NEAR(beyond.excesses[0].time, 0.75, 1e-12);
  EXPECT_FALSE(beyond.success());
  EXPECT_NE(beyond.verdict().find("velocity of rail is 1 m/s at 0.75 s, rated for 0.84"), std::string::npos)
      << beyond.verdict();
  EXPECT_NE(beyond.text().find("rated for 0.84"), std::string::npos);
  const auto json = nlohmann::json::parse(beyond.json());
  EXPECT_EQ(json["limits"]["excesses"][0]["joint"], "rail");
  EXPECT_EQ(json["success"], false);

  const SolveReport wanted =
      solve_task(slider("0.84", "100", "bounds\n{\n velocities none\n}\nverify\n{\n limits off\n}\n"));
  EXPECT_TRUE(wanted.success());
  EXPECT_NE(wanted.verdict().find("but for the limits"), std::string::npos) << wanted.verdict();

  // A bound of the task's own that is wider than the robot's.
  EXPECT_FALSE(solve_task(slider("0.84", "100", "bounds\n{\n velocities 0.9\n}\n")).success());
}

// At its points each mesh keeps the wall that the block is thrown at; between two of them the block is behind it.
TEST_F(Verdicts, LimitsHoldBetweenThePointsOfTheMesh) {
  const std::string wall =
      "verify\n{\n max_refinements 0\n}\nbounds\n{\n velocities none\n efforts none\n}\ntranscription\n{\n "
      "scheme hermite-simpson\n}\n";
  Task task = slider("100", "1000", wall, "-1.9");
  task.problem.start = Eigen::Vector2d(-1.9, -1.5);
  task.problem.goal = Eigen::Vector2d(-1.9, 1.5);
  task.optimise.mesh.intervals = 2;
  const SolveReport coarse = solve_task(task);
  ASSERT_EQ(coarse.excesses.size(), 1u) << coarse.text();
  EXPECT_TRUE(coarse.excesses[0].between_points);
  EXPECT_LT(coarse.excesses[0].value, -2.01);
  EXPECT_FALSE(coarse.success());
  EXPECT_NE(coarse.verdict().find("between points of the mesh, rated for -2"), std::string::npos)
      << coarse.verdict();
  task.demands.refinements = 4;
  const SolveReport fine = solve_task(task);
  EXPECT_GT(fine.meshes.size(), 1u);
  EXPECT_TRUE(fine.success()) << fine.verdict();
}

TEST_F(Verdicts, EffortsCountAndZeroIsNoLimit) {
  const SolveReport weak = solve_task(slider("100", "2", "bounds\n{\n efforts none\n}\n"));
  ASSERT_EQ(weak.excesses.size(), 1u);
  EXPECT_EQ(weak.excesses[0].quantity, "effort");
  EXPECT_NEAR(std::abs(weak.excesses[0].value), 6 / 1.5 / 1.5, 1e-6);
  const SolveReport unknown = solve_task(slider("0", "0", ""));
  EXPECT_TRUE(unknown.success()) << unknown.verdict();
}

TEST_F(Verdicts, AnEndBeyondALimitIsSaidWithTheWayOut) {
  try {
    slider("1", "1", "", "2.5");
    FAIL() << "nothing thrown";
  } catch (const FileError& e) {
    const std::string what = e.what();
    for (const char* part : {"task.info", "the goal of \"q.rail\" is 2.5", "-2 and 2", "positions none"})
      EXPECT_NE(what.find(part), std::string::npos) << what;
  }
  EXPECT_FALSE(solve_task(slider("100", "100", "bounds\n{\n positions none\n}\n", "2.5")).success());
}

TEST_F(Verdicts, TheMeshIsRefinedUntilTheMotionIsTrue) {
  Task task = cart_pole(8);
  task.demands.refinements = 0;
  const SolveReport coarse = solve_task(task);
  EXPECT_TRUE(coarse.solution.converged());
  EXPECT_FALSE(coarse.success());
  const Verification& v = coarse.solution.verification;
  EXPECT_GT(v.worst_relative, 1e-3);
  EXPECT_NE(coarse.verdict().find("in interval " + std::to_string(v.worst_interval) + " of 8"),
            std::string::npos)
      << coarse.verdict();
  EXPECT_NE(coarse.verdict().find("too coarse: re-simulated, " + v.worst_state + " is off by "),
            std::string::npos)
      << coarse.verdict();
  EXPECT_LE(v.worst_state_defect, v.worst_defect);
  EXPECT_NE(coarse.verdict().find("more intervals"), std::string::npos) << coarse.verdict();

  task.demands.refinements = 4;
  const SolveReport fine = solve_task(task);
  EXPECT_TRUE(fine.success()) << fine.text();
  ASSERT_GE(fine.meshes.size(), 2u);
  EXPECT_EQ(fine.meshes[0].intervals, 8);
  EXPECT_EQ(fine.meshes[0].cost, coarse.solution.cost());
  EXPECT_GT(fine.meshes[1].intervals, 8);
  EXPECT_LE(fine.solution.verification.worst_relative, 1e-3);
  EXPECT_EQ(fine.build.interpreted + fine.build.compiled + fine.build.from_cache, 1);  // recorded once
  EXPECT_EQ(nlohmann::json::parse(fine.json())["meshes"].size(), fine.meshes.size());
  EXPECT_NE(fine.text().find("defect of the motion"), std::string::npos);
}

// Whatever the solver says: multipliers that were lost, or are no numbers, show no optimum.
TEST_F(Verdicts, AnOptimumIsOneByItsMultipliers) {
  SolveReport report = solve_task(slider("100", "100", ""));
  ASSERT_TRUE(report.success()) << report.verdict();
  EXPECT_EQ(report.solution.demands.stationarity, 1e-4);
  for (const double lost : {0.9, 2e-4, std::nan("")}) {
    report.solution.kkt.stationarity = lost;
    EXPECT_FALSE(report.success()) << lost;
    EXPECT_EQ(report.verdict().find("verified"), std::string::npos) << report.verdict();
    EXPECT_NE(report.verdict().find("not shown to be an optimum: stationarity"), std::string::npos);
  }
  EXPECT_EQ(nlohmann::json::parse(report.json())["success"], false);
  report.solution.kkt.stationarity = 0.9e-4;
  EXPECT_TRUE(report.success());
  // A tolerance that is asked for is allowed.
  EXPECT_EQ(solve_task(slider("100", "100", "solver\n{\n tolerance 0.01\n}\n")).solution.demands.stationarity,
            0.1);
}

// Of one interval: why there is no finer mesh is said.
TEST_F(Verdicts, PseudospectralMotionsAreNotRefined) {
  Task task = cart_pole(1);
  task.optimise.mesh.scheme = pseudospectral(16);
  const SolveReport report = solve_task(task);
  EXPECT_TRUE(report.solution.converged());
  EXPECT_FALSE(report.success());
  EXPECT_EQ(report.meshes.size(), 1u);
  EXPECT_NE(report.verdict().find("a finer mesh was not solved, the mesh of 2 intervals: "),
            std::string::npos)
      << report.verdict();
  EXPECT_NE(report.verdict().find("\"pseudospectral-16\" is of one interval, got 2"), std::string::npos);
}

// Nothing moves: pictures have axes all the same, in which a still block is a block.
TEST_F(Verdicts, AMotionAtRestIsDrawn) {
  for (const std::string at : {"0", "0.5"}) {
    Task task = slider("100", "100", "", at);
    task.problem.start = task.problem.goal;
    SolveReport report = solve_task(task);
    ASSERT_TRUE(report.success()) << report.verdict();
    const std::string out = (folder_ / "still").string();
    write_results(task, report, out);
    EXPECT_TRUE(report.unwritten.empty()) << report.unwritten[0];
    for (const char* file : {"/motion.svg", "/trajectory.svg", "/motion.html"})
      EXPECT_TRUE(fs::exists(out + file));
    EXPECT_EQ(read_file(out + "/motion.svg").find("×10"), std::string::npos);  // of axes that show rounding
  }
}

TEST_F(Verdicts, DefectsOfTheMotionHaveNoUnit) {
  SolveReport report = solve_task(cart_pole(20));
  const Trajectory& motion = report.solution.motion;
  const Verification& v = report.solution.verification;
  const Eigen::VectorXd extents = motion.x.rowwise().maxCoeff() - motion.x.rowwise().minCoeff();
  EXPECT_LE(v.worst_relative, v.worst_defect / extents.minCoeff());
  EXPECT_GE(v.worst_relative, v.worst_defect / extents.maxCoeff());
  EXPECT_EQ(v.relative_defect.maxCoeff(), v.worst_relative);
  EXPECT_EQ(v.relative_defect[v.worst_interval], v.worst_relative);
}

TEST_F(Verdicts, HalvedEverywhere) {
  Trajectory motion{Eigen::Vector3d(0, 1, 4), {}, {}, {}, trapezoid()};
  EXPECT_EQ(halved(motion), (std::vector<double>{0, 0.5, 1, 2.5, 4}));
  motion.scheme = hermite_simpson();
  EXPECT_EQ(halved(motion), (std::vector<double>{0, 2, 4}));
}

TEST_F(Verdicts, AMotionOfCubicsIsTheSameOnAnyMesh) {
  const Task task = slider("100", "100", "");
  const Trajectory motion = solve_task(task).solution.motion;
  const std::vector<double> times = {0, 0.1, 0.33, 0.75, 1.21, 1.5};
  const Trajectory other = resampled(task.problem, motion, times);
  for (Eigen::Index i = 0; i < other.points(); ++i) {
    const double s = times[std::size_t(i)] / 1.5;
    EXPECT_NEAR(other.x(0, i), s * s * (3 - 2 * s), 1e-9);
    EXPECT_NEAR(other.x(1, i), 6 * s * (1 - s) / 1.5, 1e-9);
    EXPECT_NEAR(other.u(0, i), (6 - 12 * s) / 2.25, 1e-7);
  }
}

TEST_F(Verdicts, TheReportCountsAllMeshes) {
  const SolveReport report = solve_task(cart_pole(8));
  ASSERT_GT(report.meshes.size(), 1u);
  const auto json = nlohmann::json::parse(report.json());
  int iterations = 0;
  double seconds = 0;
  for (const auto& mesh : json["meshes"])
    iterations += mesh["iterations"].get<int>(), seconds += mesh["seconds"].get<double>();
  EXPECT_GT(iterations, report.solution.nlp.iterations());
  EXPECT_EQ(json["iterations"], iterations);
  const auto& of = json["seconds"];
  const double told =
      of["solve"].get<double>() + of["verify"].get<double>() + of["check_derivatives"].get<double>();
  EXPECT_NEAR(told, seconds, 1e-6 * seconds);
  EXPECT_NE(report.text().find(std::to_string(iterations) + " on "), std::string::npos) << report.text();
  EXPECT_NE(report.text().find(" meshes\n"), std::string::npos) << report.text();
}

TEST_F(Verdicts, AStoppedSolveGivesItsBestPoint) {
  const Task task = cart_pole(40);
  std::stop_source stop;
  std::vector<SolveStage> stages;
  int told = 0;
  SolveReport report = solve_task(task, {stop.get_token(), [&](const SolveMoment& m) {
                                           if (stages.empty() || stages.back() != m.stage)
                                             stages.push_back(m.stage);
                                           EXPECT_FALSE(m.text().empty());
                                           if (m.now) told = m.now->iteration;
                                           if (told == 6) stop.request_stop();
                                         }});
  EXPECT_EQ(report.solution.nlp.status, SolveStatus::kStopped);
  EXPECT_TRUE(report.interrupted);
  EXPECT_FALSE(report.success());
  EXPECT_EQ(report.iterations(), 6);
  EXPECT_NE(report.verdict().find("Interrupted after 6 iterations"), std::string::npos) << report.verdict();
  using enum SolveStage;
  EXPECT_EQ(stages, (std::vector<SolveStage>{kRecording, kChecking, kSolving, kVerifying}));
  double least =
      HUGE_VAL;  // what the log says, of the iterates' slack variables, is near what their rows say
  for (const IterationRecord& r : report.solution.nlp.log) least = std::min(least, r.primal_infeasibility);
  EXPECT_LE(report.solution.verification.violation, 2 * least);
  EXPECT_EQ(nlohmann::json::parse(report.json())["interrupted"], true);

  const std::string out = (folder_ / "out").string();
  SolveReport earlier = solve_task(task);
  write_results(task, earlier, out);
  ASSERT_TRUE(fs::exists(out + "/motion.svg"));
  write_results(task, report, out);
  EXPECT_TRUE(report.unwritten.empty());
  EXPECT_TRUE(fs::exists(out + "/trajectory.csv"));
  EXPECT_FALSE(fs::exists(out + "/motion.svg"));
}

TEST_F(Verdicts, StoppedBeforePicturesAreDrawn) {
  const Task task = slider("100", "100", "");
  SolveReport report = solve_task(task);
  ASSERT_TRUE(report.success());
  std::stop_source stop;
  stop.request_stop();
  const std::string out = (folder_ / "out").string();
  write_results(task, report, out, stop.get_token());
  EXPECT_TRUE(report.interrupted);
  EXPECT_TRUE(report.unwritten.empty());
  EXPECT_FALSE(fs::exists(out + "/motion.svg") || fs::exists(out + "/motion.html"));
  EXPECT_EQ(nlohmann::json::parse(read_file(out + "/report.json"))["interrupted"], true);
}

TEST_F(Verdicts, StoppedBeforeThereIsAMotion) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(solve_task(cart_pole(10), {stop.get_token(), {}}), Interrupted);
}

TEST_F(Verdicts, StoppedWhileTheMeshIsRefinedTheCoarserMotionStays) {
  Task task = cart_pole(8);
  std::stop_source stop;
  SolveReport report = solve_task(task, {stop.get_token(), [&](const SolveMoment& m) {
                                           if (m.refinement == 1 && m.now) stop.request_stop();
                                         }});
  EXPECT_TRUE(report.interrupted);
  EXPECT_EQ(report.solution.motion.intervals(), 8);
  EXPECT_NE(report.verdict().find("an optimum of 8 intervals"), std::string::npos) << report.verdict();
  EXPECT_FALSE(report.success());
}

}  // namespace
}  // namespace dyntape::ocp_verdict_test
