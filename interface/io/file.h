// SPDX-License-Identifier: BSD-3-Clause
//
// Whole files in, whole files out.
//
//   write_file_atomically("out/result.csv", text);   // readers see the old file or the new one, never a half
//   std::string text = read_file("out/result.csv");
//
// Errors.  FileError naming the path and what the system said.
#pragma once

#include <string>
#include <string_view>

namespace dyntape::io {

std::string read_file(const std::string& path);

// Writes a temporary file beside `path`, flushes it to disk and renames it over `path`; folders that are
// missing are made.  If anything fails, nothing new is left on disk.
void write_file_atomically(const std::string& path, std::string_view text);

// A name beside `path`, with the same extension, that no other process or thread uses.
std::string temporary_name_beside(const std::string& path);

}  // namespace dyntape::io
