// SPDX-License-Identifier: BSD-3-Clause
//
// Where the library of one function is found or made: its compiler, its place in the cache, its folder.
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

// A compiled library that nobody knows of yet.
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
  // Without a compiler, one that only finds: what a compiler that is gone has left in the cache, if that is of this function.
  // Says once on stderr why there is none; throws ToolError instead where the compiled route is asked for.
  static std::optional<LibraryBuilder> open(const Function& function, const CodegenOptions& options);

  // Whether open() answers at once: it need not ask a compiler what it is.
  static bool opens_at_once(const CodegenOptions& options);

  // The same compiler at -O1 and without the cache, where the options ask for more; none: they do not.
  std::optional<LibraryBuilder> quick() const;

  const std::string& content() const { return content_; }  // hash of the function
  const Compiler& compiler() const { return compiler_; }

  // From the cache; none: it has to be made.  Unavailable: it is there, and the system does not load it.
  std::optional<Loaded> find() const;
  // ToolError: the compiler fails.  The source is kept then.  Unavailable: neither the cache nor the folder for
  // temporary files has room, or memory is short.
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
