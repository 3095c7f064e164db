// SPDX-License-Identifier: BSD-3-Clause
#include "interruption.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include <dyntape/autodiff/error.h>

namespace dyntape::tools {
namespace {

constexpr int kPatience = 80;  // ms

sigset_t signals_that_end() {
  sigset_t set;
  sigemptyset(&set);
  for (int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction action {};
    if (sigaction(signal, nullptr, &action) == 0 && action.sa_handler != SIG_IGN) sigaddset(&set, signal);
  }
  return set;
}

// std::cerr is the other thread's.
void say(const std::string& sentence) {
  const std::string line = "\r\033[K";
  const std::string text = (isatty(STDERR_FILENO) ? line : "") + "dyntape: " + sentence + "\n";
  (void)!write(STDERR_FILENO, text.data(), text.size());
}

}  // namespace

Interruption::Interruption(std::function<bool()> nothing_to_save)
    : nothing_to_save_(std::move(nothing_to_save)) {
  const sigset_t set = signals_that_end();
  pthread_sigmask(SIG_BLOCK, &set, &before_);
  signals_ = codegen::Descriptor(signalfd(-1, &set, SFD_CLOEXEC));
  over_ = codegen::Descriptor(eventfd(0, EFD_CLOEXEC));
  if (signals_.number() < 0 || over_.number() < 0) {
    const int error = errno;
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
    throw ArgumentError(std::string("signals cannot be waited for: ") + std::strerror(error));
  }
  thread_ = std::jthread([this] { wait(); });
}

Interruption::~Interruption() {
  const std::uint64_t one = 1;
  (void)!write(over_.number(), &one, sizeof one);
  thread_.join();
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

int Interruption::status() const { return signal_ ? 128 + signal_ : 0; }

void Interruption::note(int signal) {
  // `timeout` signals a program and then its group: one wish.
  constexpr auto kAtOnce = std::chrono::milliseconds(100);
  const auto now = std::chrono::steady_clock::now();
  if (signal_ && now - noted_ < kAtOnce) return;
  noted_ = now;
  if (signal_) {
    say("interrupted again: ended at once, files may be missing");
    _exit(128 + signal);
  }
  signal_ = signal;
  say("interrupted: ending with the best so far (again: at once)");
  stop_.request_stop();
}

void Interruption::wait() {
  pollfd waiting[] = {{signals_.number(), POLLIN, 0}, {over_.number(), POLLIN, 0}};
  for (;;) {
    const int ready = poll(waiting, 2, signal_ ? kPatience : -1);
    if (ready < 0 && errno == EINTR) continue;
    if (ready < 0 || waiting[1].revents) return;
    if (ready == 0 && nothing_to_save_() && !codegen::TemporaryFolder::any()) {
      say("interrupted: there is no result yet");
      _exit(status());
    }
    signalfd_siginfo info{};
    if (waiting[0].revents && read(signals_.number(), &info, sizeof info) == sizeof info)
      note(static_cast<int>(info.ssi_signo));
  }
}

}  // namespace dyntape::tools
