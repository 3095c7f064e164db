// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape simulate as a new user types it: scene files, robots with a few options, what is refused, what is written.
#include <gtest/gtest.h>

#include <fstream>
#include <regex>

#include <nlohmann/json.hpp>

#include "run.h"

namespace simulate_test {
namespace {

using dyntape::test::config;
using dyntape::test::holds;
using dyntape::test::Outcome;
using dyntape::test::run_dyntape;
using dyntape::test::Scratch;
using dyntape::test::slurp;
using nlohmann::json;
namespace fs = std::filesystem;

TEST(Simulate, NumbersWithoutADirectionAreNoRotation) {
  const Outcome base =
      run_dyntape({"simulate", config("robots/box.urdf"), "--base", "floating", "--q0", "0,0,1,0,0,0,0"});
  EXPECT_EQ(base.status, 1);
  EXPECT_TRUE(
      holds(base.err, "--q0: the quaternion (x y z w) of \"root_joint\" is zero, which is no rotation"))
      << base.err;
  const Outcome longer = run_dyntape({"simulate", config("robots/box.urdf"), "--base", "floating", "--for",
                                      "0.01", "--q0", "0,0,1,0,0,0,9"});
  EXPECT_EQ(longer.status, 0) << longer.err;
}

// As the same lines in a file do: of a scene, of a robot without one, in a task and a sweep.
TEST(Simulate, SettingsStandInPlaceOfWhatTheFileSays) {
  const Scratch scratch;
  const auto effective = [&](std::vector<std::string> command, const std::string& folder) {
    command.insert(command.end(), {"--output", scratch / folder});
    const Outcome run = run_dyntape(command);
    EXPECT_EQ(run.status, 0) << run.err;
    return slurp(scratch / folder + "/effective.info");
  };
  const auto says = [](const std::string& text, const char* line) {
    return std::regex_search(text, std::regex(line));
  };
  const std::string scene = config("scenes/pendulum.info"), robot = config("robots/pendulum.urdf");
  EXPECT_TRUE(
      says(effective({"simulate", scene, "--set", "simulation.duration=0.02"}, "a"), "duration +0.02"));
  const std::string damped = effective(
      {"simulate", robot, "--for", "0.02", "--set", "effects.joint_damping=0.25", "--set", "start.q=0.5"},
      "b");
  EXPECT_TRUE(says(damped, "joint_damping +0.25")) << damped;
  EXPECT_TRUE(holds(slurp(scratch / "b/motion.csv"), "\n0,0.5,0,")) << slurp(scratch / "b/motion.csv");
  EXPECT_TRUE(says(effective({"solve", config("tasks/block_move.info"), "--set", "horizon.intervals=4",
                              "--set", "expected="},
                             "c"),
                   "intervals +4"));
  for (const char* command : {"simulate", "solve", "mpc", "sweep"}) {
    const std::string kind = std::string(command) == "simulate" ? "scenes/pendulum.info"
                             : std::string(command) == "sweep"  ? "sweeps/quadruped_dropped.info"
                             : std::string(command) == "mpc"    ? "control/arm_holds.info"
                                                                : "tasks/block_move.info";
    const Outcome wrong =
        run_dyntape({command, config(kind), "--set", "nonsense.key=1", "--output", scratch / "d"});
    EXPECT_NE(wrong.status, 0);
    EXPECT_TRUE(holds(wrong.err, "--set nonsense.key: unknown key 'nonsense'")) << wrong.err;
    EXPECT_FALSE(fs::exists(scratch / "d")) << command;
    const Outcome none = run_dyntape({command, config(kind), "--set", "nonsense", "--output", scratch / "d"});
    EXPECT_TRUE(holds(none.err, "--set nonsense: expected a path of keys")) << none.err;
  }
}

TEST(Simulate, WritesTheMotionItsPicturesAndItsPage) {
  const Scratch scratch;
  const Outcome run =
      run_dyntape({"simulate", config("scenes/block_on_slope.info"), "--output", scratch / "out"});
  EXPECT_EQ(run.status, 0) << run.err;
  for (const char* file : {"motion.csv", "report.json", "effective.info", "trajectory.svg", "energy.svg",
                           "forces.svg", "motion.html"})
    EXPECT_GT(fs::file_size(fs::path(scratch / "out") / file), 100u) << file;
  const json report = json::parse(slurp(scratch / "out/report.json"));
  EXPECT_TRUE(report["success"]);
  EXPECT_EQ(report["steps"], 2000);
  // What was understood means the same.
  const std::string again = scratch / "again.info";
  fs::copy_file(scratch / "out/effective.info", again);
  const Outcome second = run_dyntape({"simulate", again, "--output", scratch / "second"});
  EXPECT_EQ(second.status, 0) << second.err;
  EXPECT_EQ(slurp(scratch / "out/motion.csv"), slurp(scratch / "second/motion.csv"));
}

TEST(Simulate, TakesARobotWithAFewOptions) {
  const Outcome run =
      run_dyntape({"simulate", config("robots/solo12.urdf"), "--base", "floating", "--for", "0.5",
                   "--effects", "gravity=off,joint_damping=0.1", "--v0", "1", "--json"});
  EXPECT_EQ(run.status, 0) << run.err;
  const json report = json::parse(run.out);
  EXPECT_LT(report["energy"]["work"]["joint damping"], 0);
  EXPECT_FALSE(report["energy"]["work"].contains("gravity"));
}

// What the options say stands in effective.info, which gives the same motion.
TEST(Simulate, WritesTheStartThatOptionsSay) {
  const Scratch scratch;
  const Outcome run =
      run_dyntape({"simulate", config("robots/solo12.urdf"), "--base", "floating", "--for", "0.1", "--q0",
                   "0,0,1,0,0,0.6,0.8,0,0.8,-1.6,0,0.8,-1.6,0,-0.8,1.6,0,-0.8,1.6", "--v0", "1", "--output",
                   scratch / "a"});
  ASSERT_EQ(run.status, 0) << run.err;
  const Outcome again = run_dyntape({"simulate", scratch / "a/effective.info", "--output", scratch / "b"});
  ASSERT_EQ(again.status, 0) << again.err;
  const auto last_row = [](const std::string& table) {
    std::istringstream row(table.substr(table.rfind('\n', table.size() - 2) + 1));
    std::vector<double> numbers;
    for (std::string cell; std::getline(row, cell, ',');) numbers.push_back(std::stod(cell));
    return numbers;
  };
  const std::vector<double> a = last_row(slurp(scratch / "a/motion.csv")),
                            b = last_row(slurp(scratch / "b/motion.csv"));
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-9) << i;
}

// The command's own words had old names of keys, and a note told the user to replace them.
TEST(Simulate, SaysNothingOfItsOwnWords) {
  const Scratch scratch;
  std::ofstream(scratch / "sled.urdf") << "<robot name='sled'><link name='world'/><link "
                                          "name='body'><inertial><mass value='2'/><inertia ixx='1' "
                                          "iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link><joint "
                                          "name='glide' type='planar'><axis xyz='0 0 1'/><parent "
                                          "link='world'/><child link='body'/></joint></robot>";
  const Outcome run = run_dyntape({"simulate", scratch / "sled.urdf", "--for", "0.1", "--q0", "1,2,0.6,0.8",
                                   "--v0", "0,0,0.5", "--output", scratch / "out"});
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_FALSE(holds(run.out, "note:")) << run.out;
  EXPECT_TRUE(holds(slurp(scratch / "out/motion.csv"), "\n0,1,2,0.6,0.8,0,0,0.5,"))
      << slurp(scratch / "out/motion.csv");
}

TEST(Simulate, ReadsWhatSolveWrites) {
  const Scratch scratch;
  const Outcome solved =
      run_dyntape({"solve", config("tasks/block_move.info"), "--output", scratch / "solved"});
  ASSERT_EQ(solved.status, 0) << solved.err;
  std::ofstream(scratch / "again.info") << "robot\n{\n urdf \"" << config("robots/block.urdf")
                                        << "\"\n}\ncommands\n{\n file solved/trajectory.csv\n}\n"
                                        << "simulation\n{\n duration 1\n step 1e-3\n}\n";
  const Outcome run = run_dyntape({"simulate", scratch / "again.info", "--output", scratch / "out"});
  ASSERT_EQ(run.status, 0) << run.err;
  const std::string table = slurp(scratch / "out/motion.csv");
  const std::string last = table.substr(table.rfind('\n', table.size() - 2) + 1);
  const double q = std::stod(last.substr(last.find(',') + 1));
  EXPECT_NEAR(q, 1, 1e-5);
}

TEST(Simulate, SolvesATaskOfAScene) {
  const Scratch scratch;
  const std::string scene =
      "robot\n{\n urdf \"" + config("robots/arm_2r.urdf") + "\"\n}\neffects\n{\n joint_damping robot\n}\n";
  std::ofstream(scratch / "arm.info") << scene << "simulation\n{\n duration 1\n}\n";
  const std::string rest =
      "horizon\n{\n duration 1\n intervals 20\n}\nstart\n{\n q 0\n}\ngoal\n{\n q \"0.5 0.5\"\n}\ncosts\n{\n "
      "control 1\n}\n";
  std::ofstream(scratch / "holds.info") << "name t\n" << scene << rest;
  std::ofstream(scratch / "names.info") << "name t\nscene arm.info\n" << rest;
  std::ofstream(scratch / "both.info") << "name t\nscene arm.info\n" << scene << rest;
  const Outcome holds_it = run_dyntape({"solve", scratch / "holds.info", "--output", scratch / "a"});
  const Outcome names_it = run_dyntape({"solve", scratch / "names.info", "--output", scratch / "b"});
  EXPECT_EQ(holds_it.status, 0) << holds_it.err;
  EXPECT_EQ(names_it.status, 0) << names_it.err;
  EXPECT_EQ(slurp(scratch / "a/trajectory.csv"), slurp(scratch / "b/trajectory.csv"));
  const Outcome both = run_dyntape({"solve", scratch / "both.info"});
  EXPECT_EQ(both.status, 1);
  EXPECT_TRUE(holds(both.err, "'robot' stands here and in the scene 'arm.info'")) << both.err;
}

TEST(Simulate, ExplainsWhatIsThereAndWhatItCosts) {
  const Outcome run = run_dyntape({"simulate", config("scenes/underwater_arm.info"), "--explain"});
  EXPECT_EQ(run.status, 0) << run.err;
  for (const char* part : {"buoyancy", "drag", "not recorded", "operations", "[ns]"})
    EXPECT_TRUE(holds(run.out, part)) << part;
}

TEST(Simulate, RefusesInASentence) {
  const std::string solo = config("robots/solo12.urdf");
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{"simulate", "none.urdf"}, "none.urdf"},
      {{"simulate", solo, "--q0", "1,2,3"}, "--q0: got 3 numbers; expected"},
      {{"simulate", solo, "--effects", "joint_dampin=1"},
       "--effects joint_dampin: unknown key 'joint_dampin' in 'effects'; did you mean 'joint_damping'"},
      {{"simulate", solo, "--effects", "joint_damping="}, "--effects joint_damping=: got no value"},
      {{"simulate", solo, "--for", "0"}, "--for: 'simulation.duration' must be positive, got '0'"},
      {{"simulate", solo, "--step", "0.3"}, "--step: 'duration' of 1 s is not made of whole steps"},
      {{"simulate", solo, "--integrator", "euler"}, "did you mean 'semi-implicit-euler'"},
      {{"simulate", solo, "--step", "-1"}, "must be positive"},
      {{"simulate", solo, "--v0", "nan"}, ""},
      {{"simulate", config("scenes/pendulum.info"), "--for", "2"},
       "--for is of a robot without a scene file"},
      {{"simulate", config("tasks/block_move.info")}, "this is a task"},
      {{"solve", config("scenes/pendulum.info")}, "this is a scene"},
  };
  for (const auto& [words, expected] : cases) {
    const Outcome run = run_dyntape(words);
    EXPECT_NE(run.status, 0) << words[1];
    EXPECT_TRUE(holds(run.err, expected)) << run.err;
    EXPECT_LT(std::count(run.err.begin(), run.err.end(), '\n'), 12) << run.err;
  }
}

}  // namespace

}  // namespace simulate_test
