// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape sweep as a user runs it, and as a machine ends it: killed at any moment, what is on disk is whole, and the sweep
// that goes on ends with the same bytes.
#include <gtest/gtest.h>

#include <signal.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "run.h"

namespace sweep_test {
namespace {

using namespace std::chrono_literals;
using dyntape::test::command_file;
using dyntape::test::config;
using dyntape::test::holds;
using dyntape::test::Outcome;
using dyntape::test::run_dyntape;
using dyntape::test::Scratch;
using dyntape::test::slurp;
using nlohmann::json;
namespace fs = std::filesystem;

std::vector<std::string> words_of(const std::string& file, const std::string& output,
                                  const std::vector<std::string>& more = {}) {
  std::vector<std::string> words = {"sweep", file, "--output", output};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

// Pendulums that swing for long enough to be killed on the way: some 50 chunks of 20 ms.
std::string long_sweep(const Scratch& scratch, const std::string& seed = "1") {
  std::ofstream(scratch / "scene.info")
      << "robot\n{\n urdf \"" << config("robots/double_pendulum.urdf")
      << "\"\n}\nstart\n{\n q 1\n}\nsimulation\n{\n duration 6\n step 1e-3\n}\n";
  std::string name = scratch / "sweep.info";
  std::ofstream(name)
      << "scene scene.info\nsamples 800\nseed " << seed
      << "\nvary\n{\n value\n {\n  parameter start.q\n  from -2\n  to 2\n }\n value\n {\n  of "
         "start.v\n  distribution normal\n  mean 0\n  standard_deviation 1\n }\n}\nevaluation\n{\n threads "
         "2\n}\n";
  return name;
}

// Ended from outside after a while, or by itself.
struct Started {
  pid_t pid = 0;
  explicit Started(std::vector<std::string> words) {
    words.insert(words.begin(), command_file());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
    posix_spawn(&pid, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
  }
  int send(int signal) const {
    int status = 0;
    kill(pid, signal);
    waitpid(pid, &status, 0);
    return status;
  }
};

// Without the hidden file of a chunk that was being written when the sweep was killed.
long chunks_in(const std::string& output) {
  std::error_code none;
  long count = 0;
  for (const auto& entry : fs::directory_iterator(output + "/chunks", none))
    count += entry.path().extension() == ".rows" && entry.path().filename().string().front() != '.';
  return count;
}

// Waits until a few chunks are written; a machine at other work may need a minute.
void wait_for_chunks(const std::string& output) {
  for (int k = 0; k < 60000 && chunks_in(output) < 3; ++k) std::this_thread::sleep_for(1ms);
}

TEST(Sweep, WritesATableAPictureAndAReport) {
  const Scratch scratch;
  const std::string file = config("sweeps/pendulum_amplitudes.info"), output = scratch / "out";
  const Outcome run = run_dyntape(words_of(file, output));
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_TRUE(holds(run.out, "30 samples")) << run.out;
  EXPECT_TRUE(holds(slurp(output + "/sweep.svg"), "</svg>"));
  EXPECT_FALSE(fs::exists(output + "/chunks"));
  EXPECT_FALSE(fs::exists(output + "/failures.txt"));
  const json report = json::parse(slurp(output + "/report.json"));
  EXPECT_TRUE(report["success"]);
  EXPECT_EQ(report["samples"], 30);
  EXPECT_EQ(report["failed"], 0);
  const std::string table = slurp(output + "/sweep.csv");
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 31);
  // Once more: it is there.
  const auto written = fs::last_write_time(output + "/sweep.csv");
  const Outcome again = run_dyntape(words_of(file, output));
  EXPECT_EQ(again.status, 0) << again.err;
  EXPECT_TRUE(holds(again.out, "finished by an earlier run")) << again.out;
  EXPECT_EQ(fs::last_write_time(output + "/sweep.csv"), written);
  const Outcome anew = run_dyntape(words_of(file, output, {"--restart"}));
  EXPECT_EQ(anew.status, 0) << anew.err;
  EXPECT_NE(fs::last_write_time(output + "/sweep.csv"), written);
  EXPECT_EQ(slurp(output + "/sweep.csv"), table);
  // The effective file means the same.
  fs::copy_file(output + "/effective.info", scratch / "again.info");
  ASSERT_EQ(run_dyntape(words_of(scratch / "again.info", scratch / "second")).status, 0);
  EXPECT_EQ(slurp(scratch / "second/sweep.csv"), table);
}

// The last row of its motion is the row of the sweep.
TEST(Sweep, OneSampleIsSimulatedAlone) {
  const Scratch scratch;
  const std::string file = config("sweeps/pendulum_amplitudes.info");
  ASSERT_EQ(run_dyntape(words_of(file, scratch / "all")).status, 0);
  const Outcome one = run_dyntape(words_of(file, scratch / "one", {"--sample", "17"}));
  EXPECT_EQ(one.status, 0) << one.err;
  EXPECT_TRUE(holds(one.out, "start.q 1.7999999999999998")) << one.out;
  const std::string table = slurp(scratch / "all/sweep.csv"), motion = slurp(scratch / "one/motion.csv");
  const std::string last = motion.substr(motion.rfind('\n', motion.size() - 2) + 1);
  EXPECT_TRUE(
      holds(table, "\n17,1.7999999999999998,1," + last.substr(0, last.find(',', last.find(',', 3) + 1))))
      << last;
  EXPECT_TRUE(fs::exists(scratch / "one/motion.html"));
  EXPECT_TRUE(holds(slurp(scratch / "one/effective.info"), "Sample 17 of")) << one.out;
  EXPECT_TRUE(holds(slurp(scratch / "one/report.json"), "start.q 1.7999999999999998"));
  const Outcome none = run_dyntape(words_of(file, scratch / "one", {"--sample", "30"}));
  EXPECT_EQ(none.status, 1);
  EXPECT_TRUE(holds(none.err, "samples 0 to 29")) << none.err;
}

TEST(Sweep, KilledAtAnyMomentItEndsWithTheSameBytes) {
  const Scratch scratch;
  const std::string file = long_sweep(scratch);
  ASSERT_EQ(run_dyntape(words_of(file, scratch / "whole")).status, 0);
  const std::string whole = slurp(scratch / "whole/sweep.csv");
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_EQ(run_dyntape(words_of(file, scratch / "again")).status, 0);  // compiled already
  const auto took = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::mt19937 random(17);
  std::uniform_real_distribution<double> pause(0, took);
  int kills = 0, went_on = 0;
  for (int round = 0; (kills < 20 || went_on < 5) && round < 100; ++round) {
    const std::string output = scratch / ("killed" + std::to_string(round));
    for (int attempt = 0; attempt < 2; ++attempt) {
      const Started sweep(words_of(file, output));
      std::this_thread::sleep_for(std::chrono::duration<double>(pause(random)));
      const bool was_killed = WIFSIGNALED(sweep.send(SIGKILL));
      kills += was_killed;
      went_on += was_killed && chunks_in(output) > 0;
    }
    const Outcome rest = run_dyntape(words_of(file, output));
    ASSERT_EQ(rest.status, 0) << rest.err;
    EXPECT_EQ(slurp(output + "/sweep.csv"), whole) << round;
    EXPECT_FALSE(fs::exists(output + "/chunks"));
    for (const auto& entry : fs::directory_iterator(output)) {
      const std::string name = entry.path().filename();
      EXPECT_TRUE(name[0] != '.' || name == ".dyntape-results") << entry.path();
    }
  }
  EXPECT_GE(kills, 20) << "of a sweep that takes " << took << " s";
  EXPECT_GE(went_on, 5);
}

TEST(Sweep, CtrlCKeepsWhatIsDone) {
  const Scratch scratch;
  const std::string file = long_sweep(scratch), output = scratch / "out";
  ASSERT_EQ(run_dyntape(words_of(file, scratch / "whole")).status, 0);
  const Started sweep(words_of(file, output));
  wait_for_chunks(output);
  const auto begin = std::chrono::steady_clock::now();
  const int status = sweep.send(SIGINT);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 1s);
  EXPECT_EQ(WEXITSTATUS(status), 130);
  EXPECT_GE(chunks_in(output), 3);
  EXPECT_FALSE(fs::exists(output + "/sweep.csv"));
  const Outcome rest = run_dyntape(words_of(file, output));
  EXPECT_EQ(rest.status, 0);
  EXPECT_TRUE(holds(rest.err, "resumed, ")) << rest.err;
  EXPECT_EQ(slurp(output + "/sweep.csv"), slurp(scratch / "whole/sweep.csv"));
}

TEST(Sweep, AnotherSweepIsRefused) {
  const Scratch scratch;
  const std::string output = scratch / "out";
  const std::string file = long_sweep(scratch);
  {
    const Started sweep(words_of(file, output));
    wait_for_chunks(output);
    kill(sweep.pid, SIGSTOP);  // so that it does not end before the second has started
    const Outcome second = run_dyntape(words_of(file, output));
    EXPECT_EQ(second.status, 1);
    EXPECT_TRUE(holds(second.err, "another sweep is running in this folder")) << second.err;
    sweep.send(SIGKILL);
  }
  const long left = chunks_in(output);
  long_sweep(scratch, "2");
  const Outcome other = run_dyntape(words_of(file, output));
  EXPECT_EQ(other.status, 1);
  EXPECT_TRUE(holds(other.err, "holds another sweep")) << other.err;
  EXPECT_TRUE(holds(other.err, "--restart")) << other.err;
  EXPECT_EQ(std::count(other.err.begin(), other.err.end(), '\n'), 1) << other.err;
  EXPECT_EQ(chunks_in(output), left);
  EXPECT_EQ(run_dyntape(words_of(file, output, {"--restart"})).status, 0);
  // And where it is finished.
  long_sweep(scratch, "3");
  EXPECT_EQ(run_dyntape(words_of(file, output)).status, 1);
}

TEST(Sweep, FullDisksAndFoldersThatAreNoneEndInASentence) {
  const Scratch scratch;
  const std::string file = long_sweep(scratch), output = scratch / "out";
  std::ofstream(scratch / "taken") << "x";
  const Outcome taken = run_dyntape(words_of(file, scratch / "taken"));
  EXPECT_EQ(taken.status, 1);
  EXPECT_TRUE(holds(taken.err, "it is a file; expected a folder")) << taken.err;
  ASSERT_EQ(run_dyntape(words_of(file, scratch / "whole")).status, 0);
  // No file may have more than 1000 bytes.
  const std::string line = std::string("trap '' XFSZ; exec prlimit --fsize=1000 ") + command_file() +
                           " sweep '" + file + "' --output '" + output + "' >/dev/null 2>'" +
                           (scratch / "err") + "'";
  EXPECT_EQ(WEXITSTATUS(std::system(line.c_str())), 1);
  EXPECT_TRUE(holds(slurp(scratch / "err"), ".rows")) << slurp(scratch / "err");
  EXPECT_EQ(chunks_in(output), 0);
  ASSERT_EQ(run_dyntape(words_of(file, output)).status, 0);
  EXPECT_EQ(slurp(output + "/sweep.csv"), slurp(scratch / "whole/sweep.csv"));
}

TEST(Sweep, RefusesInASentence) {
  const Scratch scratch;
  const std::string out = scratch / "out", file = config("sweeps/pendulum_amplitudes.info");
  std::ofstream(scratch / "bad.info")
      << "scene \"" << config("scenes/pendulum.info")
      << "\"\nsamples 3\nvary\n{\n value\n {\n  parameter start.k\n  from 0\n  to 1\n "
         "}\n}\n";
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{"sweep", file}, "--output is required"},
      {words_of("none.info", out), "none.info"},
      {words_of(config("scenes/pendulum.info"), out), "this is a scene"},
      {words_of(config("robots/pendulum.urdf"), out), "not a sweep"},
      {words_of(scratch / "bad.info", out), "bad.info:7:13: nothing in the scene is called 'start.k'"},
      {words_of(file, out, {"--sample", "-1"}), "whole number"},
  };
  for (const auto& [words, expected] : cases) {
    const Outcome run = run_dyntape(words);
    EXPECT_NE(run.status, 0) << words[1];
    EXPECT_TRUE(holds(run.err, expected)) << run.err;
    EXPECT_FALSE(fs::exists(out)) << words[1];
  }
  EXPECT_EQ(run_dyntape({"check-config", file}).status, 0);
  EXPECT_EQ(run_dyntape({"check-config", scratch / "bad.info"}).status, 1);
}

}  // namespace

}  // namespace sweep_test
