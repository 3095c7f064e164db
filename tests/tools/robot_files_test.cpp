// SPDX-License-Identifier: BSD-3-Clause
//
// Robot and task files as they are found: what loads, and what is said of those that do not.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "run.h"

namespace robot_files_test {
namespace {

using dyntape::test::config;
using dyntape::test::Outcome;
using dyntape::test::run_dyntape;
using dyntape::test::Scratch;
using dyntape::test::slurp;

const std::string kInertia = "<inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/>";

// The pendulum with one text in place of another.
std::string pendulum_with(const Scratch& scratch, const std::string& old, const std::string& text) {
  std::string robot = slurp(config("robots/pendulum.urdf"));
  const std::size_t at = robot.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  robot.replace(at, old.size(), text);
  std::ofstream(scratch / "robot.urdf") << robot;
  return scratch / "robot.urdf";
}

// A moment below zero, by no more than digits that were cut off.
std::string odd_pendulum(const Scratch& scratch) {
  return pendulum_with(scratch, kInertia,
                       "<inertia ixx=\"1e-3\" ixy=\"0\" ixz=\"0\" iyy=\"1e-3\" iyz=\"0\" izz=\"-3.5e-8\"/>");
}

void expect_refused(const Outcome& run, const std::vector<std::string>& parts) {
  EXPECT_EQ(run.status, 1) << run.err;
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  for (const std::string& part : parts)
    EXPECT_NE(run.err.find(part), std::string::npos) << part << "\n" << run.err;
}

TEST(RobotFiles, AnInertiaThatNoBodyHasIsReadOnRequest) {
  const Scratch scratch;
  const std::string robot = odd_pendulum(scratch);
  expect_refused(run_dyntape({"info", robot}),
                 {"-3.5e-08 kg m^2", "--inertia warn", "'inertia warn'", "accept_nonphysical_inertia=True"});
  const auto read = run_dyntape({"info", robot, "--inertia", "warn"});
  EXPECT_EQ(read.status, 0) << read.err;
  EXPECT_NE(read.out.find("note: "), std::string::npos);
  EXPECT_NE(read.out.find("-3.5e-08 kg m^2; read as it is"), std::string::npos) << read.out;
  EXPECT_EQ(
      run_dyntape({"generate", robot, "--inertia", "warn", "--function", "rnea", "--output", scratch / "c"})
          .status,
      0);
  EXPECT_EQ(run_dyntape({"identify", robot, "--inertia", "warn"}).status, 0);
  EXPECT_EQ(run_dyntape({"info", robot, "--inertia", "ignore"}).status, 2);
}

TEST(RobotFiles, TaskFilesTakeTheSameWord) {
  const Scratch scratch;
  odd_pendulum(scratch);
  const std::string rest =
      "horizon { \n duration 1 \n intervals 5 \n } \n start { \n q 0 \n } \n goal { \n q 1 \n } \n costs { "
      "\n control 1 \n }\n";
  std::ofstream(scratch / "strict.info") << "robot { \n urdf robot.urdf \n } \n" << rest;
  std::ofstream(scratch / "warn.info") << "robot { \n urdf robot.urdf \n inertia warn \n } \n" << rest;
  expect_refused(run_dyntape({"check-config", scratch / "strict.info"}),
                 {"strict.info:2:7: ", "inertia warn"});
  const auto read = run_dyntape({"check-config", scratch / "warn.info"});
  EXPECT_EQ(read.status, 0) << read.err;
  EXPECT_NE(read.out.find("read as it is"), std::string::npos) << read.out;
}

TEST(RobotFiles, XacroHasToRunFirst) {
  const Scratch scratch;
  const auto with = [&](const std::string& old, const std::string& text) {
    return run_dyntape({"info", pendulum_with(scratch, old, text)});
  };
  const std::string expected = "is left of xacro; expected a URDF file";
  expect_refused(
      with("<link name=\"world\"/>", "<xacro:include filename=\"arm.xacro\"/><link name=\"world\"/>"),
      {"robot.urdf:8: <xacro:include> " + expected});
  expect_refused(with("<mass value=\"1\"/>", "<mass value=\"${m}\"/>"),
                 {"<mass value=\"${m}\"> " + expected});
  expect_refused(with("<mass value=\"1\"/>", "<mass value=\"$(arg m)\"/>"), {expected});
  expect_refused(with("<link name=\"tip\">", "<link name=\"${prefix}tip\">"), {"${prefix}tip", expected});
  // What is not read may hold anything.
  EXPECT_EQ(
      with("<link name=\"world\"/>", "<gazebo><plugin name=\"${p}\"/></gazebo><link name=\"world\"/>").status,
      0);
}

// It only draws: a note.
TEST(RobotFiles, AMeshOfABadScaleIsOneSentence) {
  const Scratch scratch;
  for (const char* scale : {"0.001", "a b c", "1 1 1 1", ""}) {
    const std::string mesh = "<mesh filename=\"ball.stl\" scale=\"" + std::string(scale) + "\"/>";
    const auto run = run_dyntape({"info", pendulum_with(scratch, "<sphere radius=\"0.08\"/>", mesh)});
    EXPECT_EQ(run.status, 0) << run.err;
    for (const std::string& part :
         {std::string("robot.urdf:35: "), "<mesh scale=\"" + std::string(scale) + "\"> of link \"tip\"",
          std::string("three"), std::string("this only draws")})
      EXPECT_NE(run.out.find(part), std::string::npos) << part << "\n" << run.out;
  }
}

TEST(RobotFiles, AFileOfAnotherKindIsSaidToBeOne) {
  const Scratch scratch;
  const std::string robot = config("robots/ur5.urdf"), task = config("tasks/arm_reaching.info");
  for (const char* command : {"solve", "check-config"})
    expect_refused(run_dyntape({command, robot}),
                   {"ur5.urdf is a URDF, not a task file; expected an .info file"});
  expect_refused(run_dyntape({"info", task}),
                 {"arm_reaching.info: this is an .info file, not a URDF", "dyntape solve"});
  expect_refused(run_dyntape({"info", config("robots")}), {"it is a folder; expected a file"});
  std::ofstream(scratch / "world.sdf") << "<sdf version='1.7'/>";
  expect_refused(run_dyntape({"info", scratch / "world.sdf"}), {"<sdf>, an SDF file"});
  std::ofstream(scratch / "states.csv") << "q0,v0\n1,2\n";
  expect_refused(run_dyntape({"info", scratch / "states.csv"}), {"this is not XML"});
  expect_refused(run_dyntape({"eval", robot, "--function", "crba", "--route", "tape", "--input", robot,
                              "--output", "-"}),
                 {"ur5.urdf: this is XML, not a table; expected a CSV file"});
}

TEST(TaskFiles, EveryProblemIsToldWithoutTheRobotToo) {
  const Scratch scratch;
  std::ofstream(scratch / "task.info")
      << "robot\n{\n  urdf nowhere.urdf\n}\nhorizon\n{\n  duration -1\n  intervls 5\n}\n"
         "start\n{\n  q \"1 2\"\n}\ncosts\n{\n  control 1\n}\nbonds 1\n";
  const auto run = run_dyntape({"check-config", scratch / "task.info"});
  EXPECT_EQ(run.status, 1);
  for (const char* part :
       {"task.info:3:8: ", "nowhere.urdf: cannot open", "'horizon.duration' must be positive",
        "unknown key 'intervls'", "required key 'goal' is missing", "unknown key 'bonds'"})
    EXPECT_NE(run.err.find(part), std::string::npos) << part << "\n" << run.err;
  EXPECT_EQ(run.err.find("'q'"), std::string::npos) << run.err;  // whose joints nobody knows
}

}  // namespace

}  // namespace robot_files_test
