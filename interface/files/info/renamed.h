// SPDX-License-Identifier: BSD-3-Clause
//
// Keys and values of .info files that have another name than in the version before.  Files may still use the old one, and are told.
//
//   InfoScan scan = scan_info(text, "task.info");
//   for (const Replacement& r : replace_old_names(scan.root, {{"solver.method", "method", "stages", "riccati"},
//                                                             {"phase.shortest", "min_duration"}}))
//     std::cerr << to_sentence(r) << "\n";  // task.info:7:3: 'shortest' is now called 'min_duration'; ...
//   text = replaced(text, "task.info", replacements);           // the file with its names of today
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <dyntape/interface/files/info/info.h>

namespace dyntape::io {

struct Renamed {
  std::string_view path;   // of the old key, from any block on: "phase.shortest"
  std::string_view now;    // its name today
  std::string_view value;  // where a value has another name and not the key: the old one
  std::string_view value_now = {};
};

struct Replacement {
  Where where;
  std::string was, now;
};
std::string to_sentence(const Replacement& replacement);

// Changes the tree; what was replaced, in the order of the file.  Paths are those of the file, old names and all.
std::vector<Replacement> replace_old_names(InfoNode& root, const std::vector<Renamed>& list);

// The text of that file with those of the replacements that stand in it.
std::string replaced(const std::string& text, const std::string& file,
                     const std::vector<Replacement>& replacements);

}  // namespace dyntape::io
