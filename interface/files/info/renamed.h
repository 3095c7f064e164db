// SPDX-License-Identifier: BSD-3-Clause
//
// Renames keys and values of .info files from the previous version.  Old names are accepted with a note.
//
//   InfoScan scan = scan_info(text, "task.info");
//   for (const Replacement& r : replace_old_names(scan.root, {{"solver.method", "method", "stages", "riccati"},
//                                                             {"phase.shortest", "min_duration"}}))
//     std::cerr << to_sentence(r) << "\n";  // task.info:7:3: 'shortest' is now called 'min_duration'; ...
//   text = replaced(text, "task.info", replacements);           // the file with its current names
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <dyntape/interface/files/info/info.h>

namespace dyntape::io {

struct Renamed {
  std::string_view path;   // of the old key, starting at any block: "phase.shortest"
  std::string_view now;    // the current name
  std::string_view value;  // if a value was renamed instead of the key: the old value
  std::string_view value_now = {};
};

struct Replacement {
  Where where;
  std::string was, now;
};
std::string to_sentence(const Replacement& replacement);

// Changes the tree and returns the replacements in the order of the file.  Paths are those in the file, with old
// names.
std::vector<Replacement> replace_old_names(InfoNode& root, const std::vector<Renamed>& list);

// The text of the file with these replacements.
std::string replaced(const std::string& text, const std::string& file,
                     const std::vector<Replacement>& replacements);

}  // namespace dyntape::io
