// SPDX-License-Identifier: BSD-3-Clause
//
// Finds the kind of an .info file from the blocks that only this kind has.
//
//   check_file_kind(text, "fall.info", FileKind::kTask);
//   // FileError: fall.info: this is a scene ('simulation' stands in it), not a task; dyntape simulate takes it
#pragma once

#include <string>
#include <string_view>

namespace dyntape {

enum class FileKind { kTask, kScene, kSweep, kCentroidal };

// Returns if the file is of this kind or of no known kind; throws FileError otherwise.
void check_file_kind(std::string_view text, const std::string& path, FileKind wanted);

}  // namespace dyntape
