// SPDX-License-Identifier: BSD-3-Clause
//
// Folders of results with files of their users in them: what dyntape has not written stays, byte for byte, whatever it is
// called; what a run reads is not replaced by what it finds; one run at a time.
#include <gtest/gtest.h>

#include <signal.h>

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "run.h"

namespace result_folders_test {
namespace {

using namespace std::chrono_literals;
using dyntape::test::command_file;
using dyntape::test::config;
using dyntape::test::holds;
using dyntape::test::long_task;
using dyntape::test::Outcome;
using dyntape::test::run_dyntape;
using dyntape::test::Scratch;
using dyntape::test::slurp;
using nlohmann::json;
namespace fs = std::filesystem;

void put(const std::string& path, const std::string& text) {
  fs::create_directories(fs::path(path).parent_path());
  std::ofstream(path) << text;
}

using Words = std::vector<std::string>;

const std::string kSweep = config("sweeps/pendulum_amplitudes.info");
Words sweep_to(const std::string& output, const Words& more = {}) {
  Words words = {"sweep", kSweep, "--output", output};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

std::string name_of_words(const Words& words) { return words[0] + " " + words[1]; }

// An arm that follows a motion: of a file, if there is one.
std::string following_task(const Scratch& scratch, const std::string& motion) {
  const std::string task = scratch / "follows.info";
  put(task, "robot\n{\n urdf \"" + config("robots/pendulum.urdf") +
                "\"\n}\nhorizon\n{\n duration 1\n intervals 10\n}\nstart\n{\n q 0\n}\ngoal\n{\n q "
                "0.1\n}\ncosts\n{\n "
                "control 1\n}\nreference\n{\n file \"" +
                motion + "\"\n q 1\n}\n");
  return task;
}
const std::string kMotion = "t,q.hinge\n0,0\n1,0.1\n";

// Names with all that temporary files of sweeps have, but one thing.
TEST(ResultFolders, FilesOfTheirUsersStay) {
  const Scratch scratch;
  std::mt19937 random(3);
  const auto number = [&] { return std::to_string(random() % 3000); };
  std::map<std::string, std::string> mine;
  for (const char* name :
       {".notes.2026-11-25.tmp", ".x.2026-11-25.tmpl", "failures.txt", "forces.svg", "feedback.svg", ".lock",
        "chunks.rows", ".sweep.2026-11-25.tmp.csv", ".report.1-2-3.tmp.json",
        ".failures.2026-11-25-7.tmp.txt", "chunks/mine.rows", "chunks/.000001.2026-11-25.tmp.rows",
        "chunks/12.rows.txt", "chunks/x000001.rows", "sub/report.json"})
    mine[name] = std::string("mine: ") + name;
  for (int k = 0; k < 20; ++k) {
    mine["." + std::string(k % 2 ? "sweep" : "failures") + "." + number() + "-" + number() + "-" + number() +
         "-" + number() + ".tmp" + (k % 2 ? ".csv" : ".txt")] = "mine " + number();
  }
  const std::string scene = config("scenes/pendulum.info");
  const Words commands[] = {sweep_to("", {}),
                            sweep_to("", {"--restart"}),
                            sweep_to("", {"--sample", "3"}),
                            {"simulate", scene, "--output", ""},
                            {"solve", config("tasks/block_move.info"), "--output", ""}};
  for (const Words& command : commands) {
    const std::string output = scratch / "out";
    fs::remove_all(output);
    for (const auto& [name, text] : mine) put(output + "/" + name, text);
    Words words = command;
    *(std::find(words.begin(), words.end(), "--output") + 1) = output;
    for (int round = 0; round < 2; ++round) {
      const Outcome run = run_dyntape(words);
      EXPECT_EQ(run.status, 0) << name_of_words(words) << run.err;
      for (const auto& [name, text] : mine)
        EXPECT_EQ(slurp(output + "/" + name), text) << name << " after " << name_of_words(words);
    }
  }
}

// What every run writes, somebody has written there already.
TEST(ResultFolders, ResultsReplaceNothingThatIsNotDyntapes) {
  const Scratch scratch;
  const std::string task = config("tasks/block_move.info"), scene = config("scenes/pendulum.info");
  const std::pair<Words, Words> cases[] = {
      {sweep_to(""), {"report.json", "sweep.csv", "effective.info", "chunks/000000.rows"}},
      {sweep_to("", {"--restart"}), {"report.json", "sweep.csv", "effective.info", "chunks/000001.rows"}},
      {sweep_to("", {"--sample", "3"}), {"report.json", "motion.csv"}},
      {{"simulate", scene, "--output", ""}, {"report.json", "motion.csv", "effective.info"}},
      {{"solve", task, "--output", ""}, {"report.json", "trajectory.csv", "iterations.csv"}},
      {{"mpc", config("control/arm_holds.info"), "--output", ""}, {"report.json", "closed_loop.csv"}}};
  for (const auto& [command, names] : cases) {
    for (const std::string& name : names) {
      const std::string output = scratch / "out";
      fs::remove_all(output);
      put(output + "/" + name, "{\"mine\": 1}");
      Words words = command;
      *(std::find(words.begin(), words.end(), "--output") + 1) = output;
      const Outcome run = run_dyntape(words);
      EXPECT_EQ(run.status, 1) << name_of_words(words) << " over " << name;
      EXPECT_TRUE(holds(run.err, name)) << run.err;
      EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
      EXPECT_EQ(slurp(output + "/" + name), "{\"mine\": 1}") << name_of_words(words);
    }
  }
  // A picture that cannot be put in its place: the rest is there, the status says so.
  const std::string output = scratch / "pictures";
  put(output + "/trajectory.svg", "mine");
  const Outcome run = run_dyntape({"simulate", scene, "--output", output});
  EXPECT_EQ(run.status, 1);
  EXPECT_TRUE(holds(run.err, "trajectory.svg")) << run.err;
  EXPECT_EQ(slurp(output + "/trajectory.svg"), "mine");
  EXPECT_EQ(json::parse(slurp(output + "/report.json"))["success"], false);
  // Results that somebody has changed since are his.
  ASSERT_EQ(run_dyntape({"simulate", scene, "--output", scratch / "again"}).status, 0);
  ASSERT_EQ(run_dyntape({"simulate", scene, "--output", scratch / "again"}).status, 0);
  std::ofstream(scratch / "again/effective.info", std::ios::app) << "; and my own remarks\n";
  const std::string changed = slurp(scratch / "again/effective.info");
  const Outcome over = run_dyntape({"simulate", scene, "--output", scratch / "again"});
  EXPECT_EQ(over.status, 1);
  EXPECT_TRUE(holds(over.err, "effective.info: this file has changed since dyntape wrote it")) << over.err;
  EXPECT_EQ(slurp(scratch / "again/effective.info"), changed);
}

TEST(ResultFolders, WhatARunReadsIsNotReplaced) {
  const Scratch scratch;
  const std::string out = scratch / "out";
  const auto refused = [&](const Words& words, const std::string& input) {
    const std::string before = slurp(input);
    ASSERT_FALSE(before.empty()) << input;
    const Outcome run = run_dyntape(words);
    EXPECT_EQ(run.status, 1) << name_of_words(words);
    EXPECT_TRUE(holds(run.err, fs::path(input).filename().string() + ": this file is read here")) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_EQ(slurp(input), before) << input;
  };
  put(out + "/trajectory.csv", kMotion);
  refused({"solve", following_task(scratch, out + "/trajectory.csv"), "--output", out},
          out + "/trajectory.csv");
  // Results of an earlier run as well.
  ASSERT_EQ(run_dyntape({"solve", config("tasks/block_move.info"), "--output", scratch / "before"}).status,
            0);
  refused({"solve", scratch / "before/effective.info", "--output", scratch / "before"},
          scratch / "before/effective.info");
  ASSERT_EQ(run_dyntape({"simulate", config("scenes/pendulum.info"), "--output", scratch / "swing"}).status,
            0);
  refused({"simulate", scratch / "swing/effective.info", "--output", scratch / "swing"},
          scratch / "swing/effective.info");
  // By way of a file that is named in a file, of a link, and of a line that includes it.
  put(scratch / "servo.info", "robot\n{\n urdf \"" + config("robots/pendulum.urdf") +
                                  "\"\n}\ncommands\n{\n file \"" + (scratch / "link/motion.csv") +
                                  "\"\n}\nsimulation\n{\n duration 0.1\n}\n");
  put(scratch / "commands/motion.csv", "t,tau.hinge\n0,0\n1,1\n");
  fs::create_directory_symlink(scratch / "commands", scratch / "link");
  refused({"simulate", scratch / "servo.info", "--output", scratch / "commands"},
          scratch / "commands/motion.csv");
  put(scratch / "inner/effective.info", "simulation\n{\n duration 0.1\n}\n");
  put(scratch / "outer.info",
      "robot\n{\n urdf \"" + config("robots/pendulum.urdf") + "\"\n}\n#include \"inner/effective.info\"\n");
  refused({"simulate", scratch / "outer.info", "--output", scratch / "inner"},
          scratch / "inner/effective.info");
  put(scratch / "swept/effective.info", slurp(scratch / "swing/effective.info"));
  put(scratch / "sweep.info",
      "scene swept/effective.info\nsamples 3\nvary\n{\n value\n {\n  parameter start.q\n  from 0\n  to 1\n "
      "}\n}\n");
  for (const Words& more : {Words{}, Words{"--restart"}, Words{"--sample", "1"}}) {
    Words words = {"sweep", scratch / "sweep.info", "--output", scratch / "swept"};
    words.insert(words.end(), more.begin(), more.end());
    refused(words, scratch / "swept/effective.info");
  }
  // And of commands that write one file.
  put(scratch / "states.csv", "q0,v0,a0\n0,0,0\n");
  refused({"eval", config("robots/pendulum.urdf"), "--function", "rnea", "--route", "tape", "--input",
           scratch / "states.csv", "--output", scratch / "states.csv"},
          scratch / "states.csv");
}

// Killed on its way, a run has removed nothing.
TEST(ResultFolders, OlderResultsStayUntilThereAreNewOnes) {
  const Scratch scratch;
  const std::string out = scratch / "out";
  ASSERT_EQ(run_dyntape({"solve", config("tasks/block_move.info"), "--output", out}).status, 0);
  const auto files = [&] {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::directory_iterator(out)) all[entry.path().filename()] = slurp(entry.path());
    return all;
  };
  const auto before = files();
  EXPECT_GE(before.size(), 7u);
  const std::string line = std::string("exec ") + command_file() + " solve '" +
                           long_task(scratch / "long.info") + "' --output '" + out + "' >/dev/null 2>'" +
                           (scratch / "err") + "'";
  const pid_t child = fork();
  if (child == 0) {
    setpgid(0, 0);
    execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
    _exit(127);
  }
  for (int k = 0; k < 3000 && !holds(slurp(scratch / "err"), ": iteration "); ++k)
    std::this_thread::sleep_for(20ms);
  EXPECT_TRUE(holds(slurp(scratch / "err"), ": iteration ")) << slurp(scratch / "err");
  // Nobody else writes there meanwhile.
  for (const Words& words :
       {Words{"solve", config("tasks/block_move.info"), "--output", out},
        Words{"simulate", config("scenes/pendulum.info"), "--output", out + "/."},
        Words{"mpc", config("control/arm_holds.info"), "--output", out}, sweep_to(out)}) {
    const Outcome second = run_dyntape(words);
    EXPECT_EQ(second.status, 1) << name_of_words(words);
    EXPECT_TRUE(holds(second.err, "another run is writing its results in this folder")) << second.err;
  }
  kill(-child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_EQ(files(), before);
  ASSERT_EQ(run_dyntape({"solve", config("tasks/block_move.info"), "--output", out}).status, 0);
}

// Of two that begin at once the results are all of one.
TEST(ResultFolders, TwoRunsDoNotMix) {
  const Scratch scratch;
  std::string text = slurp(config("tasks/block_move.info"));
  text.replace(text.find("../robots"), 9, config("robots"));
  std::string other = text;
  const std::size_t at = other.find("intervals");
  other.replace(at, other.find('\n', at) - at, "intervals 33");
  put(scratch / "a.info", text), put(scratch / "b.info", other);
  for (const char* name : {"a", "b"})
    ASSERT_EQ(
        run_dyntape({"solve", scratch / (std::string(name) + ".info"), "--output", scratch / name}).status,
        0);
  for (int pair = 0; pair < 6; ++pair) {
    const std::string out = scratch / ("out" + std::to_string(pair));
    Outcome first{}, second{};
    std::thread beside([&] { first = run_dyntape({"solve", scratch / "a.info", "--output", out}); });
    second = run_dyntape({"solve", scratch / "b.info", "--output", out});
    beside.join();
    EXPECT_TRUE(first.status == 0 || second.status == 0) << first.err << second.err;
    const std::string table = slurp(out + "/trajectory.csv");
    const char* const whose = table == slurp(scratch / "a/trajectory.csv") ? "a" : "b";
    for (const char* file : {"trajectory.csv", "iterations.csv", "motion.html"})
      EXPECT_EQ(slurp(out + "/" + file), slurp(scratch / whose + ("/" + std::string(file)))) << pair;
    const auto sizes = [&](const std::string& folder) {
      return json::parse(slurp(folder + "/report.json"))["sizes"];
    };
    EXPECT_EQ(sizes(out), sizes(scratch / whose)) << pair;
  }
}

TEST(ResultFolders, FinishedSweepsAreLookedAt) {
  const Scratch scratch;
  const std::string out = scratch / "out";
  ASSERT_EQ(run_dyntape(sweep_to(out)).status, 0);
  const std::string whole = slurp(out + "/sweep.csv");
  const auto first_lines = [&](int n) {
    std::size_t end = 0;
    for (int k = 0; k < n; ++k) end = whole.find('\n', end) + 1;
    return whole.substr(0, end);
  };
  std::string flipped = whole;
  flipped[whole.size() / 2] ^= 1;
  for (const std::string& damaged :
       {first_lines(5), whole.substr(0, whole.size() - 7), first_lines(1), flipped, std::string()}) {
    std::ofstream(out + "/sweep.csv") << damaged;
    const Outcome again = run_dyntape(sweep_to(out));
    EXPECT_EQ(again.status, 1) << again.out;
    EXPECT_TRUE(holds(again.err, "sweep.csv: this file has changed since")) << again.err;
    EXPECT_EQ(slurp(out + "/sweep.csv"), damaged);
  }
  ASSERT_EQ(run_dyntape(sweep_to(out, {"--restart"})).status, 0);
  EXPECT_EQ(slurp(out + "/sweep.csv"), whole);
  // Without the table, or the report, it is computed once more.
  for (const char* file : {"sweep.csv", "report.json"}) {
    fs::remove(out + "/" + file);
    const Outcome again = run_dyntape(sweep_to(out));
    EXPECT_EQ(again.status, 0) << again.err;
    EXPECT_FALSE(holds(again.out, "finished by an earlier run")) << file;
    EXPECT_EQ(slurp(out + "/sweep.csv"), whole);
  }
}

// Each is read once, from the working folder.
TEST(Pipes, TasksAndScenesComeByThem) {
  const Scratch scratch;
  const auto piped = [&](const std::string& file, const std::string& words, const std::string& from) {
    const std::string line = "cd '" + fs::path(file).parent_path().string() + "' && cat '" + file + "' | '" +
                             command_file() + "' " + words + " " + from + " >'" + (scratch / "out") +
                             "' 2>'" + (scratch / "err") + "'";
    const int status = std::system(("bash -c \"" + line + "\"").c_str());
    return Outcome{WEXITSTATUS(status), slurp(scratch / "out"), slurp(scratch / "err")};
  };
  const std::pair<std::string, std::string> cases[] = {
      {"tasks/block_move.info", "check-config"},
      {"scenes/pendulum.info", "check-config"},
      {"sweeps/pendulum_amplitudes.info", "check-config"},
      {"control/solo12_pushed.info", "check-config"},
      {"tasks/block_move.info", "solve"},
      {"scenes/pendulum.info", "simulate"},
      {"sweeps/pendulum_amplitudes.info", "sweep --output '" + (scratch / "swept") + "'"}};
  for (const auto& [file, words] : cases) {
    for (const char* from : {"/dev/stdin", "/dev/fd/0", "<(cat)"}) {
      if (words.starts_with("sweep")) fs::remove_all(scratch / "swept");
      const Outcome run = piped(config(file), words, from);
      EXPECT_EQ(run.status, 0) << file << " " << words << " " << from << "\n" << run.err;
    }
  }
  const Outcome robot = piped(config("robots/pendulum.urdf"), "simulate", "/dev/stdin");
  EXPECT_EQ(robot.status, 1);
  EXPECT_TRUE(holds(robot.err, "a robot by a pipe can be read once only")) << robot.err;
}

}  // namespace

}  // namespace result_folders_test
