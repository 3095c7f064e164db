// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/io/progress.h>
#include <dyntape/interface/io/terminal.h>

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace dyntape::io {

bool terminal_understands() {
  const char* kind = std::getenv("TERM");
  return ::isatty(STDERR_FILENO) && !(kind && std::string_view(kind) == "dumb");
}

int terminal_width() {
  winsize size{};
  const bool known = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : 80;
}

Progress::Progress(std::string what, long total, Show show)
    : what_(std::move(what)),
      total_(total),
      shown_(show == Show::kAlways || (show == Show::kIfTerminal && terminal_understands())) {}

Progress::~Progress() { erase(); }

void Progress::erase() {
  if (drawn_) std::fputs("\r\033[K", stderr);
  drawn_ = false;
}

void Progress::update(long done, const std::string& note) {
  if (!shown_) return;
  const auto now = std::chrono::steady_clock::now();
  const bool due = !drawn_ || now - last_ >= std::chrono::milliseconds(50);
  if (!due && done != total_) return;
  last_ = now;
  // One column is left free: a full line would wrap.
  const std::string text = "\r" + line(what_, done, total_, note, terminal_width() - 1) + "\033[K";
  std::fputs(text.c_str(), stderr);
  std::fflush(stderr);
  drawn_ = true;
}

std::string Progress::line(const std::string& what, long done, long total, const std::string& note,
                           int width) {
  std::string text = what + " ";
  if (total > 0) {
    constexpr long kBar = 20;
    const long filled = kBar * std::clamp(done, 0L, total) / total;
    std::string bar(static_cast<size_t>(filled), '=');
    if (filled < kBar) bar += '>';
    bar.resize(kBar, ' ');
    const std::string of = std::to_string(total);
    std::string count = std::to_string(done);
    count.insert(0, of.size() - std::min(of.size(), count.size()), ' ');
    text += "[" + bar + "] " + count + "/" + of;
  } else {
    text += std::to_string(done);
  }
  if (!note.empty()) text += "  " + note;
  if (text.size() > static_cast<size_t>(std::max(width, 0)))
    text.resize(static_cast<size_t>(std::max(width, 0)));
  return text;
}

}  // namespace dyntape::io
