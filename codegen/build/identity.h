// SPDX-License-Identifier: BSD-3-Clause
//
// What a compiler is, as it says itself, and what its headers are: two that differ in any of it do not share libraries.
//
//   Identity identity = identity_of("/usr/bin/cc", {"-std=c99", "-O1"}, memory);
//
// Asking takes tens of milliseconds, so the answer is remembered, in the process and in a folder.  It holds for as long as
// nothing that it came from has changed: the program, what the program runs, the headers that it found, the folders in
// which it looked for them, PATH and HOME, and the processor; that takes some thirty looks at the file system.  A script
// may start another compiler every time: it is asked every time.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace dyntape::codegen {

struct Identity {
  std::string version;  // a line for people
  std::string text;  // version, features of the processor that the flags resolve to, checksum of the headers
};

// What generated text includes, and nothing else.
const std::vector<std::string>& included_headers();

// Throws Unavailable (files.h) if the program does not run, ToolError if it refuses the flags.  `memory`: a folder that
// remembers between processes, or "".
Identity identity_of(const std::string& path, const std::vector<std::string>& flags,
                     const std::string& memory);

// What identity_of() answers without asking.
std::optional<Identity> remembered_identity(const std::string& path, const std::vector<std::string>& flags,
                                            const std::string& memory);

// Compilers that `memory` knows, of this processor and these flags, whatever has become of them: what they compiled runs as well
// as ever where they are gone.
struct FormerCompiler {
  std::string path;
  Identity identity;
};
std::vector<FormerCompiler> former_compilers(const std::vector<std::string>& flags,
                                             const std::string& memory);

}  // namespace dyntape::codegen
