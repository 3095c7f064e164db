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
// one's owner and permissions; if anything fails, nothing new is left.  A symbolic link stays one: what it points to
// is replaced.  A file with a second name (a hard link) leaves it behind: under that name the old contents stay, as
// in snapshots that are made of such links.  Pipes, devices and the program's own descriptors (/dev/stdout) are
// written to as they are.  A file that the user may not write is not replaced, though its folder would allow it.
//
// Errors.  FileError naming the path and what the system said.  Like error.h, this header is everybody's.
#pragma once

#include <string>
#include <string_view>

namespace dyntape {

std::string read_file(const std::string& path);
void write_file_atomically(const std::string& path, std::string_view text);

// What can be said of writing there before there is anything to write; makes nothing.  For long work: called first.
void check_can_write(const std::string& path);

// A name beside `path`, with the same extension, that no other process or thread uses.
std::string temporary_name_beside(const std::string& path);
// Whether a file of this name is one that a process which was killed was about to put in the place of `path`: names carry
// their own checksum, which tells them from those of users.
bool is_temporary_name_beside(const std::string& path, const std::string& name);

// Why a text cannot be a name in a file or in a message: "is not UTF-8 ..." or "holds a line break ..."; "" if it can.
std::string fault_of_name(std::string_view name);

}  // namespace dyntape
