// SPDX-License-Identifier: BSD-3-Clause
//
// Compiles C text to a shared library.
//
//   std::optional<Compiler> cc = find_compiler("", {"-O3"});        none: no compiler on this machine
//   compile(*cc, source, options, "folder");                        folder/source.c -> folder/library.so
//
// ToolError: has the command, its exit status, its output, and the place of the source.  FileError: the disk is full
// or the folder is removed.  Unavailable: memory is short.
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
  std::string version;   // "gcc version 12.2.0 (Debian 12.2.0-14)"
  std::string identity;  // version, and the processor and features that the flags select on this machine
  std::vector<std::string> flags;  // all flags except those of input and output, and possibly the level
  bool chooses_level = true;       // no -O among the user's flags: compile() chooses
};

inline constexpr char kSourceFile[] = "source.c";
inline constexpr char kLibraryFile[] = "library.so";

// Returns the path of a program: the first of this name in PATH, or the name itself if it is a path; "" if there is none.
std::string in_path(const std::string& name);

// Finds the compiler `wanted` (a name or path; empty: the usual compilers), with the flags of the contract and
// the user.  `memory`: a folder that stores identities between processes, or "".
std::optional<Compiler> find_compiler(const std::string& wanted, const std::vector<std::string>& user_flags,
                                      const std::string& memory = "");

// Whether find_compiler() answers without running a compiler, which takes tens of milliseconds.
bool is_known_compiler(const std::string& wanted, const std::vector<std::string>& user_flags,
                       const std::string& memory = "");

// Call if find_compiler() finds none.  Returns the compilers that `memory` has stored under this name, or all if no
// name is given.  They cannot compile, but their libraries can be found.
std::vector<Compiler> gone_compilers(const std::string& wanted, const std::vector<std::string>& user_flags,
                                     const std::string& memory);

// The message if there is no compiler.
std::string no_compiler(const std::string& wanted);

// Compiles folder/source.c with text source.text; `final_folder` is its later folder.
void compile(const Compiler& compiler, const Source& source, const CodegenOptions& options,
             const std::string& folder, const std::string& final_folder);

}  // namespace dyntape::codegen
