// SPDX-License-Identifier: BSD-3-Clause
//
// Finds or makes the library of one function: its compiler, its place in the cache, its folder.
//
//   std::optional<LibraryBuilder> builder = LibraryBuilder::open(function, options);   none: no compiler, interpret
//   if (auto loaded = builder->find()) ...                                 a hit: nothing else is done
//   Draft draft = builder->compile(source);                                library.so in a folder of its own
//   Loaded loaded = builder->load(std::move(draft));                       and into the cache, if it has one
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <dyntape/codegen/build/compile.h>
#include <dyntape/codegen/store/cache.h>
#include <dyntape/codegen/store/library.h>

namespace dyntape::codegen {

// A compiled library that is not in the cache yet.
struct Draft {
  std::unique_ptr<TemporaryFolder> folder;
  std::string name, text_hash;
};

struct Loaded {
  std::shared_ptr<const Library> library;
  std::string source_path;  // empty: not kept
};

class LibraryBuilder {
 public:
  // Without a compiler, returns a builder that only finds libraries of earlier compilers in the cache, if there are
  // such libraries of this function.  Otherwise prints the reason once on stderr; for Route::kCompiled throws
  // ToolError.
  static std::optional<LibraryBuilder> open(const Function& function, const CodegenOptions& options);

  // Whether open() answers without running a compiler.
  static bool opens_at_once(const CodegenOptions& options);

  // The same compiler at -O1 and without the cache, if the options ask for a higher level; otherwise none.
  std::optional<LibraryBuilder> quick() const;

  const std::string& content() const { return content_; }  // hash of the function
  const Compiler& compiler() const { return compiler_; }

  // Loads the library from the cache; none: the cache has none.  Unavailable: the system does not load it.
  std::optional<Loaded> find() const;
  // ToolError: the compiler fails; the source is kept.  Unavailable: neither the cache nor the folder for temporary
  // files has space, or memory is short.
  Draft compile(const Source& source) const;
  Loaded load(Draft draft) const;

 private:
  LibraryBuilder(const Function& function, const CodegenOptions& options, std::optional<Cache> cache,
                 Compiler compiler);
  Draft compile_in(std::unique_ptr<TemporaryFolder> folder, const std::string& final_folder,
                   const Source& source) const;
  Draft compile_elsewhere(const Source& source) const;
  std::optional<Entry> publish(Draft& draft) const;  // none: not possible
  std::optional<Loaded> load_entry(const Entry& entry) const;

  CodegenOptions options_;
  std::optional<Cache> cache_;
  Compiler compiler_;
  std::string content_;
  Key key_;
};

}  // namespace dyntape::codegen
