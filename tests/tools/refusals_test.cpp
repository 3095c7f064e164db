// SPDX-License-Identifier: BSD-3-Clause
//
// What a command cannot do it says in one sentence, with an exit status that is not zero; and what looks odd but can be
// done is done.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>

#include "run.h"

namespace refusals_test {
namespace {

namespace fs = std::filesystem;
using dyntape::test::command_file;
using dyntape::test::config;
using dyntape::test::Outcome;
using dyntape::test::run_dyntape;
using dyntape::test::Scratch;
using dyntape::test::slurp;

const std::string kRobot = config("robots/pendulum.urdf");

void expect_sentence(const Outcome& run, const std::string& part) {
  EXPECT_EQ(run.status, 1) << run.err;
  EXPECT_NE(run.err.find(part), std::string::npos) << run.err;
  EXPECT_EQ(run.err.rfind("dyntape: ", 0), 0u) << run.err;
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
}

// The pendulum under another name.
std::string named(const Scratch& scratch, const std::string& name) {
  std::string text = slurp(kRobot);
  const std::string old = "robot name=\"pendulum\"";
  text.replace(text.find(old), old.size(), "robot name=\"" + name + "\"");
  std::ofstream(scratch / "robot.urdf") << text;
  return scratch / "robot.urdf";
}

// One state of the free block, its quaternion ending in w.
std::string block_state(const Scratch& scratch, const std::string& w) {
  std::ofstream file(scratch / "states.csv");
  for (int i = 0; i < 8; ++i) file << (i ? "," : "") << "q" << i;
  for (const char* block : {"v", "a"})
    for (int i = 0; i < 7; ++i) file << "," << block << i;
  file << "\n0,0,0,0,0,0," << w << ",0";
  for (int i = 0; i < 14; ++i) file << ",0";
  file << "\n";
  return scratch / "states.csv";
}

Outcome eval_block(const std::string& states, const std::string& output,
                   const std::string& route = "analytic") {
  return run_dyntape({"eval", config("robots/block.urdf"), "--base", "floating", "--function", "rnea",
                      "--route", route, "--input", states, "--output", output});
}

TEST(Refusals, AFullStandardOutputIsNoSuccess) {
  expect_sentence(run_dyntape({"info", kRobot}, "/dev/full"),
                  "standard output cannot be written: No space left");
  EXPECT_EQ(run_dyntape({"--help"}, "/dev/full").status, 1);
  EXPECT_EQ(run_dyntape({"info", kRobot, "--base", "none"}, "/dev/full").status,
            2);  // nothing was printed there
}

// What they would print goes nowhere, into no file that they open either.
TEST(Refusals, WithoutAStandardOutputNothingSucceeds) {
  const Scratch scratch;
  const std::string commands[] = {
      "info '" + kRobot + "'",
      "check-config '" + config("tasks/block_move.info") + "'",
      "sweep '" + config("sweeps/pendulum_amplitudes.info") + "' --output '" + (scratch / "0") + "'",
      "simulate '" + config("scenes/pendulum.info") + "' --output '" + (scratch / "1") + "'",
      "solve '" + config("tasks/block_move.info") + "' --output '" + (scratch / "2") + "'",
      "cache list"};
  for (const std::string& command : commands) {
    for (const char* closed : {">&-", "<&- >&-"}) {
      const std::string line =
          "exec '" + command_file() + "' " + command + " " + closed + " 2>'" + (scratch / "err") + "'";
      EXPECT_EQ(WEXITSTATUS(std::system(line.c_str())), 1) << line;
      EXPECT_NE(slurp(scratch / "err").find("standard output cannot be written"), std::string::npos) << line;
    }
  }
  // Nothing but the two streams is closed: files are as they are with them.
  const std::string line = "exec '" + command_file() + "' " + commands[2] + " >&- 2>&- <&-";
  EXPECT_EQ(WEXITSTATUS(std::system(line.c_str())), 1);
  ASSERT_EQ(
      run_dyntape({"sweep", config("sweeps/pendulum_amplitudes.info"), "--output", scratch / "3"}).status, 0);
  EXPECT_EQ(slurp(scratch / "0/sweep.csv"), slurp(scratch / "3/sweep.csv"));
}

TEST(Refusals, InputsThatAreNoFiles) {
  const Scratch scratch;
  ASSERT_EQ(mkfifo((scratch / "pipe").c_str(), 0600), 0);
  expect_sentence(run_dyntape({"info", scratch / ""}), "it is a folder; expected a file");
  expect_sentence(run_dyntape({"info", scratch / "pipe"}), "a pipe that nothing writes to");
  expect_sentence(run_dyntape({"info", "/dev/zero"}), "zero byte; expected a text file");
  expect_sentence(run_dyntape({"check-config", "/dev/zero"}), "zero byte; expected a text file");
  expect_sentence(eval_block(scratch / "pipe", scratch / "out.csv"), "a pipe that nothing writes to");
}

TEST(Refusals, OutputsThatAreNoFiles) {
  const Scratch scratch;
  const std::string states = block_state(scratch, "1");
  fs::create_symlink("target.csv", scratch / "link.csv");
  EXPECT_EQ(eval_block(states, scratch / "link.csv").status, 0);
  EXPECT_TRUE(fs::is_symlink(scratch / "link.csv"));
  EXPECT_TRUE(fs::is_regular_file(scratch / "target.csv"));
  expect_sentence(eval_block(states, scratch / ""), "it is a folder");
  expect_sentence(eval_block(states, "/dev/full"), "No space left");
  EXPECT_TRUE(fs::is_character_file("/dev/full"));

  fs::create_directories(scratch / "C");
  fs::create_symlink("elsewhere.c", scratch / "C/pendulum_rnea.c");
  EXPECT_EQ(run_dyntape({"generate", kRobot, "--function", "rnea", "--output", scratch / "C"}).status, 0);
  EXPECT_TRUE(fs::is_symlink(scratch / "C/pendulum_rnea.c"));
  EXPECT_TRUE(fs::is_regular_file(scratch / "C/elsewhere.c"));
}

TEST(Refusals, NamesThatNoFileCanHave) {
  const Scratch scratch;
  const std::string states = block_state(scratch, "1");
  expect_sentence(eval_block(states, scratch / "new/"), "expected the name of a file");
  EXPECT_FALSE(fs::exists(scratch / "new"));
  for (const std::vector<std::string>& words : {std::vector<std::string>{"info", ""},
                                                {"solve", config("tasks/block_move.info"), "--output", ""},
                                                {"cache", "list", "--folder", ""},
                                                {"generate", kRobot, "--function", "rnea", "--output", ""}}) {
    const Outcome run = run_dyntape(words);
    EXPECT_EQ(run.status, 2);
    EXPECT_NE(run.err.find("expected a name, got ''"), std::string::npos) << run.err;
  }
  EXPECT_THROW(dyntape::read_file(""), dyntape::FileError);
  EXPECT_THROW(dyntape::write_file_atomically("", "text"), dyntape::FileError);
}

// Root may write everything, so that somebody else has to try.
TEST(Refusals, FilesThatAreWriteProtected) {
  const Scratch scratch;
  const std::string file = scratch / "o.csv";
  std::ofstream(file) << "kept";
  ASSERT_EQ(chmod(file.c_str(), 0444), 0);
  ASSERT_EQ(chmod((scratch / "").c_str(), 0777), 0);
  const pid_t child = fork();
  if (child == 0) {
    constexpr uid_t kNobody = 65534;
    if (geteuid() == 0 && seteuid(kNobody) != 0) _exit(2);
    try {
      dyntape::write_file_atomically(file, "new");
    } catch (const dyntape::FileError& e) {
      _exit(std::string(e.what()).ends_with("cannot write: Permission denied") ? 0 : 3);
    }
    _exit(1);
  }
  int status = -1;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(slurp(file), "kept");
}

TEST(Refusals, AFolderOfACacheThatIsNotThere) {
  const Scratch scratch;
  for (const char* command : {"list", "verify", "clear"})
    expect_sentence(run_dyntape({"cache", command, "--folder", scratch / "typo"}), "there is no such folder");
  EXPECT_FALSE(fs::exists(scratch / "typo"));
}

// Said before the work, and by check-config as well where it is the task's fault.
TEST(Refusals, WhatASolutionCouldNotBeWrittenFor) {
  const Scratch scratch;
  const std::string task = config("tasks/block_move.info");
  std::ofstream(scratch / "file") << "";
  expect_sentence(run_dyntape({"solve", task, "--output", scratch / "file"}),
                  "it is a file; expected a folder");
  fs::create_directories(scratch / "out/report.json");
  expect_sentence(run_dyntape({"solve", task, "--output", scratch / "out"}), "report.json: cannot write");

  std::string text = slurp(task);
  text.replace(text.find("../robots"), 9, config("robots"));
  std::ofstream(scratch / "latin.info") << "name caf\xe9\n" << text;
  std::ofstream(scratch / "caf\xe9.info") << text;  // where none is given, the file's is the task's
  for (const char* command : {"solve", "check-config"})
    for (const char* file : {"latin.info", "caf\xe9.info"})
      expect_sentence(run_dyntape({command, scratch / file}), "the task has a name that is not UTF-8");
}

TEST(Refusals, RobotsWithoutInertiaGetNoCode) {
  const Scratch scratch;
  const std::string robot = scratch / "massless.urdf";
  std::string text = slurp(config("robots/block.urdf"));
  text.replace(text.find("mass value=\"1\""), 14, "mass value=\"0\"");
  std::ofstream(robot) << text;
  for (const char* function : {"minverse", "aba", "fd-derivatives"})
    expect_sentence(
        run_dyntape({"generate", robot, "--function", function, "--embedded", "--output", scratch / "c"}),
        "moves no inertia");
  EXPECT_FALSE(fs::exists(scratch / "c"));
  EXPECT_EQ(
      run_dyntape({"generate", robot, "--function", "rnea", "--embedded", "--output", scratch / "c"}).status,
      0);
}

TEST(Refusals, RobotsThatDoNotMoveAreNotMeasured) {
  const Scratch scratch;
  std::ofstream(scratch / "one.urdf") << R"(<robot name="one"><link name="only"/></robot>)";
  expect_sentence(run_dyntape({"bench", scratch / "one.urdf"}), "\"one\" has no joint that moves");
}

TEST(Refusals, NumbersOfTheCommandLineAreDecimalAndInTheirRange) {
  const auto with = [](const std::string& command, const std::string& option, const std::string& value) {
    return run_dyntape({command, kRobot, option, value});
  };
  for (const char* value : {"-1", "0x10", "1e3", "18446744073709551616", ""}) {
    const Outcome run = with("bench", "--seed", value);
    EXPECT_EQ(run.status, 2) << value;
    EXPECT_NE(run.err.find("whole number of 0 to 18446744073709551615"), std::string::npos) << run.err;
  }
  for (const char* value : {"inf", "nan", "1e400", "0", "-1"}) {
    const Outcome run = with("identify", "--period", value);
    EXPECT_EQ(run.status, 2) << value;
    EXPECT_NE(run.err.find("expected a finite number above zero"), std::string::npos) << run.err;
  }
  EXPECT_EQ(with("bench", "--states", "0").status, 2);
  const Outcome ten =
      run_dyntape({"bench", kRobot, "--function", "gravity", "--states", "010", "--seed", "+7", "--json"});
  ASSERT_EQ(ten.status, 0) << ten.err;
  EXPECT_NE(ten.out.find("\"states\": 10\n"), std::string::npos) << ten.out;
  EXPECT_NE(ten.out.find("\"seed\": 7,"), std::string::npos) << ten.out;
}

TEST(Refusals, DeclarationsInADocumentType) {
  const Scratch scratch;
  std::ofstream(scratch / "d.urdf") << "<!DOCTYPE r [<!ENTITY a \"b\">]>\n<robot name=\"r\"/>";
  expect_sentence(run_dyntape({"info", scratch / "d.urdf"}), "d.urdf:2: before <robot> stands a <!DOCTYPE>");
}

TEST(Refusals, LongNamesAreShortened) {
  const Scratch scratch;
  const std::string name(100000, 'n');
  std::ofstream(scratch / "states.csv") << "\"" << name << "\"\n1\n";
  for (const Outcome& run :
       {run_dyntape({"info", kRobot, "--lock", name}), run_dyntape({"info", kRobot, "--base", name}),
        eval_block(scratch / "states.csv", scratch / "o.csv")}) {
    EXPECT_NE(run.status, 0);
    EXPECT_LT(run.err.size(), 1000u);
  }
  expect_sentence(run_dyntape({"info", kRobot, "--lock", name}), "\"" + std::string(59, 'n') + "...\"");
}

// Its mass matrix would take half a gigabyte.
TEST(Refusals, ColumnsAreCheckedBeforeALargeRobotIsPrepared) {
  const Scratch scratch;
  constexpr int kJoints = 8000;
  std::ofstream robot(scratch / "chain.urdf"), states(scratch / "states.csv");
  robot << R"(<robot name="chain"><link name="l0"/>)";
  for (int i = 0; i < kJoints; ++i) {
    robot << R"(<link name="l)" << i + 1 << R"("/><joint name="j)" << i
          << R"(" type="revolute"><parent link="l)" << i << R"("/><child link="l)" << i + 1
          << R"("/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint>)";
    states << "q" << i << ",";
  }
  robot << "</robot>", states << "odd\n";
  robot.close(), states.close();
  const auto start = std::chrono::steady_clock::now();
  expect_sentence(run_dyntape({"eval", scratch / "chain.urdf", "--function", "crba", "--route", "analytic",
                               "--input", scratch / "states.csv", "--output", scratch / "o.csv"}),
                  "column \"odd\" is not an input");
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));
}

TEST(Refusals, StatesWithoutADirection) {
  const Scratch scratch;
  const std::string states = block_state(scratch, "0");
  for (const char* route : {"analytic", "tape", "generated"})
    expect_sentence(eval_block(states, scratch / "out.csv", route),
                    "q3 to q6, is zero; expected any length but zero");
  EXPECT_FALSE(fs::exists(scratch / "out.csv"));
}

TEST(Refusals, NamesThatAreNotUtf8) {
  const Scratch scratch;
  expect_sentence(run_dyntape({"info", named(scratch, "p\xe9ndule"), "--json"}),
                  "robot.urdf:7: a <robot> has a name");
  EXPECT_EQ(run_dyntape({"info", named(scratch, "p\xc3\xa9ndule"), "--json"}).status, 0);
  for (const char* name : {"\xe0\x80\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xf0\x9f"})
    expect_sentence(run_dyntape({"info", named(scratch, name)}), "is not UTF-8");
  expect_sentence(run_dyntape({"info", named(scratch, "a&#10;b")}), "holds a line break");
  expect_sentence(
      run_dyntape({"generate", kRobot, "--function", "rnea", "--json", "--output", scratch / "\xe9"}),
      "is not UTF-8");
}

TEST(Refusals, AnAngleBelowZero) {
  expect_sentence(run_dyntape({"info", kRobot, "--snap", "-1"}),
                  "snap is -1 rad; expected an angle of 0 to 0.01");
}

TEST(Refusals, NamesWithLineBreaksDoNotSplitMessages) {
  const Scratch scratch;
  expect_sentence(run_dyntape({"check-config", "no\nfile"}), "no file: cannot open");
  expect_sentence(run_dyntape({"info", kRobot, "--lock", "no\njoint"}), "no joint");
  const Outcome wrong = run_dyntape({"info", kRobot, "--base", "a\nb"});
  EXPECT_EQ(wrong.err.rfind("--base: a b not in", 0), 0u) << wrong.err;
}

TEST(Oddities, LongNamesAndTrigraphsAreGenerated) {
  const Scratch scratch;
  for (const std::string& name : {std::string(250, 'n'), std::string("a*?\?/"), std::string("b?\?/")}) {
    for (const char* kind : {"--json", "--embedded"}) {
      const Outcome run = run_dyntape(
          {"generate", named(scratch, name), "--function", "rnea", "--output", scratch / "c", kind});
      ASSERT_EQ(run.status, 0) << run.err;
    }
  }
  for (const auto& file : fs::directory_iterator(scratch / "c")) {
    if (file.path().extension() != ".c") continue;
    const std::string compile =
        "gcc -std=c99 -Wall -Wextra -Werror -pedantic -c -o /dev/null " + file.path().string();
    EXPECT_EQ(std::system(compile.c_str()), 0);
  }
}

// A folder that a failing run made, and left nothing in, goes with it; one that was there, or holds something, stays.
TEST(Refusals, NoEmptyFolderIsLeft) {
  const Scratch scratch;
  std::string text = slurp(config("tasks/block_move.info"));
  const auto replace = [&](const std::string& old, const std::string& with) {
    ASSERT_NE(text.find(old), std::string::npos) << old;
    text.replace(text.find(old), old.size(), with);
  };
  replace("../robots", config("robots"));
  const std::size_t intervals = text.find("intervals");
  ASSERT_NE(intervals, std::string::npos);
  text.replace(intervals, text.find('\n', intervals) - intervals, "intervals 2000000000");
  std::ofstream(scratch / "large.info") << text;
  const auto solve = [&](const std::string& folder) {
    expect_sentence(run_dyntape({"solve", scratch / "large.info", "--output", scratch / folder}),
                    "GB of memory");
  };
  solve("one"), solve("one/two/three/");
  EXPECT_FALSE(fs::exists(scratch / "one"));
  fs::create_directory(scratch / "mine");
  solve("mine"), solve("mine/inner");
  EXPECT_TRUE(fs::exists(scratch / "mine"));
  EXPECT_TRUE(fs::is_empty(scratch / "mine"));
}

}  // namespace

}  // namespace refusals_test
