// SPDX-License-Identifier: BSD-3-Clause
//
// Runs the command as a user would: arguments as words, no shell.
#pragma once

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "../source_folder.h"

extern char** environ;

namespace dyntape::test {

struct Outcome {
  int status;
  std::string out, err;
};

inline std::string slurp(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

// A directory of its own for each test, removed with it.
class Scratch {
 public:
  Scratch() {
    char name[] = "/tmp/dyntape_test_XXXXXX";
    path_ = mkdtemp(name);
  }
  ~Scratch() { std::filesystem::remove_all(path_); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

// The command `dyntape` of this build.
std::string command_file();

// `output`: where the standard output goes in place of Outcome::out; `input`: a file in place of the standard input.
inline Outcome run_dyntape(const std::vector<std::string>& arguments, const std::string& output = "",
                           const std::string& input = "/dev/null") {
  const Scratch scratch;
  const std::string out = output.empty() ? scratch / "out" : output, err = scratch / "err";
  std::vector<std::string> words{command_file()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, input.c_str(), O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, out.c_str(), O_CREAT | O_WRONLY, 0600);
  posix_spawn_file_actions_addopen(&actions, 2, err.c_str(), O_CREAT | O_WRONLY, 0600);
  pid_t pid = 0;
  int status = -1;
  if (posix_spawn(&pid, argv[0], &actions, nullptr, argv.data(), environ) == 0) waitpid(pid, &status, 0);
  posix_spawn_file_actions_destroy(&actions);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, output.empty() ? slurp(out) : "", slurp(err)};
}

inline bool holds(const std::string& text, const std::string& part) { return text.find(part) != text.npos; }

inline std::string config(const std::string& name) {
  return std::string(test::source_folder() + "/config/") + name;
}

// Writes a task that takes some ten iterations of a second or more.
inline std::string long_task(const std::string& path) {
  std::string text = slurp(config("tasks/cart_pole_swing_up.info"));
  text.replace(text.find("intervals 40"), 12, "intervals 100000");
  text.replace(text.find("../robots"), 9, config("robots"));
  std::ofstream(path) << text;
  return path;
}

}  // namespace dyntape::test
