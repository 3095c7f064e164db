// SPDX-License-Identifier: BSD-3-Clause
//
// The text of an .info file as a tree in which every node knows where it was written.
//
//   ; a task                                 InfoNode root = parse_info(text, "task.info");
//   solver                                   root.children[0].key              // "solver"
//   {                                        root.children[0].children[1].value // "1e-8"
//     maxIterations 200                      to_string(root.children[0].where) // "task.info:2:1"
//     tolerance     1e-8  ; relative
//   }
//
// Most readers want typed values and a check that nothing was misspelt: <dyntape/interface/files/info/section.h>.
//
// The format is that of Boost.PropertyTree: `key value` pairs, blocks in braces, `;` comments, quoted words
// with the escapes \0 \a \b \f \n \r \t \v \" \' \\, a backslash after a quoted value continues it on the
// next line,
// `#include "file"` on a line of its own.  Any file that Boost reads gives the same tree here, except that
//   - a byte order mark is skipped, where Boost makes it a part of the first key;
//   - blocks deeper than kMaxDepth are an error, where Boost overflows the stack;
//   - a file named by #include is looked for beside the including file first, then where Boost looks:
//     relative to the working directory;
//   - more than kMaxIncludes #include lines, or kMaxIncluded bytes that they bring in, are an error: two lines in
//     each of 31 files stand for two thousand million.
// Refused, besides, is what Boost accepts by accident: a number as a key behind a value (a list without quotes), `//` comments and
// `=` signs, a value that is a brace glued to a word, an unfinished continuation, and the byte zero.
//
// Errors.  FileError, one line `file:line:column: message` for each problem found.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace dyntape::io {

inline constexpr int kMaxDepth = 100;  // blocks within blocks, and files within files
inline constexpr std::size_t kMaxIncludes = 1000;
inline constexpr std::size_t kMaxIncluded = std::size_t{64} << 20;

// A place in a file; lines and columns (in bytes) count from 1, line 0 means the file as a whole.
struct Where {
  std::shared_ptr<const std::string> file;
  int line = 0;
  int column = 0;
};
std::string to_string(const Where& where);  // "task.info:3:14"

// A key, its value (empty if none is written) and the keys in its block, in the order of the file.
struct InfoNode {
  std::string key;
  std::string value;
  std::vector<InfoNode> children;
  Where where;             // of the key
  Where value_where;       // of the value; that of the key if there is no value
  bool has_value = false;  // tells `key ""` from `key`
  bool has_block = false;  // tells `key { }` from `key`
  std::string comment;     // written behind the value by write_info; the reader drops comments

  // The first with this key; null if there is none.
  const InfoNode* child(const std::string& name) const {
    for (const InfoNode& node : children) {
      if (node.key == name) return &node;
    }
    return nullptr;
  }
};

// One problem of a file; several are reported together.
struct Problem {
  Where where;
  std::string message;
};

// Throws one FileError with a line for each problem, in the order of the file; returns if there is none.
void throw_if_any(std::vector<Problem> problems);

// Reads a text; `file_name` stands in messages and is where #include starts from.
InfoNode parse_info(std::string_view text, const std::string& file_name);

// Reads as far as it can and leaves to the caller when to report (throw_if_any): problems of meaning may
// follow.
struct InfoScan {
  InfoNode root;
  std::vector<Problem> problems;
  std::vector<std::string> included;  // paths of files that #include lines have brought in
};
InfoScan scan_info(std::string_view text, const std::string& file_name);

// The text of a tree: parse_info(write_info(root)) gives the same keys, values and order for any tree.
std::string write_info(const InfoNode& root);

}  // namespace dyntape::io
