// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/info/info_line.h>

namespace dyntape::io {
namespace {

// The blanks of ASCII whatever the locale says; a line feed cannot occur within a line.
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

constexpr std::string_view kEscapeLetters = "0abfnrtv\"'\\";
constexpr std::string_view kEscapeValues("\0\a\b\f\n\r\t\v\"'\\", kEscapeLetters.size());

}  // namespace

void LineCursor::skip_blanks() {
  while (position_ < line_.size() && is_blank(line_[position_])) ++position_;
}

void LineCursor::skip_character() {
  ++position_;
  skip_blanks();
}

Word LineCursor::plain_word() {
  Word word;
  word.offset = position_;
  while (position_ < line_.size() && !is_blank(line_[position_]) && line_[position_] != ';') ++position_;
  word.raw = line_.substr(word.offset, position_ - word.offset);
  skip_blanks();
  return word;
}

Word LineCursor::word() {
  if (peek() != '"') return plain_word();
  Word word;
  word.quoted = true;
  word.offset = position_++;
  const size_t begin = position_;
  while (position_ < line_.size() && line_[position_] != '"') position_ += line_[position_] == '\\' ? 2 : 1;
  if (position_ > line_.size()) position_ = line_.size();
  word.closed = position_ < line_.size();
  word.raw = line_.substr(begin, position_ - begin);
  if (word.closed) ++position_;
  skip_blanks();
  return word;
}

std::string expand_escapes(std::string_view raw, std::string& text) {
  std::string wrong;
  for (size_t i = 0; i < raw.size(); ++i) {
    if (raw[i] != '\\') {
      text += raw[i];
      continue;
    }
    const size_t which = i + 1 < raw.size() ? kEscapeLetters.find(raw[i + 1]) : std::string_view::npos;
    if (which == std::string_view::npos) {
      wrong = i + 1 < raw.size() ? "unknown escape '" + std::string(raw.substr(i, 2)) + "'"
                                 : "nothing follows the backslash";
      text += raw[i];
    } else {
      text += kEscapeValues[which];
      ++i;
    }
  }
  return wrong;
}

}  // namespace dyntape::io
