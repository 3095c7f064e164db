// SPDX-License-Identifier: BSD-3-Clause
//
// What a command cannot do it says in one sentence, with an exit status that is not zero; and what looks odd but can be
// done is done.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "run.h"

namespace {

namespace fs = std::filesystem;
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

}  // namespace
