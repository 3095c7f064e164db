// SPDX-License-Identifier: BSD-3-Clause
//
// What kind of file an .info file is, by the blocks that only that kind has.
//
//   check_file_kind(text, "fall.info", FileKind::kTask);
//   // FileError: fall.info: this is a scene ('simulation' stands in it), not a task; dyntape simulate takes it
#pragma once

#include <string>
#include <string_view>

namespace dyntape {

enum class FileKind { kTask, kScene, kSweep, kCentroidal };

// Returns where the file is of that kind, or of none that is known.
void check_file_kind(std::string_view text, const std::string& path, FileKind wanted);

}  // namespace dyntape
