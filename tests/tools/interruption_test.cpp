// SPDX-License-Identifier: BSD-3-Clause
//
// Ctrl-C, full disks and what is left behind, with the command as a user runs it.
#include <gtest/gtest.h>

#include <signal.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "run.h"

namespace interruption_test {
namespace {

using namespace std::chrono_literals;
using dyntape::test::command_file;
using dyntape::test::config;
using dyntape::test::long_task;
using dyntape::test::Outcome;
using dyntape::test::run_dyntape;
using dyntape::test::Scratch;
using dyntape::test::slurp;
using nlohmann::json;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// A command that runs, with a cache and a folder for temporary files of its own.
class Running {
 public:
  Running(const Scratch& scratch, std::vector<std::string> words) : scratch_(scratch) {
    fs::create_directories(scratch / "tmp");
    words.insert(words.begin(), {"/usr/bin/env", "DYNTAPE_CACHE=" + (scratch / "cache"),
                                 "TMPDIR=" + (scratch / "tmp"), command_file()});
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 1, (scratch / "out").c_str(), O_CREAT | O_WRONLY, 0600);
    posix_spawn_file_actions_addopen(&actions, 2, (scratch / "err").c_str(), O_CREAT | O_WRONLY, 0600);
    posix_spawn(&pid_, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
  }

  void send(int signal) const { kill(pid_, signal); }
  Outcome wait() const {
    int status = 0;
    waitpid(pid_, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, slurp(scratch_ / "out"), slurp(scratch_ / "err")};
  }
  bool has_ended() const {
    siginfo_t info{};
    waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT);
    return info.si_pid != 0;
  }

 private:
  const Scratch& scratch_;
  pid_t pid_ = 0;
};

// Whether it came true before the command ended, and within a minute.
template <class Condition>
bool reached(const Running& command, Condition&& condition) {
  for (const auto begin = Clock::now(); Clock::now() - begin < 60s && !command.has_ended();) {
    if (condition()) return true;
    std::this_thread::sleep_for(2ms);
  }
  return false;
}

std::vector<std::string> builds_in(const std::string& cache) {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(cache, none)) {
    const std::string name = entry.path().filename();
    if (name.starts_with("build-")) names.push_back(name);
  }
  return names;
}

// Processes that have the text among their words.
int processes_with(const std::string& text) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") == std::string::npos)
      count += slurp(entry.path() / "cmdline").find(text) != std::string::npos;
  }
  return count;
}

// The compiler of a function that takes it seconds is at work.
bool compiles(const std::string& cache) {
  for (const std::string& build : builds_in(cache)) {
    if (processes_with(build) > 0) return true;
  }
  return false;
}

const std::vector<std::string> kLongToCompile = {"solve", config("tasks/arm_effort.info"), "--set",
                                                 "evaluation.route=compiled"};

TEST(Interruption, WhileCompilingNothingIsLeft) {
  for (std::vector<std::string> words : {kLongToCompile, {"mpc", config("control/solo12_whole_body.info")}}) {
    const Scratch scratch;
    const std::string cache = scratch / "cache", results = scratch / "results";
    words.insert(words.end(), {"--output", results});
    const Running command(scratch, words);
    ASSERT_TRUE(reached(command, [&] { return compiles(cache); }));
    const auto begin = Clock::now();
    command.send(SIGINT);
    const Outcome outcome = command.wait();
    EXPECT_LT(Clock::now() - begin, 1s) << words[0];
    EXPECT_EQ(outcome.status, 130) << outcome.err;
    EXPECT_TRUE(words[0] == "mpc" || outcome.err.find("there is no motion yet") != std::string::npos)
        << outcome.err;
    EXPECT_TRUE(builds_in(cache).empty());
    EXPECT_TRUE(fs::is_empty(scratch / "tmp"));
    // What was killed takes a moment to be gone.
    for (int k = 0; k < 100 && processes_with(cache) > 0; ++k) std::this_thread::sleep_for(10ms);
    EXPECT_EQ(processes_with(cache), 0);
    EXPECT_FALSE(fs::exists(results + "/trajectory.csv"));
  }
}

// Where the solve does not wait for it: there may be a motion by then.
TEST(Interruption, ACompilerInTheBackgroundLeavesNothing) {
  const Scratch scratch;
  const std::string cache = scratch / "cache";
  const Running command(scratch, {"solve", config("tasks/arm_effort.info")});
  ASSERT_TRUE(reached(command, [&] { return compiles(cache); }));
  command.send(SIGINT);
  const Outcome outcome = command.wait();
  EXPECT_EQ(outcome.status, 130) << outcome.err;
  EXPECT_NE((outcome.err + outcome.out).find("nterrupted "), std::string::npos) << outcome.err;
  EXPECT_TRUE(builds_in(cache).empty());
  EXPECT_TRUE(fs::is_empty(scratch / "tmp"));
  for (int k = 0; k < 100 && processes_with(cache) > 0; ++k) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(processes_with(cache), 0);
}

TEST(Interruption, WhileSolvingTheBestMotionIsWritten) {
  const Scratch scratch;
  const std::string task = long_task(scratch / "task.info"), results = scratch / "results";
  const Running command(scratch, {"solve", task, "--output", results, "--json"});
  // A line now and then where there is no terminal.
  ASSERT_TRUE(
      reached(command, [&] { return slurp(scratch / "err").find(": iteration ") != std::string::npos; }));
  EXPECT_NE(slurp(scratch / "err").find("solving on 100000 intervals: iteration "), std::string::npos);
  std::this_thread::sleep_for(200ms);  // an iteration of so large a program takes a second or two
  const auto begin = Clock::now();
  command.send(SIGINT);
  const Outcome outcome = command.wait();
  EXPECT_LT(Clock::now() - begin, 15s);  // the iteration, and a table of 100 000 rows
  EXPECT_EQ(outcome.status, 130) << outcome.err;
  const json report = json::parse(outcome.out);
  EXPECT_EQ(report["status"], "stopped");
  EXPECT_EQ(report["interrupted"], true);
  EXPECT_NE(outcome.err.find("Interrupted after " + std::to_string(report["iterations"].get<int>())),
            std::string::npos)
      << outcome.err;
  EXPECT_TRUE(fs::exists(results + "/trajectory.csv"));
  EXPECT_EQ(json::parse(slurp(results + "/report.json"))["status"], "stopped");
  EXPECT_TRUE(fs::is_empty(scratch / "tmp"));
  EXPECT_TRUE(builds_in(scratch / "cache").empty());
  EXPECT_EQ(processes_with(scratch / "cache"), 0);
  // The limits of the robot between points are not searched any more, and the report does not say that they hold.
  EXPECT_TRUE(report["limits"]["kept"].is_null()) << report["limits"];
}

// Whether it reads a robot, records, or makes the functions of a plant with contacts: 0.8 to 1.9 s were seen.
TEST(Interruption, BeforeThereIsAResultItEndsAtOnce) {
  const std::vector<std::vector<std::string>> commands = {
      {"solve", config("tasks/humanoid_squat.info")},
      {"solve", config("tasks/quadruped_stands_up.info")},
      {"simulate", config("scenes/g1_compliant_floor.info")}};
  for (const std::vector<std::string>& words : commands) {
    for (const auto delay : {100ms, 250ms}) {
      const Scratch scratch;
      const Running command(scratch, words);
      std::this_thread::sleep_for(delay);
      const auto begin = Clock::now();
      command.send(SIGINT);
      const Outcome outcome = command.wait();
      EXPECT_LT(Clock::now() - begin, 600ms) << words[1];  // 0.1 s on a machine with nothing else to do
      EXPECT_EQ(outcome.status, 130) << outcome.err;
      EXPECT_NE(outcome.err.find("interrupted"), std::string::npos) << outcome.err;
      EXPECT_TRUE(builds_in(scratch / "cache").empty());
      EXPECT_TRUE(fs::is_empty(scratch / "tmp"));
    }
  }
}

TEST(Interruption, TheVerdictIsSaidOnce) {
  const Scratch scratch;
  const std::string task = long_task(scratch / "task.info");
  const Running command(scratch, {"solve", task});
  ASSERT_TRUE(
      reached(command, [&] { return slurp(scratch / "err").find(": iteration ") != std::string::npos; }));
  command.send(SIGINT);
  const Outcome outcome = command.wait();
  EXPECT_EQ(outcome.status, 130) << outcome.err;
  EXPECT_NE(outcome.out.find("Interrupted after "), std::string::npos) << outcome.out;
  EXPECT_EQ(outcome.err.find("Interrupted after "), std::string::npos) << outcome.err;
}

TEST(Interruption, TheSecondEndsAtOnce) {
  const Scratch scratch;
  const Running command(scratch, kLongToCompile);
  ASSERT_TRUE(reached(command, [&] { return compiles(scratch / "cache"); }));
  command.send(SIGTERM);
  std::this_thread::sleep_for(150ms);
  command.send(SIGINT);
  const Outcome outcome = command.wait();
  EXPECT_TRUE(outcome.status == 130 || outcome.status == 143) << outcome.status;
}

// As `timeout` sends them: to the program and to its group.
TEST(Interruption, TwoAtOnceAreOne) {
  const Scratch scratch;
  const Running command(scratch, kLongToCompile);
  ASSERT_TRUE(reached(command, [&] { return compiles(scratch / "cache"); }));
  command.send(SIGTERM);
  command.send(SIGINT);
  const Outcome outcome = command.wait();
  EXPECT_TRUE(outcome.status == 130 || outcome.status == 143) << outcome.status;
  EXPECT_EQ(outcome.err.find("interrupted again"), std::string::npos) << outcome.err;
  EXPECT_TRUE(builds_in(scratch / "cache").empty());
}

TEST(Interruption, BuildsThatWereKilledAreSeenAndCleared) {
  const Scratch scratch;
  const std::string cache = scratch / "cache";
  const Running command(scratch, kLongToCompile);
  ASSERT_TRUE(reached(command, [&] { return compiles(cache); }));
  const auto at_work = json::parse(run_dyntape({"cache", "list", "--folder", cache, "--json"}).out)["builds"];
  const auto here = [&](const json& builds) {
    std::vector<std::string> states;
    for (const json& b : builds) {
      if (b["folder"].get<std::string>().starts_with(cache)) states.push_back(b["state"]);
    }
    return states;
  };
  EXPECT_EQ(here(at_work), (std::vector<std::string>{"at work"}));
  command.send(SIGKILL);
  command.wait();
  const auto list = run_dyntape({"cache", "list", "--folder", cache});
  EXPECT_NE(list.out.find("interrupted"), std::string::npos) << list.out;
  const auto killed = json::parse(run_dyntape({"cache", "list", "--folder", cache, "--json"}).out)["builds"];
  EXPECT_EQ(here(killed), (std::vector<std::string>{"interrupted"}));
  const auto cleared = json::parse(run_dyntape({"cache", "clear", "--folder", cache, "--json"}).out);
  EXPECT_GE(cleared["builds_removed"].get<int>(), 1);
  EXPECT_TRUE(builds_in(cache).empty());
}

// A limit on the size of files stands for a disk that is full: gnuplot goes on without a word.
TEST(FullDisk, EveryFileIsWholeOrTheStatusSaysSo) {
  const Scratch scratch;
  const std::string task = config("tasks/block_move.info");
  const Outcome whole = run_dyntape({"solve", task, "--output", scratch / "whole"});
  ASSERT_EQ(whole.status, 0) << whole.err;  // and the cache has the library
  const auto largest = fs::file_size(scratch / "whole/trajectory.svg");
  ASSERT_GT(largest, fs::file_size(scratch / "whole/trajectory.csv"));
  const std::string limit = std::to_string(largest - 100), results = scratch / "results";
  const std::string line = "trap '' XFSZ; exec prlimit --fsize=" + limit + " " + command_file() + " solve '" +
                           task + "' --output '" + results + "' >/dev/null 2>'" + (scratch / "err") + "'";
  const int status = std::system(line.c_str());
  EXPECT_EQ(WEXITSTATUS(status), 1) << slurp(scratch / "err");
  EXPECT_NE(slurp(scratch / "err").find("trajectory.svg"), std::string::npos) << slurp(scratch / "err");
  for (const auto& file : fs::directory_iterator(results)) {
    if (file.path().extension() != ".svg") continue;
    EXPECT_NE(slurp(file.path()).find("</svg>"), std::string::npos) << file.path();
  }
  const json report = json::parse(slurp(results + "/report.json"));
  EXPECT_EQ(report["success"], false);
  EXPECT_NE(report["unwritten"].dump().find("trajectory.svg"), std::string::npos) << report["unwritten"];
  EXPECT_EQ(json::parse(slurp(scratch / "whole/report.json"))["success"], true);
}

TEST(FullDisk, ADeviceThatIsFullIsNoSuccess) {
  const Scratch scratch;
  const std::string results = scratch / "results";
  for (const char* full : {"trajectory.csv", "motion.svg", "motion.html"}) {
    fs::remove_all(results);
    fs::create_directory(results);
    fs::create_symlink("/dev/full", results + "/" + full);
    const Outcome run =
        run_dyntape({"solve", config("tasks/block_move.info"), "--output", results, "--json"});
    EXPECT_EQ(run.status, 1) << run.err;
    EXPECT_NE(run.err.find(full), std::string::npos) << run.err;
    const json report = json::parse(run.out);
    EXPECT_EQ(report["success"], false);
    EXPECT_EQ(report["unwritten"].size(), 1u) << report["unwritten"];
    EXPECT_EQ(json::parse(slurp(results + "/report.json")), report);
    EXPECT_TRUE(fs::exists(results + "/effective.info"));
  }
}

TEST(Generate, SaysHowLargeTheTextIs) {
  const Scratch scratch;
  const std::string arm = config("robots/double_pendulum.urdf");
  const Outcome small = run_dyntape({"generate", arm, "--function", "rnea", "--output", scratch / "c"});
  EXPECT_EQ(small.status, 0) << small.err;
  EXPECT_NE(small.out.find("kB of C"), std::string::npos) << small.out;
  const Outcome large = run_dyntape({"generate", config("robots/panda.urdf"), "--function", "fd-derivatives",
                                     "--order", "2", "--output", scratch / "large"});
  EXPECT_EQ(large.status, 1);
  EXPECT_NE(large.err.find("MB of C, more than 20 MB"), std::string::npos) << large.err;
  EXPECT_NE(large.err.find("--yes"), std::string::npos) << large.err;
  EXPECT_FALSE(fs::exists(scratch / "large"));
}

}  // namespace

}  // namespace interruption_test
