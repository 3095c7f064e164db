// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/build/library_builder.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/options/flags.h>
#include <dyntape/codegen/options/lane_widths.h>
#include <dyntape/codegen/print/print_tables.h>
#include <dyntape/codegen/system/warn_once.h>

namespace dyntape::codegen {
namespace {

// Everything that decides the library; names of people and of functions do not.
Key key_of(const std::string& content, const Function& function, const CodegenOptions& options,
           const Compiler& compiler) {
  std::string lanes;
  for (unsigned width : lane_widths(options.lanes)) lanes += std::to_string(width) + " ";
  const int order = static_cast<int>(options.order);
  // What callees bring along to derivation does not follow from their values.
  const std::string derived = function.graph.callees().empty() ? content : content_hash(function, order);
  std::string text = "content " + content + "\nderived " + derived + "\norder " + std::to_string(order) +
                     "\nfunctions " + to_string(options.functions) + "\nlanes " + lanes + "\ngenerator " +
                     generator_version() + " " + generator_fingerprint() + "\ninterface " +
                     std::to_string(DYNTAPE_ABI) + "\npieces " + std::to_string(options.piece_statements) +
                     "\ncompiler " + compiler.path + "\n" + compiler.identity + "\nflags";
  for (const std::string& flag : compiler.flags) text += " " + flag;
  return make_key(std::move(text));
}

}  // namespace

std::optional<LibraryBuilder> LibraryBuilder::open(const Function& function, const CodegenOptions& options) {
  auto cache = options.use_cache ? Cache::open(options.cache_folder) : std::nullopt;
  auto compiler =
      find_compiler(options.compiler, accepted_flags(options.flags), cache ? cache->folder() : "");
  if (compiler) return LibraryBuilder(function, options, std::move(cache), std::move(*compiler));
  if (cache) {
    for (Compiler& gone : gone_compilers(options.compiler, accepted_flags(options.flags), cache->folder())) {
      LibraryBuilder builder(function, options, cache, std::move(gone));
      if (builder.find()) return builder;
    }
  }
  if (options.only_cached) return std::nullopt;
  if (options.route == Route::kCompiled) throw ToolError(no_compiler(options.compiler));
  warn_once(no_compiler(options.compiler) + "; functions are not compiled");
  return std::nullopt;
}

bool LibraryBuilder::opens_at_once(const CodegenOptions& options) {
  const auto cache = options.use_cache ? Cache::open(options.cache_folder) : std::nullopt;
  return is_known_compiler(options.compiler, accepted_flags(options.flags), cache ? cache->folder() : "");
}

std::optional<LibraryBuilder> LibraryBuilder::quick() const {
  std::string level;
  for (const std::string& flag : compiler_.flags) {
    if (flag.starts_with("-O")) level = flag;
  }
  if (level.empty() || level == "-O" || level == "-O0" || level == "-O1" || level == "-Og")
    return std::nullopt;
  LibraryBuilder other = *this;
  other.cache_.reset();
  other.compiler_.flags.push_back("-O1");
  return other;
}

LibraryBuilder::LibraryBuilder(const Function& function, const CodegenOptions& options,
                               std::optional<Cache> cache, Compiler compiler)
    : options_(options),
      cache_(std::move(cache)),
      compiler_(std::move(compiler)),
      content_(content_hash(function)),
      key_(key_of(content_, function, options_, compiler_)) {}

std::optional<Loaded> LibraryBuilder::find() const {
  if (!cache_ || options_.force_rebuild) return std::nullopt;
  const auto entry = cache_->find(key_);
  return entry ? load_entry(*entry) : std::nullopt;
}

// None if it turns out not to be of this function, and then the entry is gone.
std::optional<Loaded> LibraryBuilder::load_entry(const Entry& entry) const {
  try {
    return Loaded{Library::load(entry.image, entry.library(), content_), entry.source()};
  } catch (const Unavailable&) {
    throw;  // nothing is wrong with the entry
  } catch (const ToolError& e) {
    warn_once(e.what());
    cache_->remove(key_);
    return std::nullopt;
  }
}

Draft LibraryBuilder::compile(const Source& source) const {
  try {
    if (cache_) {
      return compile_in(std::make_unique<TemporaryFolder>(cache_->folder(), "build-"),
                        cache_->folder() + "/" + key_.digest, source);
    }
  } catch (const FileError& e) {  // may not be written, is full, ...
    warn_once("compiled derivatives are not kept: " + std::string(e.what()));
  }
  return compile_elsewhere(source);
}

Draft LibraryBuilder::compile_elsewhere(const Source& source) const {
  try {
    auto folder = std::make_unique<TemporaryFolder>(system_temporary_folder(), "dyntape-");
    const std::string path = folder->path();
    return compile_in(std::move(folder), path, source);
  } catch (const FileError& e) {
    throw Unavailable(e.what());
  }
}

Draft LibraryBuilder::compile_in(std::unique_ptr<TemporaryFolder> folder, const std::string& final_folder,
                                 const Source& source) const {
  write_file(folder->path() + "/" + kSourceFile, source.text);
  try {
    codegen::compile(compiler_, source, options_, folder->path(), final_folder);
  } catch (const ToolError&) {
    if (!options_.stop.stop_requested()) folder->keep();  // the message says where the source is
    throw;
  }
  return {std::move(folder), source.name, checksum(source.text)};
}

Loaded LibraryBuilder::load(Draft draft) const {
  // Loaded first: what does not load is not kept, and what is kept may be gone the next moment.
  Loaded loaded{Library::load(draft.folder->path() + "/" + kLibraryFile, content_), ""};
  if (const auto entry = publish(draft)) loaded.source_path = entry->source();
  if (cache_) cache_->sweep_sometimes();
  return loaded;
}

std::optional<Entry> LibraryBuilder::publish(Draft& draft) const {
  if (!cache_ || !draft.folder->path().starts_with(cache_->folder() + "/")) return std::nullopt;
  const Manifest manifest{draft.name, static_cast<int>(options_.order), generator_version(),
                          compiler_.version, draft.text_hash};
  return cache_->publish(*draft.folder, key_, manifest, options_.force_rebuild);
}

}  // namespace dyntape::codegen
