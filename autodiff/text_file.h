// SPDX-License-Identifier: BSD-3-Clause
//
// Reads and writes whole text files.
//
//   std::string text = read_file("robot.urdf");
//   write_file_atomically("out/result.csv", text);   // readers see the old file or the new file, never a part
//
// read_file reads files, pipes and devices.  It refuses a folder, a pipe that no process opens for writing within a
// second, a zero byte (/dev/zero) and more than a gigabyte.
//
// write_file_atomically makes missing folders, writes a temporary file in the same folder, flushes it to disk and
// renames it, with the old file's owner and permissions.  After a failure no new file remains.
//   symbolic link                      remains; the file that it points to is replaced
//   hard link                          the other name keeps the old contents (as snapshots need)
//   pipe, device, own descriptor       written directly (/dev/stdout)
//   file that the user may not write   not replaced, even if its folder would allow this
//
// FileError names the path and gives the system's message.  Every layer may include this header, like error.h.
#pragma once

#include <string>
#include <string_view>

namespace dyntape {

std::string read_file(const std::string& path);
void write_file_atomically(const std::string& path, std::string_view text);

// Checks, without making anything, whether the file can be written; throws FileError.  Call it before long work.
void check_can_write(const std::string& path);

// A name in the folder of `path`, with the same extension, that no other process or thread uses.
std::string temporary_name_beside(const std::string& path);
// Whether this name is a temporary file of a killed process, meant to replace `path`.  These names contain a
// checksum, which distinguishes them from users' files.
bool is_temporary_name_beside(const std::string& path, const std::string& name);

// Why a text cannot be a name in a file or a message: "is not UTF-8 ...", "holds a line break ..."; "" if it can be.
std::string fault_of_name(std::string_view name);

}  // namespace dyntape
