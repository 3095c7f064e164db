// SPDX-License-Identifier: BSD-3-Clause
//
// Whole text files in, whole files out.
//
//   std::string text = read_file("robot.urdf");
//   write_file_atomically("out/result.csv", text);   // readers see the old file or the new one, never a half
//
// Reading takes files, pipes and devices.  A folder, a pipe that nobody opens for writing within a second, a
// zero byte (/dev/zero) and more than a gigabyte are refused.
//
// Writing makes missing folders, flushes a temporary file beside the old one to disk and renames it, with the old
// one's owner and permissions; if anything fails, nothing new is left.  A link stays one: what it points to is
// replaced.  Pipes, devices and the program's own descriptors (/dev/stdout) are written to as they are.
//
// Errors.  FileError naming the path and what the system said.  Like error.h, this header is everybody's.
#pragma once

#include <string>
#include <string_view>

namespace dyntape {

std::string read_file(const std::string& path);
void write_file_atomically(const std::string& path, std::string_view text);

// A name beside `path`, with the same extension, that no other process or thread uses.
std::string temporary_name_beside(const std::string& path);

}  // namespace dyntape
