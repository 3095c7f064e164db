// SPDX-License-Identifier: BSD-3-Clause
//
// Task files: every one of config/tasks is solved and verified; what is wrong in one is said with its place.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/run/solve/solve.h>
#include "dynamics/robot_files.h"
#include "source_folder.h"

namespace dyntape::ocp_task_test {
namespace {

namespace fs = std::filesystem;

const fs::path kConfig = fs::path(test::source_folder()) / "config";

// A folder of this test that goes away with it.
class TaskFiles : public ::testing::Test {
 protected:
  TaskFiles() : folder_(fs::temp_directory_path() / ("dyntape-task-" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  ~TaskFiles() override { fs::remove_all(folder_); }

  Task read(const std::string& text) const {
    const std::string path = (folder_ / "task.info").string();
    dyntape::write_file_atomically(path, text);
    return read_task(path);
  }
  std::string message(const std::string& text) const {
    try {
      read(text);
    } catch (const Error& e) {
      return e.what();
    }
    return "nothing thrown";
  }
  // A complete task of the cart-pole, with more lines at the end.
  static std::string cart_pole(const std::string& more = "",
                               const std::string& goal = "slider 1\n pivot 3.14") {
    return "robot\n{\n urdf " +
           fs::relative(kConfig / "robots" / "cart_pole.urdf", fs::temp_directory_path() / "x").string() +
           "\n}\nactuated slider\nhorizon\n{\n duration 2\n intervals 10\n}\nstart\n{\n q 0\n}\ngoal\n{\n "
           "q\n {\n " +
           goal + "\n }\n}\ncosts\n{\n control 1\n}\n" + more;
  }

  fs::path folder_;
};

Task without_compiler(Task task) {
  task.optimise.mesh.evaluation.route = Route::kInterpreter;
  return task;
}

TEST_F(TaskFiles, OfTheProjectAreSolvedAndVerified) {
  int tasks = 0;
  for (const auto& entry : fs::directory_iterator(kConfig / "tasks")) {
    if (entry.path().extension() != ".info") continue;
    ++tasks;
    const SolveReport report = solve_task(without_compiler(read_task(entry.path().string())));
    EXPECT_TRUE(report.success()) << entry.path() << ": " << report.verdict();
    EXPECT_TRUE(report.expected.has_value()) << entry.path() << " states no known optimum";
    EXPECT_LT(report.solution.kkt.stationarity, 1e-6) << entry.path();
  }
  EXPECT_GE(tasks, 7);
}

// Nominal values at its optimum are a fraction of those of the guess, so that it is solved in two rounds.  Begun anew the second took
// four iterations more, a third of all.
TEST_F(TaskFiles, ALaterRoundGoesOnFromTheMultipliersOfTheFirst) {
  for (const NlpMethod method : {NlpMethod::kRiccati, NlpMethod::kIpopt}) {
    Task task = without_compiler(read_task((kConfig / "tasks" / "block_move_free_time.info").string()));
    task.optimise.solver.method = method;
    const SolveReport report = solve_task(task);
    EXPECT_TRUE(report.success()) << report.verdict();
    EXPECT_LE(report.iterations(), 9);
  }
}

TEST_F(TaskFiles, JointValuesInAllForms) {
  const Eigen::Vector2d goal(1, 3.14);
  for (const char* form :
       {"slider 1\n pivot 3.14", "pivot 3.14\n slider 1", "[0] 1\n [1] 3.14", "(0,0) 1\n (1,0) 3.14"}) {
    const Task task = read(cart_pole("", form));
    EXPECT_EQ(task.problem.goal.head(2), goal) << form;
    EXPECT_EQ(task.problem.start, Eigen::Vector4d::Zero());
  }
}

TEST_F(TaskFiles, MistakesAreNamedWithTheirPlace) {
  EXPECT_EQ(message(cart_pole()), "nothing thrown");
  const auto says = [&](const std::string& text, const std::vector<std::string>& parts) {
    const std::string what = message(text);
    for (const std::string& part : parts)
      EXPECT_NE(what.find(part), std::string::npos) << part << " not in: " << what;
  };
  says(cart_pole("bounds\n{\n effort robot\n}\n"), {"task.info:29:", "effort", "efforts"});
  says(cart_pole("bounds\n{\n efforts some\n}\n"),
       {"task.info:29:", "none, robot or a positive number", "some"});
  says(cart_pole("", "slider 1\n pivott 3"), {"pivott", "pivot"});
  says(cart_pole("", "slider 1"), {"task.info:17:", "goal.q", "joint 'pivot' without a value"});
  says(cart_pole("transcription\n{\n scheme hermite\n}\n"), {"task.info:29:", "hermite-simpson"});
  says(cart_pole("transcription\n{\n scheme lobato-5\n}\n"),
       {"task.info:29:", "lobatto-<points>", "did you mean 'lobatto-5'?"});
  says(cart_pole("transcription\n{\n scheme radau-200\n}\n"), {"task.info:29:", "expected 1 to 128 points"});
  says(cart_pole("effects\n{\n wind on\n}\n"), {"wind"});
  says(cart_pole("output\n{\n trace tipp\n}\n"), {"tipp", "tip"});
  says(cart_pole("verify\n{\n violation -1\n}\n"), {"violation", "positive"});
  says(cart_pole("output\n{\n trace \"tip tip\"\n}\n"), {"task.info:29:", "'trace' names 'tip' twice"});
  std::string twice = cart_pole();
  twice.replace(twice.find("actuated slider"), 15, "actuated \"slider slider\"");
  says(twice, {"'actuated' names 'slider' twice"});
  says("robot\n{\n urdf nowhere.urdf\n}\n", {"nowhere.urdf"});
  says("horizon\n{\n duration 2\n}\n", {"robot"});
  std::string held = cart_pole();
  held.insert(held.find("\n}\n"), "\n lock \"slider pivot\"");
  says(held, {"task.info:3:", "cart_pole.urdf' has no joint that moves"});
  says(cart_pole("solver\n{\n ipopt\n {\n  max_iterr 3\n  max_iter abc\n }\n}\n"),
       {"no option \"max_iterr\"; did you mean 'max_iter'?", "refuses the value \"abc\""});
  for (const char* word : {"nan", "inf"}) {
    std::string text = cart_pole();
    const std::size_t at = text.find("goal\n{\n") + 7;
    text.erase(at, text.find("\n}", at) + 1 - at);
    says(text.insert(at, std::string(" q \"0 ") + word + "\"\n"),
         {std::string("'q' must be finite, got '") + word + "'"});
  }
}

// The block of config/tasks/block_move.info with its duration left open.
std::string timed_block(const std::string& horizon, const std::string& costs = "control 1\n time 4") {
  return "robot\n{\n urdf " +
         (fs::relative(kConfig / "robots" / "block.urdf", fs::temp_directory_path() / "x")).string() +
         "\n}\nhorizon\n{\n duration 1\n intervals 8\n" + horizon +
         "}\nstart\n{\n q 0\n}\ngoal\n{\n q 1.5\n}\ncosts\n{\n " + costs +
         "\n}\nbounds\n{\n efforts none\n velocities none\n positions none\n}\nverify\n{\n limits off\n}\n";
}

TEST_F(TaskFiles, ADurationIsFound) {
  const double T = std::pow(36 * 1.5 * 1.5 / 4, 0.25);  // 12 d^2 / T^3 + 4 T is least
  for (const char* kind :
       {"", "transcription\n{\n dynamics inverse\n hessian gauss_newton\n}\n",
        "transcription\n{\n scheme trapezoid\n}\n", "transcription\n{\n scheme lobatto-5\n}\n",
        "transcription\n{\n scheme radau-3\n}\n"}) {
    const Task task = read(timed_block(" min_duration 0.2\n max_duration 5\n") + kind);
    SolveReport report = solve_task(without_compiler(task));
    ASSERT_TRUE(report.success()) << report.verdict();
    const bool exact = report.solution.motion.scheme.order > 2;
    EXPECT_NEAR(report.duration(), T, exact ? 1e-6 : 0.02) << kind;
    EXPECT_EQ(report.solution.motion.x.rows(), 2);
    EXPECT_NE(report.text().find("duration found"), std::string::npos);
    EXPECT_NE(report.json().find("\"duration_range\": ["), std::string::npos);
    if (!exact) {
      EXPECT_GT(report.meshes.size(), 1u);  // refined, from one duration to the next
      continue;
    }
    const std::string out = (folder_ / "out").string();
    write_results(task, report, out);
    const std::string effective = dyntape::read_file(out + "/effective.info");
    EXPECT_NE(effective.find("; duration found: 2.1213"), std::string::npos) << effective;
    EXPECT_NO_THROW(read_task(out + "/effective.info"));
    const io::CsvTable rows = io::read_csv(out + "/trajectory.csv");
    EXPECT_NEAR(rows.column("t").back(), T, 1e-6);
  }
}

TEST_F(TaskFiles, MistakesAboutADurationAreOneSentenceWithItsPlace) {
  EXPECT_EQ(message(timed_block(" min_duration 0.2\n max_duration 5\n")), "nothing thrown");
  EXPECT_EQ(message(timed_block("", "control 1")), "nothing thrown");
  const auto says = [&](const std::string& text, const std::string& part) {
    const std::string what = message(text);
    EXPECT_NE(what.find(part), std::string::npos) << part << " not in: " << what;
    EXPECT_EQ(std::count(what.begin(), what.end(), '\n'), 0) << what;
  };
  says(timed_block(" max_duration 5\n"),
       "task.info:9:15: 'max_duration' stands alone; expected 'min_duration' beside it");
  says(timed_block(" min_duration 0\n max_duration 5\n"), "task.info:10:15: 'max_duration' stands alone");
  says(timed_block(" min_duration 7\n max_duration 5\n"),
       "'min_duration' is 7 s, expected 'max_duration', 5 s, at most");
  says(timed_block(" min_duration 2\n max_duration 5\n"),
       "task.info:7:11: 'duration' is 1 s, expected the first guess of one between 2 and 5 s");
  says(timed_block(" min_duration -1\n max_duration 5\n"), "task.info:9:15: 'horizon.min_duration' must");
  says(timed_block(""), "'costs.time' weighs the duration, which is given");
  says(timed_block(" min_duratoin 2\n", "control 1"), "did you mean 'min_duration'?");
}

TEST_F(TaskFiles, FreeJointsAreLeftOpen) {
  const Task task = read(cart_pole() + "");
  std::string text = cart_pole();
  text.insert(text.find("goal\n{\n") + 7, " free slider\n");
  const Task open = read(text);
  EXPECT_TRUE(std::isnan(open.problem.goal[0]) && std::isnan(open.problem.goal[2]));
  EXPECT_EQ(open.problem.goal[1], task.problem.goal[1]);
}

TEST_F(TaskFiles, OptionsReachTheSolver) {
  const Task task = read(cart_pole(
      "solver\n{\n tolerance 1e-5\n max_iterations 2\n ipopt\n {\n  mu_strategy adaptive\n }\n}\n"));
  SolveReport report = solve_task(without_compiler(task));
  EXPECT_EQ(report.solution.nlp.status, SolveStatus::kIterationLimit);
  EXPECT_FALSE(report.success());
  EXPECT_EQ(report.solution.nlp.iterations(), 2);
}

TEST_F(TaskFiles, NoOptionOfTheSolverEmptiesAFile) {
  const std::string file = (folder_ / "precious").string();
  dyntape::write_file_atomically(file, "precious");
  EXPECT_THROW(read(cart_pole("solver\n{\n ipopt\n {\n  output_file \"" + file + "\"\n }\n}\n")), FileError);
  EXPECT_EQ(dyntape::read_file(file), "precious");
}

TEST_F(TaskFiles, VerboseSaysWhatIsGenerated) {
  const Task task = read(cart_pole("model_settings\n{\n verboseCppAd true\n}\n"));
  ::testing::internal::CaptureStderr();
  solve_task(without_compiler(task));
  EXPECT_NE(::testing::internal::GetCapturedStderr().find("task \"task\": 0 functions compiled"),
            std::string::npos);
}

TEST_F(TaskFiles, AWrongExpectationOrACoarseMeshIsNoSuccess) {
  const SolveReport wrong =
      solve_task(without_compiler(read(cart_pole("expected\n{\n cost 1\n tolerance 0.1\n}\n"))));
  EXPECT_TRUE(wrong.solution.success());
  EXPECT_FALSE(wrong.success());
  EXPECT_NE(wrong.verdict().find("not the known one"), std::string::npos);
  const SolveReport coarse = solve_task(
      without_compiler(read(cart_pole("verify\n{\n integration_error 1e-9\n max_refinements 0\n}\n"))));
  EXPECT_FALSE(coarse.success());
  EXPECT_NE(coarse.verdict().find("more intervals"), std::string::npos);
}

TEST_F(TaskFiles, ResultsAreWrittenWhole) {
  const Task task =
      read(cart_pole("expected\n{\n cost 1\n tolerance 1e9\n}\nverify\n{\n integration_error "
                     "1\n}\noutput\n{\n trace tip\n}\n"));
  SolveReport report = solve_task(without_compiler(task));
  const std::string out = (folder_ / "out").string();
  write_results(task, report, out);
  EXPECT_TRUE(report.unwritten.empty());
  const io::CsvTable table = io::read_csv(out + "/trajectory.csv");
  EXPECT_EQ(table.rows(), 21);
  EXPECT_EQ(table.names(), (std::vector<std::string>{"t", "q.slider", "q.pivot", "v.slider", "v.pivot",
                                                     "a.slider", "a.pivot", "tau.slider"}));
  EXPECT_EQ(table(20, 0), 2.0);
  EXPECT_EQ(table(20, 1), 1.0);
  const auto json = nlohmann::json::parse(dyntape::read_file(out + "/report.json"));
  EXPECT_EQ(json.at("success"), true);
  EXPECT_EQ(json.at("status"), "solved");
  EXPECT_NEAR(json.at("cost").get<double>(), report.solution.cost(), 0);
  EXPECT_EQ(io::read_csv(out + "/iterations.csv").rows(), report.solution.nlp.iterations() + 1);
  for (const char* picture : {"/trajectory.svg", "/motion.svg"}) {
    EXPECT_NE(dyntape::read_file(out + picture).find("</svg>"), std::string::npos) << picture;
  }
  const std::string page = dyntape::read_file(out + "/motion.html");
  EXPECT_TRUE(page.ends_with("</html>\n"));
  EXPECT_NE(page.find("power of the drives"), std::string::npos);
  // What was understood, read again, is the same task.
  std::string again = dyntape::read_file(out + "/effective.info");
  dyntape::write_file_atomically((folder_ / "again.info").string(), again);
  EXPECT_EQ(read_task((folder_ / "again.info").string()).effective.empty(), false);
}

TEST_F(TaskFiles, ExplainSaysWhatIsRecordedAndWhatIsNot) {
  const std::string text = explain(read(cart_pole("effects\n{\n joint_damping 0.1\n}\n")));
  EXPECT_NE(text.find("joint damping      yes"), std::string::npos) << text;
  EXPECT_NE(text.find("joint springs      no          not recorded"), std::string::npos) << text;
}

TEST_F(TaskFiles, CompiledAndInterpretedSolvesAreBitEqual) {
  const Task task =
      read(cart_pole("model_settings\n{\n modelFolderCppAd \"" + (folder_ / "cache").string() + "\"\n}\n"));
  const SolveReport compiled = solve_task(task), cached = solve_task(task);
  const SolveReport interpreted = solve_task(without_compiler(task));
  EXPECT_EQ(compiled.build.compiled, 1);
  EXPECT_EQ(cached.build.from_cache, 1);
  EXPECT_EQ(interpreted.build.interpreted, 1);
  EXPECT_EQ(compiled.solution.nlp.x, interpreted.solution.nlp.x);
  EXPECT_EQ(compiled.solution.nlp.x, cached.solution.nlp.x);
}

TEST_F(TaskFiles, TheSolveBeginsBeforeItsFunctionsAreCompiled) {
  Task task = read(cart_pole());
  CodegenOptions& how = task.optimise.mesh.evaluation;
  how.cache_folder = (folder_ / "cache").string();
  how.compiler = (folder_ / "slow-cc").string();
  dyntape::write_file_atomically(how.compiler,
                                 "#!/bin/sh\ncase \"$*\" in *-###*) echo slow version 1;; *' -E '*) exit 1;; "
                                 "*) sleep 100;; esac\n");
  fs::permissions(how.compiler, fs::perms::owner_all);
  const SolveReport report = solve_task(task);
  EXPECT_TRUE(report.success()) << report.verdict();
  EXPECT_EQ(report.build.unfinished, 1);
  EXPECT_EQ(report.build.machine_code + report.build.interpreted, 1);
  EXPECT_EQ(report.solution.nlp.x, solve_task(without_compiler(task)).solution.nlp.x);
  for (const auto& entry : fs::directory_iterator(how.cache_folder))
    EXPECT_FALSE(entry.path().filename().string().starts_with("build-")) << entry.path();

  how.compiler.clear();
  how.route = Route::kCompiled;
  EXPECT_EQ(solve_task(task).build.compiled, 1);
  how.route = Route::kAutomatic;
  const SolveReport cached = solve_task(task);
  EXPECT_EQ(cached.build.from_cache, 1);
  EXPECT_EQ(cached.build.unfinished, 0);
}

}  // namespace
}  // namespace dyntape::ocp_task_test
