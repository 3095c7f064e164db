// SPDX-License-Identifier: BSD-3-Clause
//
// CppADCodeGen's classes for the compiler of libraries and its flags; also compiles C of the user to a shared
// library.
//
//   GccCompiler<double> compiler;
//   compiler.compileSources({{"area.c", "double area(double r) { return 3 * r * r; }"}}, true);
//   compiler.buildDynamic("folder/libarea.so");
//
// For libraries of models, flags of levels, processors, warnings and macros are passed on.  The cache decides about
// linking and folders of sources.
#pragma once

#include <initializer_list>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace CppAD::inline dyntape_names::cg {

// The part that is the same for all bases (compiler.cpp).
class CompilerOfC {
 public:
  using Flags = std::vector<std::string>;
  explicit CompilerOfC(std::string path) : path_(std::move(path)) {}
  virtual ~CompilerOfC() { cleanup(); }
  CompilerOfC(const CompilerOfC&) = delete;
  CompilerOfC& operator=(const CompilerOfC&) = delete;

  const std::string& getCompilerPath() const { return path_; }
  void setCompilerPath(const std::string& path) { path_ = path; }
#define DYNTAPE_FLAGS(Name, Names, member)                \
  const Flags& get##Names() const { return member; }      \
  void set##Names(const Flags& flags) { member = flags; } \
  void add##Name(const std::string& flag) { member.push_back(flag); }
  DYNTAPE_FLAGS(CompileFlag, CompileFlags, flags_)
  DYNTAPE_FLAGS(CompileLibFlag, CompileLibFlags, library_flags_)
  DYNTAPE_FLAGS(LinkFlag, LinkFlags, link_flags_)
#undef DYNTAPE_FLAGS
  const std::string& getTemporaryFolder() const { return temporary_; }
  void setTemporaryFolder(const std::string& folder) { temporary_ = folder; }
  const std::string& getSourcesFolder() const { return sources_; }
  void setSourcesFolder(const std::string& folder) { sources_ = folder; }
  bool isSaveToDiskFirst() const { return saves_; }
  void setSaveToDiskFirst(bool yes) { saves_ = yes; }
  bool isVerbose() const { return verbose_; }
  void setVerbose(bool yes) { verbose_ = yes; }

  // Compiles texts, given by file name, to objects in the temporary folder.  ToolError with the compiler's message.
  void compileSources(const std::map<std::string, std::string>& sources, bool position_independent);
  // Makes a shared library of all objects.
  void buildDynamic(const std::string& library);
  const std::set<std::string>& getObjectFiles() const { return objects_; }
  const std::set<std::string>& getSourceFiles() const { return names_; }
  void cleanup();

 private:
  std::string path_, temporary_ = "cppadcg_tmp", sources_ = "cppadcg_sources";
  Flags flags_ = {"-O2"}, library_flags_ = {"-O2", "-shared"}, link_flags_;
  std::set<std::string> objects_, names_;
  bool saves_ = false, verbose_ = false;
};

template <class Base>
struct AbstractCCompiler : CompilerOfC {
  using CompilerOfC::CompilerOfC;
};
template <class Base>
using CCompiler = AbstractCCompiler<Base>;
template <class Base>
struct GccCompiler : AbstractCCompiler<Base> {
  explicit GccCompiler(std::string path = "gcc") : AbstractCCompiler<Base>(std::move(path)) {}
};
template <class Base>
struct ClangCompiler : AbstractCCompiler<Base> {
  explicit ClangCompiler(std::string path = "clang") : AbstractCCompiler<Base>(std::move(path)) {}
};

namespace system {
template <class = void>
struct SystemInfo {
  inline static const std::string DYNAMIC_LIB_EXTENSION = ".so";
};
std::string getWorkingDirectory();
std::string createPath(std::initializer_list<std::string> folders, const std::string& file);
inline std::string createPath(const std::string& folder, const std::string& file) {
  return createPath({folder}, file);
}
// ToolError, with what the program wrote, if it fails or does not exist.
void callExecutable(const std::string& executable, const std::vector<std::string>& arguments);
}  // namespace system
std::string readStringFromFile(const std::string& path);  // FileError

}  // namespace CppAD::inline dyntape_names::cg

// The compiler that CppADCodeGen was configured with.
#ifndef CPPAD_CG_C_COMPILER
#define CPPAD_CG_C_COMPILER "gcc"
#endif
#define CPPAD_CG_SYSTEM_LINUX 1
