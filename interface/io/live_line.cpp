// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/io/live_line.h>

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace dyntape::io {

namespace {

using namespace std::chrono_literals;

// A terminal, and one that moves its cursor when told to.
bool terminal_understands() {
  const char* kind = std::getenv("TERM");
  return ::isatty(STDERR_FILENO) && !(kind && std::string_view(kind) == "dumb");
}

int terminal_width() {
  winsize size{};
  const bool known = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : 80;
}

constexpr std::chrono::milliseconds kRedrawn = 50ms, kPlainPause = 3000ms;

}  // namespace

LiveLine::LiveLine()
    : LiveLine(terminal_understands() ? Kind::kTerminal : Kind::kPlain,
               terminal_understands() ? kRedrawn : kPlainPause) {}

LiveLine::LiveLine(Kind kind, std::chrono::milliseconds pause)
    : kind_(kind), pause_(pause), last_(std::chrono::steady_clock::now()) {}

LiveLine::~LiveLine() { erase(); }

void LiveLine::erase() {
  if (drawn_) std::fputs("\r\033[K", stderr);
  drawn_ = false;
}

void LiveLine::show(const std::string& text) {
  const auto now = std::chrono::steady_clock::now();
  const bool first_drawn = kind_ == Kind::kTerminal && !drawn_;
  if (!first_drawn && now - last_ < pause_) return;
  last_ = now;
  if (kind_ == Kind::kPlain) {
    std::fputs(("dyntape: " + text + "\n").c_str(), stderr);
    return;
  }
  // One column is left free: a full line would wrap.
  const auto room = static_cast<std::size_t>(terminal_width() - 1);
  std::fputs(("\r" + text.substr(0, room) + "\033[K").c_str(), stderr);
  std::fflush(stderr);
  drawn_ = true;
}

}  // namespace dyntape::io
