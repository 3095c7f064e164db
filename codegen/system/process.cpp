// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/system/process.h>

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <thread>

#include <dyntape/codegen/system/files.h>

namespace dyntape::codegen {
namespace {

using Clock = std::chrono::steady_clock;

struct Running {
  pid_t pid = 0;
  std::size_t command = 0;
  Clock::time_point started;
  Descriptor log;
};

// What a program finds its parts and files by, and nothing that makes a compiler read other headers, load other
// libraries or take other options (CPATH, GCC_EXEC_PREFIX, LD_PRELOAD, ...).  Messages are in English, temporary files
// where they are removed with the rest.
std::vector<std::string> environment_for(const Command& command) {
  std::vector<std::string> result = {"LC_ALL=C"};
  const auto pass = [&](const std::string& name, const char* value, const char* otherwise) {
    if (value || otherwise) result.push_back(name + "=" + (value ? value : otherwise));
  };
  pass("PATH", std::getenv("PATH"), "/usr/local/bin:/usr/bin:/bin");
  pass("HOME", std::getenv("HOME"), nullptr);
  const std::string& folder = command.temporary_folder;
  pass("TMPDIR", folder.empty() ? std::getenv("TMPDIR") : folder.c_str(), nullptr);
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
  struct rlimit given {};  // beyond which only root can go
  if (getrlimit(RLIMIT_AS, &given) == 0) bytes = std::min<std::size_t>(bytes, given.rlim_max);
  if (access(kPrlimit, X_OK) != 0 || access(arguments[0].c_str(), X_OK) != 0) return arguments;
  std::vector<std::string> result = {kPrlimit, "--as=" + std::to_string(bytes), "--core=0", "--"};
  result.insert(result.end(), arguments.begin(), arguments.end());
  return result;
}

// What is to be started and how: posix_spawn without its paperwork.
class Start {
 public:
  explicit Start(pid_t group) {
    posix_spawn_file_actions_init(&files_);
    posix_spawnattr_init(&attributes_);
    // Signals as a fresh program expects them, whatever the host does with its own.
    sigset_t none, defaults;
    sigemptyset(&none);
    sigemptyset(&defaults);
    for (int signal : {SIGCHLD, SIGPIPE, SIGINT, SIGTERM, SIGHUP}) sigaddset(&defaults, signal);
    posix_spawnattr_setpgroup(&attributes_, group);
    posix_spawnattr_setsigmask(&attributes_, &none);
    posix_spawnattr_setsigdefault(&attributes_, &defaults);
    posix_spawnattr_setflags(&attributes_,
                             POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  ~Start() {
    posix_spawn_file_actions_destroy(&files_);
    posix_spawnattr_destroy(&attributes_);
  }
  Start(const Start&) = delete;
  Start& operator=(const Start&) = delete;

  void open(int number, const char* path, int how) {
    posix_spawn_file_actions_addopen(&files_, number, path, how, 0600);
  }
  void give(int number, int as) { posix_spawn_file_actions_adddup2(&files_, number, as); }
  // 0 and the process, or the error number.
  int run(const std::vector<std::string>& arguments, const std::vector<std::string>& environment,
          pid_t& pid) {
    posix_spawn_file_actions_addclosefrom_np(&files_, 3);
    return posix_spawn(&pid, arguments[0].c_str(), &files_, &attributes_, pointers_to(arguments).data(),
                       pointers_to(environment).data());
  }

 private:
  posix_spawn_file_actions_t files_;
  posix_spawnattr_t attributes_;
};

// The process group of the programs and of all that they start.  A shell leads it and waits for the end of a pipe that
// only we hold open: if we are ended, by Ctrl-C or SIGKILL, it ends the group.
class Group {
 public:
  Group() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) return;
    const Descriptor read_end(ends[0]);
    held_ = Descriptor(ends[1]);
    Start start(0);
    start.give(read_end.number(), 0);
    start.open(1, "/dev/null", O_WRONLY);
    start.give(1, 2);
    if (start.run({"/bin/sh", "-c", "read end; kill -KILL 0"}, {}, leader_) != 0) leader_ = 0;
    // Emulators (qemu's user mode) do not wait until the shell has started, and so has a group.
    if (leader_) (void)setpgid(leader_, leader_);
  }
  ~Group() {
    end();
    if (leader_) waitpid(leader_, nullptr, 0);
  }
  Group(const Group&) = delete;
  Group& operator=(const Group&) = delete;

  pid_t number() const { return leader_; }
  void end() const {
    if (leader_) kill(-leader_, SIGKILL);
  }

 private:
  Descriptor held_;
  pid_t leader_ = 0;  // none: there is no shell, and each program is a group of its own
};

Descriptor log_of(const Command& command) {
  return Descriptor(command.log.empty()
                        ? memfd_create("log", MFD_CLOEXEC)
                        : open(command.log.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
}

std::string text_of(const Descriptor& log) {
  int error = 0;
  lseek(log.number(), 0, SEEK_SET);
  return read_file(log.number(), error).value_or("");
}

int status_of(int wait_status) {
  return WIFEXITED(wait_status) ? WEXITSTATUS(wait_status) : 128 + WTERMSIG(wait_status);
}

// The programs of one run_all().
class Programs {
 public:
  Programs(const std::vector<Command>& commands, const Bounds& bounds)
      : commands_(commands), bounds_(bounds), outcomes_(commands.size()) {}

  std::vector<Outcome> run() {
    auto pause = std::chrono::microseconds(200);
    while (next_ < commands_.size() || !running_.empty()) {
      while (next_ < commands_.size() && running_.size() < std::max(bounds_.jobs, 1u)) start_next();
      check_bounds();
      if (std::erase_if(running_, [&](const Running& r) { return has_ended(r); }) || running_.empty()) {
        if (bounds_.on_end) bounds_.on_end(next_ - running_.size());
        continue;
      }
      std::this_thread::sleep_for(pause);
      pause = std::min(pause * 2, std::chrono::microseconds(2000));
    }
    return std::move(outcomes_);
  }

 private:
  void start_next() {
    const Command& command = commands_[next_];
    Outcome& outcome = outcomes_[next_];
    if (bounds_.stop.stop_requested()) end_all(Outcome::kStopped);
    if (ended_for_) {
      outcome.status = ended_for_;
    } else {
      Running program{0, next_, Clock::now(), log_of(command)};
      Start start(group_.number());
      start.open(0, "/dev/null", O_RDONLY);
      start.give(program.log.number(), 1);
      start.give(1, 2);
      const int error =
          start.run(bounded(command.arguments, bounds_.bytes), environment_for(command), program.pid);
      if (error) outcome.output = std::strerror(error);
      if (!error) running_.push_back(std::move(program));
    }
    ++next_;
  }

  void check_bounds() {
    const auto now = Clock::now();
    const bool is_late = std::any_of(running_.begin(), running_.end(), [&](const Running& r) {
      return std::chrono::duration<double>(now - r.started).count() > bounds_.seconds;
    });
    if (is_late) end_all(Outcome::kTimedOut);
    if (bounds_.stop.stop_requested()) end_all(Outcome::kStopped);
  }

  // Whether the program has ended; then fills its outcome.
  bool has_ended(const Running& program) {
    int wait_status = 0;
    const pid_t result = waitpid(program.pid, &wait_status, WNOHANG);
    if (result == 0) return false;
    // Where the host ignores SIGCHLD there is no status to collect (ECHILD): the caller sees what was made.
    Outcome& outcome = outcomes_[program.command];
    outcome.status = result < 0 ? Outcome::kUnknown : status_of(wait_status);
    if (ended_for_ && outcome.status != 0) outcome.status = ended_for_;
    outcome.output = text_of(program.log);
    return true;
  }

  // One that takes too long ends the others as well: nobody can use the half of it.
  void end_all(int reason) {
    if (ended_for_) return;
    ended_for_ = reason;
    group_.end();
    if (group_.number()) return;
    for (const Running& program : running_) kill(-program.pid, SIGKILL);
  }

  const std::vector<Command>& commands_;
  const Bounds& bounds_;
  std::vector<Outcome> outcomes_;
  std::size_t next_ = 0;
  std::vector<Running> running_;
  int ended_for_ = 0;  // by us: the reason
  Group group_;
};

}  // namespace

std::vector<Outcome> run_all(const std::vector<Command>& commands, const Bounds& bounds) {
  return Programs(commands, bounds).run();
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
