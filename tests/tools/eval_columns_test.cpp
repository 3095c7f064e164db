// SPDX-License-Identifier: BSD-3-Clause
//
// eval reads what other commands write: columns by joint, columns that are none of its inputs, pipes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include <dyntape/interface/io/csv.h>

#include "run.h"

namespace eval_columns_test {
namespace {

using dyntape::io::CsvTable;
using dyntape::io::read_csv;
using dyntape::test::config;
using dyntape::test::Outcome;
using dyntape::test::run_dyntape;
using dyntape::test::Scratch;
using dyntape::test::slurp;

const std::string kCart = config("robots/cart_pole.urdf");

std::string file_of(const Scratch& scratch, const std::string& text) {
  std::ofstream(scratch / "states.csv") << text;
  return scratch / "states.csv";
}

Outcome eval(const std::string& robot, const std::string& function, const std::string& input,
             const std::string& output, std::vector<std::string> more = {}) {
  std::vector<std::string> words = {"eval",     robot,     "--function", function,   "--route",
                                    "analytic", "--input", input,        "--output", output};
  words.insert(words.end(), more.begin(), more.end());
  return run_dyntape(words);
}

void expect_sentence(const Outcome& run, const std::vector<std::string>& parts) {
  EXPECT_EQ(run.status, 1);
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  for (const std::string& part : parts)
    EXPECT_NE(run.err.find(part), std::string::npos) << part << "\n" << run.err;
}

// The torques that solve writes are those of inverse dynamics at its states.
TEST(Eval, ReadsTheMotionThatSolveWrites) {
  const Scratch scratch;
  const std::string task = config("tasks/two_link_arm_reaching.info");
  ASSERT_EQ(run_dyntape({"solve", task, "--output", scratch / "out"}).status, 0);
  const std::string motion = scratch / "out/trajectory.csv";
  const CsvTable table = read_csv(motion);
  const std::string joint = table.names()[1].substr(2);
  const std::string robot = config("robots/arm_2r.urdf");
  expect_sentence(eval(robot, "rnea", motion, scratch / "tau.csv"),
                  {"columns \"t\"", "\"tau." + joint + "\"", "are not inputs", "--pass-over"});
  const auto run = eval(robot, "rnea", motion, scratch / "tau.csv", {"--pass-over"});
  ASSERT_EQ(run.status, 0) << run.err;
  const CsvTable torques = read_csv(scratch / "tau.csv");
  ASSERT_EQ(torques.rows(), table.rows());
  const auto expected = table.column("tau." + joint), got = torques.column("tau0");
  for (int i = 0; i < table.rows(); ++i) EXPECT_NEAR(got[i], expected[i], 1e-6 * (1 + std::abs(expected[i])));
}

TEST(Eval, ReadsTheMotionThatIdentifyWrites) {
  const Scratch scratch;
  ASSERT_EQ(run_dyntape({"identify", kCart, "--excite", "--output", scratch / "out"}).status, 0);
  std::string motion;
  for (const auto& entry : std::filesystem::directory_iterator(scratch / "out")) {
    if (slurp(entry.path()).starts_with("t,q0")) motion = entry.path().string();
  }
  ASSERT_FALSE(motion.empty());
  const auto run = eval(kCart, "rnea", motion, scratch / "tau.csv", {"--pass-over"});
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(read_csv(scratch / "tau.csv").rows(), read_csv(motion).rows());
}

TEST(Eval, ColumnsByJointAreThoseByNumber) {
  const Scratch scratch;
  ASSERT_EQ(eval(kCart, "crba", file_of(scratch, "q0,q1\n0.1,0.7\n"), scratch / "a.csv").status, 0);
  ASSERT_EQ(eval(kCart, "crba", file_of(scratch, "q.pivot,q.slider\n0.7,0.1\n"), scratch / "b.csv").status,
            0);
  ASSERT_EQ(eval(kCart, "crba", file_of(scratch, "q1,q.slider\n0.7,0.1\n"), scratch / "c.csv").status, 0);
  EXPECT_EQ(slurp(scratch / "a.csv"), slurp(scratch / "b.csv"));
  EXPECT_EQ(slurp(scratch / "a.csv"), slurp(scratch / "c.csv"));
  expect_sentence(eval(kCart, "crba", file_of(scratch, "q0,q.slider,q1\n0,0,0\n"), "-"),
                  {"columns \"q0\" and \"q.slider\" are the same input"});
}

// solve holds such a joint's angle, eval takes cos and sin.
TEST(Eval, AnAngleStandsForCosineAndSine) {
  const Scratch scratch;
  std::string text = slurp(kCart);
  const std::size_t at = text.find("type=\"revolute\"");
  std::ofstream(scratch / "robot.urdf") << text.replace(at, 15, "type=\"continuous\"");
  const std::string robot = scratch / "robot.urdf";
  ASSERT_EQ(eval(robot, "crba", file_of(scratch, "q.slider,q.pivot\n0.1,0.7\n"), scratch / "a.csv").status,
            0);
  ASSERT_EQ(eval(kCart, "crba", file_of(scratch, "q0,q1\n0.1,0.7\n"), scratch / "b.csv").status, 0);
  const CsvTable a = read_csv(scratch / "a.csv"), b = read_csv(scratch / "b.csv");
  for (int k = 0; k < a.cols(); ++k) EXPECT_NEAR(a(0, k), b(0, k), 1e-15);
}

TEST(Eval, WhatHasNoColumnIsZeroOnRequest) {
  const Scratch scratch;
  const std::string states = file_of(scratch, "q.slider,q.pivot,v0,v1,tau.slider\n0,1,0,0,2\n");
  expect_sentence(
      eval(kCart, "aba", states, "-"),
      {"no column \"tau.pivot\"; expected q0 to tau1 (6 columns), or q.slider and so on", "--fill-zero"});
  const auto filled = eval(kCart, "aba", states, "-", {"--fill-zero"});
  const auto whole = eval(kCart, "aba", file_of(scratch, "q0,q1,v0,v1,tau0,tau1\n0,1,0,0,2,0\n"), "-");
  EXPECT_EQ(filled.status, 0) << filled.err;
  EXPECT_EQ(filled.out, whole.out);
  expect_sentence(eval(kCart, "crba", file_of(scratch, "other\n1\n"), "-", {"--fill-zero", "--pass-over"}),
                  {"no columns \"q0\" and \"q1\"; expected q0 to q1"});
}

TEST(Eval, ADashIsTheStandardInputOrOutput) {
  const Scratch scratch;
  const std::string states = file_of(scratch, "q0,q1\n0.1,0.7\n");
  const std::vector<std::string> words = {"eval", kCart,     "--function", "crba",     "--route",
                                          "tape", "--input", "-",          "--output", "-"};
  const auto piped = run_dyntape(words, "", states);
  ASSERT_EQ(piped.status, 0) << piped.err;
  ASSERT_EQ(eval(kCart, "crba", states, scratch / "out.csv").status, 0);
  EXPECT_EQ(piped.out, slurp(scratch / "out.csv"));
  EXPECT_FALSE(std::filesystem::exists("-"));
  expect_sentence(run_dyntape(words), {"the standard input:1:1: there is no header line"});
}

}  // namespace

}  // namespace eval_columns_test
