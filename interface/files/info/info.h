// SPDX-License-Identifier: BSD-3-Clause
//
// Parses .info files into a tree whose nodes know their positions in the file.
//
//   ; a task                                 InfoNode root = parse_info(text, "task.info");
//   solver                                   root.children[0].key              // "solver"
//   {                                        root.children[0].children[1].value // "1e-8"
//     maxIterations 200                      to_string(root.children[0].where) // "task.info:2:1"
//     tolerance     1e-8  ; relative
//   }
//
// To read typed values and check for unknown keys, use Section (<dyntape/interface/files/info/section.h>).
//
// The format is that of Boost.PropertyTree: `key value` pairs, blocks in braces, `;` comments, quoted words with the
// escapes \0 \a \b \f \n \r \t \v \" \' \\, a backslash after a quoted value for continuation on the next line, and
// `#include "file"` on its own line.  Any file that Boost reads gives the same tree, except that
//   - a byte order mark is skipped; in Boost it becomes part of the first key;
//   - blocks deeper than kMaxDepth are an error; in Boost the stack overflows;
//   - a file named by #include is searched beside the including file first, then as in Boost: relative to the working
//     directory;
//   - more than kMaxIncludes #include lines, or more than kMaxIncluded bytes from them, are an error: two lines in
//     each of 31 files would expand to two thousand million.
// Also refused is text that Boost accepts by accident: a number as a key after a value (a list without quotes), `//`
// comments and `=` signs, a brace attached to a word as value, an unfinished continuation, and the byte zero.
//
// Errors.  FileError, one line `file:line:column: message` for each problem.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace dyntape::io {

inline constexpr int kMaxDepth = 100;  // nesting of blocks, and of files
inline constexpr std::size_t kMaxIncludes = 1000;
inline constexpr std::size_t kMaxIncluded = std::size_t{64} << 20;

// A position in a file.  Lines and columns (in bytes) count from 1; line 0 means the whole file.
struct Where {
  std::shared_ptr<const std::string> file;
  int line = 0;
  int column = 0;
};
std::string to_string(const Where& where);  // "task.info:3:14"

// A key, its value (empty if absent) and the keys of its block, in the order of the file.
struct InfoNode {
  std::string key;
  std::string value;
  std::vector<InfoNode> children;
  Where where;             // of the key
  Where value_where;       // of the value, or of the key if there is no value
  bool has_value = false;  // distinguishes `key ""` from `key`
  bool has_block = false;  // distinguishes `key { }` from `key`
  std::string comment;     // written after the value by write_info; the reader drops comments

  // The first child with this key, or null.
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

// Throws one FileError with a line for each problem, in the order of the file, if there is any.
void throw_if_any(std::vector<Problem> problems);

// Parses text; `file_name` is the name in messages and the base of #include.
InfoNode parse_info(std::string_view text, const std::string& file_name);

// Parses as far as possible and leaves the report to the caller (throw_if_any), who may add further problems.
struct InfoScan {
  InfoNode root;
  std::vector<Problem> problems;
  std::vector<std::string> included;  // paths of files included by #include
};
InfoScan scan_info(std::string_view text, const std::string& file_name);

// The text of a tree.  parse_info(write_info(root)) gives the same keys, values and order for any tree.
std::string write_info(const InfoNode& root);

}  // namespace dyntape::io
