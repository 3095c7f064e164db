// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/process.h>

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <sstream>
#include <thread>

extern char** environ;

namespace dyntape::codegen {
namespace {

using Clock = std::chrono::steady_clock;

struct Running {
  pid_t pid = 0;
  std::size_t command = 0;
  Clock::time_point started;
  int ended_for = 0;  // by us: the reason
};

// Our environment with messages in English and temporary files where they are removed with the rest.
std::vector<std::string> environment_for(const Command& command) {
  std::vector<std::string> result;
  for (char** entry = environ; *entry; ++entry) {
    const std::string text = *entry;
    if (text.starts_with("LC_ALL=")) continue;
    if (!command.temporary_folder.empty() && text.starts_with("TMPDIR=")) continue;
    result.push_back(text);
  }
  result.push_back("LC_ALL=C");
  if (!command.temporary_folder.empty()) result.push_back("TMPDIR=" + command.temporary_folder);
  return result;
}

std::vector<char*> pointers_to(const std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (const std::string& text : texts) pointers.push_back(const_cast<char*>(text.c_str()));
  pointers.push_back(nullptr);
  return pointers;
}

// posix_spawn sets no limits, and to set them once the program runs is too late for what it has started by
// then.  util-linux's prlimit sets them and becomes the program.
std::vector<std::string> bounded(const std::vector<std::string>& arguments, std::size_t bytes) {
  constexpr const char* kPrlimit = "/usr/bin/prlimit";
  if (access(kPrlimit, X_OK) != 0 || access(arguments[0].c_str(), X_OK) != 0) return arguments;
  std::vector<std::string> result = {kPrlimit, "--as=" + std::to_string(bytes), "--core=0", "--"};
  result.insert(result.end(), arguments.begin(), arguments.end());
  return result;
}

// 0 and the process, or the error number.
int start(const Command& command, std::size_t bytes, pid_t& pid) {
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&files);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, 1, command.log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&files, 1, 2);
  posix_spawn_file_actions_addclosefrom_np(&files, 3);
  // Its own process group, so that a compiler driver and what it started end together; signals as a fresh
  // program expects them, whatever the host does with its own.
  sigset_t none, defaults;
  sigemptyset(&none);
  sigemptyset(&defaults);
  for (int signal : {SIGCHLD, SIGPIPE, SIGINT, SIGTERM, SIGHUP}) sigaddset(&defaults, signal);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &defaults);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  const std::vector<std::string> environment = environment_for(command);
  const std::vector<std::string> arguments = bounded(command.arguments, bytes);
  const int error = posix_spawn(&pid, arguments[0].c_str(), &files, &attributes,
                                pointers_to(arguments).data(), pointers_to(environment).data());
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  return error;
}

std::string text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

int status_of(int wait_status) {
  return WIFEXITED(wait_status) ? WEXITSTATUS(wait_status) : 128 + WTERMSIG(wait_status);
}

// Ends the process, for the reason that its outcome is to give.
void end(Running& running, int reason) {
  if (running.ended_for) return;
  kill(-running.pid, SIGKILL);
  running.ended_for = reason;
}

// Whether the process has ended; then fills the outcome.
bool has_ended(Running& running, const Bounds& bounds, Outcome& outcome) {
  int wait_status = 0;
  const pid_t result = waitpid(running.pid, &wait_status, WNOHANG);
  if (result == 0) {
    const std::chrono::duration<double> age = Clock::now() - running.started;
    if (age.count() > bounds.seconds) end(running, Outcome::kTimedOut);
    if (bounds.stop.stop_requested()) end(running, Outcome::kStopped);
    return false;
  }
  // Where the host ignores SIGCHLD there is no status to collect (ECHILD): the caller sees what was written.
  outcome.status = result < 0 ? 0 : status_of(wait_status);
  if (running.ended_for) outcome.status = running.ended_for;
  return true;
}

}  // namespace

std::vector<Outcome> run_all(const std::vector<Command>& commands, const Bounds& bounds) {
  std::vector<Outcome> outcomes(commands.size());
  std::vector<Running> running;
  std::size_t next = 0;
  auto pause = std::chrono::microseconds(200);
  while (next < commands.size() || !running.empty()) {
    while (next < commands.size() && running.size() < std::max(bounds.jobs, 1u)) {
      if (bounds.stop.stop_requested()) {
        outcomes[next++].status = Outcome::kStopped;
        continue;
      }
      Running process{0, next, Clock::now(), 0};
      if (const int error = start(commands[next], bounds.bytes, process.pid)) {
        outcomes[next].output = std::strerror(error);
      } else {
        running.push_back(process);
      }
      ++next;
    }
    const std::size_t before = running.size();
    std::erase_if(running, [&](Running& r) {
      if (!has_ended(r, bounds, outcomes[r.command])) return false;
      outcomes[r.command].output = text_of(commands[r.command].log);
      return true;
    });
    if (running.size() == before && !running.empty()) {
      std::this_thread::sleep_for(pause);
      pause = std::min(pause * 2, std::chrono::microseconds(2000));
    }
  }
  return outcomes;
}

std::string to_text(const std::vector<std::string>& arguments) {
  std::string text;
  for (const std::string& argument : arguments) {
    const bool plain =
        !argument.empty() && argument.find_first_of(" \t\n'\"\\$&;|<>()*?#`") == std::string::npos;
    std::string quoted = argument;
    for (std::size_t at = 0; !plain && (at = quoted.find('\'', at)) != std::string::npos; at += 4)
      quoted.replace(at, 1, "'\\''");
    text += (text.empty() ? "" : " ") + (plain ? argument : "'" + quoted + "'");
  }
  return text;
}

}  // namespace dyntape::codegen
