// SPDX-License-Identifier: BSD-3-Clause
//
// Cuts one line of an .info file into words (a part of the reader, <dyntape/interface/files/info/info.h>).
//
//   LineCursor cursor("name \"left arm\" ; which one");
//   cursor.word().raw;     // name
//   cursor.word().raw;     // left arm
//   cursor.at_end();       // true: only a comment follows
#pragma once

#include <string>
#include <string_view>

namespace dyntape::io {

struct Word {
  std::string_view raw;  // without the quotes, escapes as written
  size_t offset = 0;     // in the line, of the quote if there is one
  bool quoted = false;
  bool closed = true;  // false: the closing quote is missing
};

class LineCursor {
 public:
  explicit LineCursor(std::string_view line) : line_(line) { skip_blanks(); }

  size_t offset() const { return position_; }
  char peek() const { return position_ < line_.size() ? line_[position_] : '\0'; }
  bool at_end() const { return position_ >= line_.size() || line_[position_] == ';'; }

  Word word();        // quoted or plain; skips the blanks after it
  Word plain_word();  // up to a blank or a comment; quotes are ordinary characters
  void skip_character();
  void skip_line() { position_ = line_.size(); }

 private:
  void skip_blanks();

  std::string_view line_;
  size_t position_ = 0;
};

// Appends `raw` to `text` with its escapes resolved.  Returns the fault, empty if there is none.  A wrong escape is
// appended literally.
std::string expand_escapes(std::string_view raw, std::string& text);

}  // namespace dyntape::io
