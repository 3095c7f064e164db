// SPDX-License-Identifier: BSD-3-Clause
//
// Values that stand in place of those of a file, as a command line gives them.
//
//   const std::vector<Setting> settings = settings_of({"horizon.intervals=60", "effects.gravity=off"});
//   Section file = Section::parse(text, "task.info", {}, settings);
//
// A path is the keys from the outermost block inwards, with dots between; `contact[1]` is the second of blocks of one name.  What is
// absent is added, blocks on the way as well.  An empty value takes the key out, a block with all that it holds.  Messages name the option: "--set horizon.intervals: must be positive, got '-3'".
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/files/info/renamed.h>

namespace dyntape::io {

struct Setting {
  std::string path, value;
};

// Of "path=value"; ArgumentError for what is none.
std::vector<Setting> settings_of(const std::vector<std::string>& options);

// To a file that has its names of today (renamed.h); keys and values that a setting has by older names, which count as today's.
std::vector<Replacement> apply(const std::vector<Setting>& settings, InfoNode& root,
                               const std::vector<Renamed>& renamed = {});

}  // namespace dyntape::io
