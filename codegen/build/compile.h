// SPDX-License-Identifier: BSD-3-Clause
//
// The compiler stage: C text to a shared library.
//
//   std::optional<Compiler> cc = find_compiler("", {"-O3"});        none: no compiler on this machine
//   compile(*cc, source, options, "folder");                        folder/source.c -> folder/library.so
//
// Throws ToolError with the command, its exit status, everything it said, and where the source is kept; FileError if the
// disk is full or the folder is removed, Unavailable if memory is short.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/options/options.h>
#include <dyntape/codegen/print/source.h>
#include <dyntape/codegen/system/files.h>

namespace dyntape::codegen {

struct Compiler {
  std::string path;
  std::string version;             // "gcc version 12.2.0 (Debian 12.2.0-14)"
  std::string identity;            // version, and the processor and features that the flags resolve to here
  std::vector<std::string> flags;  // all but those of input and output, and perhaps the level
  bool chooses_level = true;       // no -O among the user's flags: compile() decides
};

inline constexpr char kSourceFile[] = "source.c";
inline constexpr char kLibraryFile[] = "library.so";

// `wanted` (a name or path; empty: the usual ones) with the flags of the contract, of the profile and of the
// user.  `memory`: a folder that remembers identities between processes, or "".
std::optional<Compiler> find_compiler(const std::string& wanted, const std::vector<std::string>& user_flags,
                                      const std::string& memory = "");

// Whether find_compiler() answers without asking a compiler, which takes tens of milliseconds.
bool is_known_compiler(const std::string& wanted, const std::vector<std::string>& user_flags,
                       const std::string& memory = "");

// Where find_compiler() finds none: those that `memory` remembers by this name, or any where none is asked for.  Nothing can be
// compiled with them; what they have compiled can be found.
std::vector<Compiler> gone_compilers(const std::string& wanted, const std::vector<std::string>& user_flags,
                                     const std::string& memory);

// The sentence for "there is none".
std::string no_compiler(const std::string& wanted);

// Compiles folder/source.c, whose text is source.text; `final_folder` is where it will lie in the end.
void compile(const Compiler& compiler, const Source& source, const CodegenOptions& options,
             const std::string& folder, const std::string& final_folder);

}  // namespace dyntape::codegen
