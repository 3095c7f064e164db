// SPDX-License-Identifier: BSD-3-Clause
//
// What commands say of themselves: whole, in the columns that there are; and of words that are none of theirs.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include <dyntape/interface/files/task/task_keys.h>

#include "run.h"

namespace help_test {
namespace {

using dyntape::test::config;
using dyntape::test::run_dyntape;

// The variable, for as long as this lives.
class Columns {
 public:
  explicit Columns(const char* columns) { setenv("COLUMNS", columns, 1); }
  ~Columns() { unsetenv("COLUMNS"); }
};

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// Characters, not bytes.
std::size_t widest(const std::string& text) {
  std::size_t most = 0;
  for (const std::string& line : lines_of(text)) {
    const auto count = std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; });
    most = std::max(most, static_cast<std::size_t>(count));
  }
  return most;
}

std::vector<std::string> subcommands(const std::string& help) {
  std::vector<std::string> names;
  bool is_list = false;
  for (const std::string& line : lines_of(help)) {
    if (is_list && line.size() > 2 && line[0] == ' ' && line[2] != ' ')
      names.push_back(line.substr(2, line.find(' ', 2) - 2));
    is_list = line == "Subcommands:" || (is_list && !line.empty());
  }
  return names;
}

// The help of a command and of those below it; returns how many there were.
int expect_fits(const std::vector<std::string>& command, std::size_t width) {
  std::vector<std::string> words = command;
  words.push_back("--help");
  const auto run = run_dyntape(words);
  // What measures is a program of its own, which may not have been built.
  if (run.err.find("dyntape-bench") != std::string::npos) return 1;
  std::string name;
  for (const std::string& word : command) name += word + " ";
  EXPECT_EQ(run.status, 0) << name << run.err;
  EXPECT_LE(widest(run.out), width) << name << "\n" << run.out;
  EXPECT_EQ(run.out.find("REQUIRED"), std::string::npos) << run.out;
  int count = 1;
  for (const std::string& next : subcommands(run.out)) {
    words = command;
    words.push_back(next);
    count += expect_fits(words, width);
  }
  return count;
}

TEST(Help, FitsIntoTheColumnsThatThereAre) {
  unsetenv("COLUMNS");
  EXPECT_GE(expect_fits({}, 80), 14);
  for (const char* columns : {"80", "120", "many", "-5", "0", "1000000", ""}) {
    const Columns set(columns);
    expect_fits({}, std::string(columns) == "120" ? 120 : 80);
  }
}

TEST(Help, FillsAWideTerminal) {
  const Columns set("120");
  EXPECT_GT(widest(run_dyntape({"eval", "--help"}).out), 80u);
}

TEST(Help, TeachesEveryFunction) {
  const std::string help = run_dyntape({"eval", "--help"}).out;
  for (const char* part : {"\nfunction ", "\nrnea ", "\nfd-second-derivatives ", "-> ddq_dq[nv x nv]",
                           "--inertia error|warn", "(default: fixed)", "(required)"})
    EXPECT_NE(help.find(part), std::string::npos) << part << "\n" << help;
}

TEST(Help, AMisspeltCommandHasANearestOne) {
  const auto run = run_dyntape({"inof", config("robots/panda.urdf")});
  EXPECT_EQ(run.status, 2);
  EXPECT_NE(run.err.find("'inof' is no command of dyntape; did you mean 'info'?"), std::string::npos)
      << run.err;
  const auto below = run_dyntape({"cache", "lst"});
  EXPECT_EQ(below.status, 2);
  EXPECT_NE(below.err.find("'lst' is no command of dyntape cache; did you mean 'list'?"), std::string::npos)
      << below.err;
}

TEST(Help, AMissingCommandIsOneOfAList) {
  const auto run = run_dyntape({"cache"});
  EXPECT_EQ(run.status, 2);
  EXPECT_NE(run.err.find("dyntape cache needs a command; expected list, verify or clear"), std::string::npos)
      << run.err;
}

TEST(Help, AMisspeltOptionHasANearestOne) {
  const auto run = run_dyntape({"info", config("robots/panda.urdf"), "--jsn"});
  EXPECT_EQ(run.status, 2);
  EXPECT_NE(run.err.find("\"info\" has no option '--jsn'; did you mean '--json'?"), std::string::npos)
      << run.err;
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 2) << run.err;
}

TEST(Keys, EveryKeyWithWhatItMeans) {
  const auto run = run_dyntape({"check-config", "--keys"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_LE(widest(run.out), 80u) << run.out;
  for (const char* key :
       {"\n  robot ", "\n    urdf ", "\n    inertia ", "\n    joint_friction", "\n      smoothing ",
        "default 1e-08", "required", "[rad/s or m/s]", "\n    check_derivatives", "\n  model_settings",
        "error | warn", "\n    tolerance "})
    EXPECT_NE(run.out.find(key), std::string::npos) << key << "\n" << run.out;
  for (const dyntape::io::Question& question : dyntape::task_questions()) {
    EXPECT_FALSE(question.meaning.empty()) << question.path;
    EXPECT_FALSE(question.takes.empty()) << question.path;
  }
}

}  // namespace

}  // namespace help_test
