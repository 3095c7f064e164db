// SPDX-License-Identifier: BSD-3-Clause
//
// The identity of a compiler: its own description, and its headers.  Compilers with different identities do not
// share libraries.
//
//   Identity identity = identity_of("/usr/bin/cc", {"-std=c99", "-O1"}, memory);
//
// A query takes tens of milliseconds, so the answer is stored, in the process and in a folder.  The stored answer is
// valid until one of its sources changes: the program, the programs that it runs, the headers that it found, the
// folders in which it looked for headers, PATH and HOME, and the processor.  Checking these takes some thirty
// accesses to the file system.  A script may start another compiler each time, so its identity is never stored.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace dyntape::codegen {

struct Identity {
  std::string version;  // one line, for people
  std::string text;     // version, features of the processor that the flags select, checksum of the headers
};

// The headers that generated text includes, all of them.
const std::vector<std::string>& included_headers();

// Throws Unavailable (files.h) if the program does not run, ToolError if it refuses the flags.  `memory`: a folder
// that stores identities between processes, or "".
Identity identity_of(const std::string& path, const std::vector<std::string>& flags,
                     const std::string& memory);

// The stored answer of identity_of(), if there is one.
std::optional<Identity> remembered_identity(const std::string& path, const std::vector<std::string>& flags,
                                            const std::string& memory);

// The compilers that `memory` has stored for this processor and these flags, also if they no longer exist: their
// libraries still run.
struct FormerCompiler {
  std::string path;
  Identity identity;
};
std::vector<FormerCompiler> former_compilers(const std::vector<std::string>& flags,
                                             const std::string& memory);

}  // namespace dyntape::codegen
