// SPDX-License-Identifier: BSD-3-Clause
//
// Values that override those of a file, e.g. from a command line.
//
//   const std::vector<Setting> settings = settings_of({"horizon.intervals=60", "effects.gravity=off"});
//   Section file = Section::parse(text, "task.info", {}, settings);
//
// A path lists the keys from the outermost block inwards, separated by dots; `contact[1]` is the second of several
// blocks of one name.  Missing keys and blocks are added; `contact[2]` needs two that are there already.  An empty value
// removes a key, or a block with its content.  Messages name the option: "--set horizon.intervals: must be positive,
// got '-3'".
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/files/info/renamed.h>

namespace dyntape::io {

struct Setting {
  std::string path, value;
  std::string option = {};  // that messages name, as "--for"; empty: "--set <path>"
};

// Parses "path=value"; ArgumentError if it is invalid.
std::vector<Setting> settings_of(const std::vector<std::string>& options);

// Applies settings to a file with current names (renamed.h).  Settings may use old names of keys and values.
// ArgumentError for the number of a block that leaves out others before it.
std::vector<Replacement> apply(const std::vector<Setting>& settings, InfoNode& root,
                               const std::vector<Renamed>& renamed = {});

}  // namespace dyntape::io
