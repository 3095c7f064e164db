// SPDX-License-Identifier: BSD-3-Clause
//
// Every command as a user or a script meets it: what it prints, what it writes, how it refuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include <dyntape/interface/io/csv.h>

#include "../source_folder.h"
#include "run.h"

namespace commands_test {
namespace {

using dyntape::test::config;
using dyntape::test::run_dyntape;
using dyntape::test::Scratch;
using dyntape::test::slurp;
using dyntape::test::source_folder;
using nlohmann::json;

const std::vector<std::string> kArm = {config("robots/panda.urdf"), "--lock",
                                       "panda_finger_joint1,panda_finger_joint2"};

std::vector<std::string> words(std::vector<std::string> first, const std::vector<std::string>& robot,
                               const std::vector<std::string>& rest) {
  first.insert(first.end(), robot.begin(), robot.end());
  first.insert(first.end(), rest.begin(), rest.end());
  return first;
}

// Two states of the arm, all columns of (q, v, third).
std::string write_states(const Scratch& scratch, const std::string& third) {
  const std::string path = scratch / "states.csv";
  std::ofstream file(path);
  for (const std::string& block : {std::string("q"), std::string("v"), third}) {
    for (int i = 0; i < 7; ++i) file << (block == "q" && i == 0 ? "" : ",") << block << i;
  }
  for (int row = 0; row < 2; ++row) {
    file << "\n";
    for (int k = 0; k < 21; ++k) file << (k ? "," : "") << std::sin(1.0 + k + 30.0 * row);
  }
  file << "\n";
  return path;
}

// One joint fewer than the file has, by every command; what torques of the fingers there are acts on one.
TEST(Mimic, FollowersAreNoColumns) {
  const Scratch scratch;
  const std::string panda = config("robots/panda.urdf"), states = scratch / "states.csv";
  {
    std::ofstream file(states);
    for (int i = 0; i < 8; ++i) file << (i ? "," : "") << "q" << i;
    file << "\n.1,.2,.3,.4,.5,.6,.7,.02\n";
  }
  std::vector<dyntape::io::CsvTable> masses;
  for (const char* route : {"analytic", "tape"}) {
    const auto run = run_dyntape({"eval", panda, "--mimic", "--function", "crba", "--route", route, "--input",
                                  states, "--output", scratch / route});
    ASSERT_EQ(run.status, 0) << run.err;
    masses.push_back(dyntape::io::read_csv(scratch / route));
    ASSERT_EQ(masses.back().cols(), 64);
  }
  for (int k = 0; k < 64; ++k) EXPECT_NEAR(masses[0](0, k), masses[1](0, k), 1e-14);
  EXPECT_NEAR(masses[0](0, 63), 0.03, 1e-15);  // 15 g each
  const auto whole = run_dyntape({"eval", panda, "--function", "crba", "--route", "analytic", "--input",
                                  states, "--output", scratch / "w"});
  EXPECT_NE(whole.err.find("no column \"q8\""), std::string::npos) << whole.err;
  const auto made = run_dyntape(
      {"generate", panda, "--mimic", "--function", "gravity", "--output", scratch / "c", "--json"});
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(json::parse(made.out)["kernels"][0]["non_zeros"], 8);
  const auto bench = run_dyntape({"bench", panda, "--mimic", "--function", "aba", "--states", "2", "--json"});
  ASSERT_EQ(bench.status, 0) << bench.err;
  const json report = json::parse(bench.out);
  EXPECT_EQ(report["nv"], 8);
  for (const json& route : report["routes"]) EXPECT_LE(route["error"].get<double>(), 1e-10);
}

TEST(Eval, RoutesAgree) {
  const Scratch scratch;
  const std::string states = write_states(scratch, "tau");
  std::vector<dyntape::io::CsvTable> results;
  for (const char* route : {"analytic", "tape", "generated", "fd-central", "machine-code"}) {
    const std::string out = scratch / route;
    const auto run = run_dyntape(
        words({"eval"}, kArm,
              {"--function", "fd-derivatives", "--route", route, "--input", states, "--output", out}));
    ASSERT_EQ(run.status, 0) << run.err;
    results.push_back(dyntape::io::read_csv(out));
    EXPECT_EQ(results.back().rows(), 2);
    EXPECT_EQ(results.back().cols(), 3 * 7 * 7);
  }
  double scale = 0;
  for (double value : results[0].values()) scale = std::max(scale, std::abs(value));
  for (std::size_t k = 0; k < results[0].values().size(); ++k) {
    EXPECT_NEAR(results[1].values()[k], results[0].values()[k], 1e-12 * scale);
    EXPECT_NEAR(results[2].values()[k], results[0].values()[k], 1e-12 * scale);
    EXPECT_NEAR(results[3].values()[k], results[0].values()[k], 1e-6 * scale);
    EXPECT_EQ(results[4].values()[k], results[2].values()[k]);
  }
}

TEST(Eval, RefusesAndLeavesNothing) {
  const Scratch scratch;
  const std::string states = write_states(scratch, "tau"), out = scratch / "out.csv";
  const auto columns = run_dyntape(words(
      {"eval"}, kArm, {"--function", "rnea", "--route", "analytic", "--input", states, "--output", out}));
  EXPECT_EQ(columns.status, 1);  // tau0.. where a0.. is expected
  EXPECT_NE(columns.err.find("a0"), std::string::npos) << columns.err;
  const auto route = run_dyntape(words(
      {"eval"}, kArm, {"--function", "aba", "--route", "fd-central", "--input", states, "--output", out}));
  EXPECT_EQ(route.status, 1);  // differences of a value make no sense
  EXPECT_EQ(run_dyntape(words({"eval"}, kArm,
                              {"--function", "abba", "--route", "tape", "--input", states, "--output", out}))
                .status,
            2);
  EXPECT_FALSE(std::filesystem::exists(out));
}

// A link alone: no column that a file could have.
TEST(Eval, RefusesARobotWithoutJoints) {
  const Scratch scratch;
  const std::string robot = scratch / "one.urdf", states = scratch / "states.csv", out = scratch / "out.csv";
  std::ofstream(robot) << R"(<robot name="one"><link name="only"><inertial><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>)";
  std::ofstream(states) << "q0\n1\n";
  for (const char* function : {"rnea", "com", "fd-derivatives", "frame-placement"}) {
    const auto run = run_dyntape(
        {"eval", robot, "--function", function, "--route", "analytic", "--input", states, "--output", out});
    EXPECT_EQ(run.status, 1) << function;
    EXPECT_NE(run.err.find("model \"one\" has no joint that moves"), std::string::npos) << run.err;
  }
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_EQ(run_dyntape({"info", robot}).status, 0);
  EXPECT_EQ(run_dyntape({"info", robot, "--json"}).status, 0);
  EXPECT_EQ(run_dyntape({"identify", robot}).status, 1);
}

TEST(Generate, WritesCThatCompilesByItself) {
  const Scratch scratch;
  const auto run = run_dyntape({"generate", config("robots/double_pendulum.urdf"), "--function", "aba",
                                "--order", "2", "--output", scratch / "c", "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  const json report = json::parse(run.out);
  EXPECT_EQ(report["kernels"].size(), 3u);
  ASSERT_EQ(report["files"].size(), 2u);
  const std::string source = report["files"][0].get<std::string>();
  const std::string compile = "gcc -std=c99 -Wall -Wextra -Werror -pedantic -c -o /dev/null " + source;
  EXPECT_EQ(std::system(compile.c_str()), 0);
}

TEST(Generate, SinesAreInTheText) {
  const Scratch scratch;
  const auto run = run_dyntape({"generate", config("robots/double_pendulum.urdf"), "--function", "aba",
                                "--output", scratch / "c", "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  const std::string source = json::parse(run.out)["files"][0].get<std::string>();
  const std::string compile =
      "gcc -std=c99 -Wall -Wextra -Werror -shared -fPIC -nostdlib -Wl,--no-undefined -o /dev/null " + source;
  EXPECT_EQ(std::system(compile.c_str()), 0) << "no function of libm is called";
  EXPECT_EQ(run_dyntape({"generate", config("robots/double_pendulum.urdf"), "--function", "aba",
                         "--functions", "sleef", "--output", scratch / "d"})
                .status,
            2);
}

TEST(Generate, EmbeddedTextIsPlainFunctionsWithTheirStack) {
  const Scratch scratch;
  const std::vector<std::string> words = {"generate",   config("robots/double_pendulum.urdf"),
                                          "--function", "aba",
                                          "--order",    "1",
                                          "--output",   scratch / "c",
                                          "--json"};
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = words;
    all.insert(all.end(), more.begin(), more.end());
    return run_dyntape(all);
  };
  const auto run = with({"--embedded", "--float", "--cross", "gcc -O1"});
  ASSERT_EQ(run.status, 0) << run.err;
  const json report = json::parse(run.out);
  ASSERT_EQ(report["functions"].size(), 2u);
  for (const json& function : report["functions"]) {
    EXPECT_GT(function["stack_bytes"].get<int>(), 0);
    EXPECT_LT(function["stack_bytes"].get<int>(), function["stack_bound"].get<int>());
  }
  const std::string source = report["files"][0].get<std::string>(), text = slurp(source),
                    header = slurp(report["files"][1].get<std::string>());
  EXPECT_NE(text.find(" bytes with " + report["stack_measured_with"].get<std::string>()), std::string::npos);
  EXPECT_NE(header.find("_value(const float x[6], float y[2]);"), std::string::npos) << header;
  const std::string compile =
      "gcc -std=c99 -Wall -Wextra -Werror -pedantic -ffreestanding -c -o /dev/null " + source;
  EXPECT_EQ(std::system(compile.c_str()), 0);

  EXPECT_EQ(with({"--float"}).status, 2) << "not of C";
  const auto absent = with({"--embedded", "--cross", "no-such-gcc"});
  EXPECT_EQ(absent.status, 1);
  EXPECT_NE(absent.err.find("no-such-gcc"), std::string::npos) << absent.err;
}

TEST(Bench, MeasuresEveryRoute) {
  const auto run = run_dyntape({"bench", config("robots/pendulum.urdf"), "--function", "id-derivatives",
                                "--states", "5", "--lanes", "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  const json report = json::parse(run.out);
  ASSERT_EQ(report["routes"].size(), 6u);
  for (const auto& row : report["routes"]) {
    EXPECT_GT(row["time_s"].get<double>(), 0);
    const bool differences = row["route"].get<std::string>().starts_with("fd-");
    EXPECT_LE(row["error"].get<double>(), differences ? 1e-5 : 1e-13) << row["route"];
  }
  ASSERT_EQ(report["lanes"].size(), 5u);  // by one, in lanes, kept there; the non-zeros of both
  for (const auto& row : report["lanes"]) {
    EXPECT_GT(row["time_s"].get<double>(), 0);
    EXPECT_LE(row["error"].get<double>(), 1e-13) << row["kernel"];
  }
}

TEST(Eval, TakesEveryFunctionOfTheTable) {
  const Scratch scratch;
  const std::string states = write_states(scratch, "a"), out = scratch / "out.csv";
  const auto run =
      run_dyntape(words({"eval"}, kArm,
                        {"--function", "frame-acceleration-derivatives", "--frame", "panda_hand", "--in",
                         "local", "--route", "tape", "--input", states, "--output", out}));
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(dyntape::io::read_csv(out).cols(), 6 * 6 * 7);
  const auto lost = run_dyntape(words({"eval"}, kArm,
                                      {"--function", "frame-acceleration-derivatives", "--frame",
                                       "panda_hnad", "--route", "tape", "--input", states, "--output", out}));
  EXPECT_EQ(lost.status, 1);
  EXPECT_NE(lost.err.find("panda_hand"), std::string::npos) << lost.err;
  const std::string help = run_dyntape({"eval", "--help"}).out;
  for (const char* name : {"rnea", "centroidal-derivatives", "frame-hessian"}) {
    EXPECT_NE(help.find(name), std::string::npos) << name;
  }
}

TEST(Bench, MeasuresEveryFunctionInPlainDouble) {
  const auto run = run_dyntape({"bench", config("robots/ur5.urdf"), "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  const json report = json::parse(run.out);
  EXPECT_GE(report["functions"].size(), 30u);
  for (const auto& row : report["functions"]) {
    EXPECT_GT(row["time_s"].get<double>(), 0) << row;
    EXPECT_LE(row["error"].get<double>(), 1e-12) << row;
    EXPECT_FALSE(row.contains("ratio"));
  }
}

TEST(Bench, WithoutThePeerSaysWhere) {
  const Scratch scratch;
  const auto run =
      run_dyntape({"bench", config("robots/pendulum.urdf"), "--peer", "--peer-prefix", scratch / "nowhere"});
  EXPECT_EQ(run.status, 1);
  EXPECT_NE(run.err.find("include/pinocchio"), std::string::npos) << run.err;
}

TEST(Solve, BlockMoveToItsKnownOptimum) {
  const Scratch scratch;
  const auto run =
      run_dyntape({"solve", config("tasks/block_move.info"), "--output", scratch / "out", "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  for (const char* file :
       {"trajectory.csv", "iterations.csv", "report.json", "trajectory.svg", "motion.svg", "motion.html"}) {
    EXPECT_TRUE(std::filesystem::exists(scratch / ("out/" + std::string(file)))) << file;
  }
  EXPECT_NO_THROW(json::parse(run.out));
}

// A run that ends without results leaves none of an earlier one.
TEST(Commands, RefuseAWrongNumberOfThreads) {
  for (const char* wrong : {"zero", "0", "-3", "99999"}) {
    setenv("DYNTAPE_THREADS", wrong, 1);
    const auto run = run_dyntape({"info", config("robots/pendulum.urdf")});
    unsetenv("DYNTAPE_THREADS");
    EXPECT_EQ(run.status, 1);
    EXPECT_NE(run.err.find("DYNTAPE_THREADS is \"" + std::string(wrong) + "\"; a number from 1 to 1024"),
              std::string::npos)
        << run.err;
  }
}

TEST(Solve, WhatFailsLeavesNothingOlder) {
  const Scratch scratch;
  const std::string report = scratch / "out/report.json";
  ASSERT_EQ(run_dyntape({"solve", config("tasks/block_move.info"), "--output", scratch / "out"}).status, 0);
  ASSERT_TRUE(std::filesystem::exists(report));
  const auto run = run_dyntape({"mpc", config("tasks/block_move.info"), "--output", scratch / "out"});
  EXPECT_NE(run.status, 0);
  EXPECT_NE(run.err.find("a controller needs a cost that pulls to the goal"), std::string::npos) << run.err;
  EXPECT_FALSE(std::filesystem::exists(report));
}

TEST(Solve, ExplainsWhatIsRecorded) {
  const auto run = run_dyntape({"solve", config("tasks/arm_reaching.info"), "--explain"});
  ASSERT_EQ(run.status, 0) << run.err;
  for (const char* word : {"gravity", "damping", "friction", "armature", "springs", "operations"}) {
    EXPECT_NE(run.out.find(word), std::string::npos) << word << "\n" << run.out;
  }
}

TEST(CheckConfig, ReadsWhatIsSetInPlaceOfWhatTheFileSays) {
  const std::string task = config("tasks/cart_pole_swing_up.info");
  const auto shown = run_dyntape({"check-config", task, "--set", "horizon.intervals=17", "--effective"});
  EXPECT_EQ(shown.status, 0) << shown.err;
  EXPECT_TRUE(std::regex_search(shown.out, std::regex("intervals +17"))) << shown.out;
  const auto wrong = run_dyntape({"check-config", task, "--set", "horizon.intervals=few"});
  EXPECT_EQ(wrong.status, 1);
  EXPECT_NE(wrong.err.find("horizon.intervals"), std::string::npos) << wrong.err;
  EXPECT_EQ(run_dyntape({"check-config", task, "--set", "horizon.intervals=17", "--rename"}).status, 1);
}

TEST(CheckConfig, FindsEveryProblemWithItsPlace) {
  const Scratch scratch;
  const std::string sound = slurp(config("tasks/cart_pole_swing_up.info"));
  EXPECT_EQ(run_dyntape({"check-config", config("tasks/cart_pole_swing_up.info")}).status, 0);
  std::string wrong = sound;
  wrong.replace(wrong.find("../robots"), 9, config("robots"));
  const auto at = wrong.find("intervals");
  ASSERT_NE(at, std::string::npos);
  wrong.replace(at, 9, "intervalls");
  const std::string path = scratch / "wrong.info";
  std::ofstream(path) << wrong;
  const auto run = run_dyntape({"check-config", path});
  EXPECT_EQ(run.status, 1);
  EXPECT_NE(run.err.find("intervals"), std::string::npos) << run.err;  // the nearest valid key
  EXPECT_NE(run.err.find("wrong.info:"), std::string::npos) << run.err;
}

TEST(CacheCommand, ListsVerifiesAndClears) {
  const Scratch scratch;
  const std::string folder = scratch / "cache";
  setenv("DYNTAPE_CACHE", folder.c_str(), 1);
  ASSERT_EQ(run_dyntape(
                {"generate", config("robots/pendulum.urdf"), "--function", "aba", "--output", scratch / "c"})
                .status,
            0);
  const json listed = json::parse(run_dyntape({"cache", "list", "--json"}).out);
  ASSERT_EQ(listed["entries"].size(), 1u);
  EXPECT_EQ(run_dyntape({"cache", "verify"}).status, 0);
  std::filesystem::resize_file(listed["entries"][0]["library"].get<std::string>(), 1000);
  EXPECT_EQ(run_dyntape({"cache", "verify"}).status, 1);
  EXPECT_EQ(json::parse(run_dyntape({"cache", "clear", "--json"}).out)["removed"], 1);
  EXPECT_EQ(json::parse(run_dyntape({"cache", "list", "--json"}).out)["entries"].size(), 0u);
  unsetenv("DYNTAPE_CACHE");
}

TEST(Doctor, FindsTheMachineSound) {
  const auto run = run_dyntape({"doctor", "--json"});
  EXPECT_EQ(run.status, 0) << run.out;
  EXPECT_TRUE(json::parse(run.out)["ok"].get<bool>());
}

TEST(Doctor, WorksWithoutItsTemporaryFolder) {
  const char* const found = std::getenv("TMPDIR");
  const std::string before = found ? found : "";
  setenv("TMPDIR", "/nowhere", 1);
  const auto run = run_dyntape({"doctor"});
  found ? setenv("TMPDIR", before.c_str(), 1) : unsetenv("TMPDIR");
  EXPECT_EQ(run.status, 0) << run.out;
  EXPECT_NE(run.err.find("TMPDIR is not used, /tmp is: /nowhere"), std::string::npos) << run.err;
}

TEST(Verify, ARobotPassesAndOneThatMovesNothingFails) {
  const Scratch scratch;
  const std::string robot = source_folder() + "/config/robots/panda.urdf";
  const auto good = run_dyntape({"verify", robot, "--states", "5"});
  EXPECT_EQ(good.status, 0) << good.out << good.err;
  EXPECT_NE(good.out.find("All routes agree"), std::string::npos) << good.out;
  EXPECT_NE(good.out.find("mimics"), std::string::npos) << good.out;
  std::string light = slurp(robot);
  for (std::size_t at = 0; (at = light.find("<inertial>")) != std::string::npos;)
    light.erase(at, light.find("</inertial>") + 11 - at);
  std::ofstream(scratch / "light.urdf") << light;
  const auto bad = run_dyntape({"verify", scratch / "light.urdf", "--states", "5"});
  EXPECT_EQ(bad.status, 1) << bad.out << bad.err;
  EXPECT_NE((bad.out + bad.err).find("inertia"), std::string::npos) << bad.out << bad.err;
}

TEST(Advise, MeasuresATaskAndRefusesWhatIsNone) {
  const std::string tasks = source_folder() + "/config/tasks/";
  const auto advised = run_dyntape({"advise", tasks + "block_move.info", "--digits", "4"});
  EXPECT_EQ(advised.status, 0) << advised.out << advised.err;
  EXPECT_NE(advised.out.find("The optimum is 12.0000"), std::string::npos) << advised.out;
  EXPECT_NE(advised.out.find("method           riccati"), std::string::npos) << advised.out;
  EXPECT_NE(advised.out.find("less than a twentieth"), std::string::npos) << advised.out;
  EXPECT_EQ(advised.out.find("are not known"), std::string::npos) << advised.out;
  const auto ddp = run_dyntape({"advise", tasks + "cart_pole_ddp.info"});
  EXPECT_EQ(ddp.status, 1);
  EXPECT_NE(ddp.err.find("expected method riccati or ipopt"), std::string::npos) << ddp.err;
  const auto free_time =
      run_dyntape({"advise", tasks + "block_move_free_time.info", "--digits", "4", "--seconds", "30"});
  EXPECT_EQ(free_time.status, 0) << free_time.err;
  EXPECT_NE(free_time.out.find("The optimum is 9.2376"), std::string::npos) << free_time.out;
  EXPECT_EQ(run_dyntape({"advise", tasks + "block_move.info", "--digits", "0"}).status, 2);
  const auto hasty = run_dyntape({"advise", tasks + "block_move.info", "--seconds", "1e-6"});
  EXPECT_EQ(hasty.status, 1);
  EXPECT_NE(hasty.err.find("s that were given"), std::string::npos) << hasty.err;
}

// A wheel, whose velocity acts by nothing but rounding, is a sound robot; joints without room or without limits are told.
TEST(Verify, AWheelPassesAndLimitsThatAreNoneAreTold) {
  const Scratch scratch;
  const auto link = [](const char* name, const char* centre) {
    return std::string("<link name=\"") + name + "\"><inertial><origin xyz=\"" + centre +
           "\"/><mass value=\"1\"/><inertia ixx=\"0.1\" iyy=\"0.1\" izz=\"0.1\" ixy=\"0\" ixz=\"0\" "
           "iyz=\"0\"/></inertial></link>";
  };
  const auto joint = [](const char* name, const char* type, const char* parent, const char* child,
                        const char* limit) {
    return std::string("<joint name=\"") + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
           "\"/><child link=\"" + child + "\"/><origin xyz=\"0 0 0.3\"/><axis xyz=\"0 1 0\"/>" + limit +
           "</joint>";
  };
  for (const char* centre : {"0 0 1e-7", "0 0 0"}) {
    std::ofstream(scratch / "wheel.urdf")
        << "<robot name=\"wheel\"><link name=\"world\"/>" << link("fork", "0 0 0.1") << link("rim", centre)
        << joint("hinge", "revolute", "world", "fork",
                 "<limit lower=\"1\" upper=\"1\" effort=\"10\" velocity=\"5\"/>")
        << joint("axle", "continuous", "fork", "rim", "<limit effort=\"10\" velocity=\"5\"/>") << "</robot>";
    const auto run = run_dyntape({"verify", scratch / "wheel.urdf", "--states", "5"});
    EXPECT_EQ(run.status, 0) << run.out << run.err;
    EXPECT_NE(run.out.find("hinge: no room between"), std::string::npos) << run.out;
  }
  const auto times = run_dyntape({"bench", scratch / "wheel.urdf", "--function", "id-derivatives"});
  EXPECT_EQ(times.status, 0) << times.err;
  EXPECT_EQ(times.out.find("e+"), std::string::npos) << times.out;  // no error above what it is a part of
  std::ofstream(scratch / "sled.urdf")
      << "<robot name=\"sled\"><link name=\"world\"/>" << link("body", "0 0 0")
      << joint("glide", "planar", "world", "body", "") << "</robot>";
  const auto run = run_dyntape({"verify", scratch / "sled.urdf", "--states", "5"});
  EXPECT_EQ(run.status, 0) << run.out << run.err;
  EXPECT_NE(run.out.find("glide: planar"), std::string::npos) << run.out;
}

// A table, a picture of each part and a page that shows them.
TEST(Study, EachIsATableWithPicturesAndAPage) {
  const Scratch scratch;
  for (const char* name : {"routes", "slopes"}) {
    const auto run = run_dyntape({"study", name, "--quick", "--output", scratch / "study"});
    ASSERT_EQ(run.status, 0) << run.err;
  }
  const std::string routes = slurp(scratch / "study/routes.csv"), page = slurp(scratch / "study/routes.md");
  for (const char* route : {"fd-forward", "fd-central", "tape", "analytic", "generated"}) {
    EXPECT_NE(routes.find(route), std::string::npos) << route;
    EXPECT_NE(page.find(route), std::string::npos) << route;
  }
  EXPECT_NE(page.find("](routes_time.svg)"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(scratch / "study/routes_time.svg"));
  EXPECT_TRUE(std::filesystem::exists(scratch / "study/routes_step.svg"));
  const std::string derivatives = slurp(scratch / "study/slopes.csv");
  EXPECT_EQ(std::count(derivatives.begin(), derivatives.end(), '\n'),
            1 + 2 * 6 * 5);  // shapes, functions, sizes
  EXPECT_TRUE(std::filesystem::exists(scratch / "study/slopes_time.svg"));
}

// Texts of a picture: they are the same by every version of gnuplot.
std::vector<std::string> texts_of(const std::string& svg) {
  std::vector<std::string> texts;
  const std::regex text("<text>(.*)</text>");
  for (std::sregex_iterator it(svg.begin(), svg.end(), text), end; it != end; ++it) texts.push_back((*it)[1]);
  return texts;
}

TEST(Study, CommittedPicturesAreThoseOfCommittedTables) {
  const std::filesystem::path committed = std::filesystem::path(source_folder()) / "docs/studies";
  for (const char* name : {"routes", "integrators", "slopes", "compile", "schemes", "hessians", "arithmetic",
                           "contacts", "effects"}) {
    const Scratch scratch;
    const std::string table = std::string(name) + ".csv",
                      page = slurp(committed / (std::string(name) + ".md"));
    std::filesystem::create_directories(scratch / "study");
    std::filesystem::copy_file(committed / table, scratch / ("study/" + table));
    const auto run = run_dyntape({"study", name, "--redraw", "--output", scratch / "study"});
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_EQ(slurp(scratch / ("study/" + table)), slurp(committed / table));
    int pictures = 0;
    for (const auto& file : std::filesystem::directory_iterator(scratch / "study")) {
      if (file.path().extension() != ".svg") continue;
      ++pictures;
      EXPECT_EQ(texts_of(slurp(file.path())), texts_of(slurp(committed / file.path().filename())))
          << file.path();
      EXPECT_NE(page.find("](" + file.path().filename().string() + ")"), std::string::npos) << file.path();
    }
    EXPECT_GT(pictures, 0) << name;
  }
}

}  // namespace

}  // namespace commands_test
