// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/pipeline.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/cache.h>
#include <dyntape/codegen/compile.h>
#include <dyntape/codegen/dump.h>
#include <dyntape/codegen/files.h>
#include <dyntape/codegen/flags.h>
#include <dyntape/codegen/notice.h>
#include <dyntape/codegen/simplify.h>

namespace dyntape {
namespace codegen {
namespace {

// Runs a stage and adds the time it took.
template <class Stage>
auto timed(double& seconds, Stage&& stage) {
  struct Clock {
    double& seconds;
    std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
    ~Clock() { seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); }
  } clock{seconds};
  return stage();
}

Key key_of(const std::string& content, const CodegenOptions& options, const Compiler& compiler) {
  std::string text = "content " + content + "\norder " + std::to_string(static_cast<int>(options.order)) +
                     "\nprofile " + to_string(options.profile) + "\ngenerator " + generator_version() + " " +
                     generator_fingerprint() + "\ninterface " + std::to_string(DYNTAPE_ABI) + "\npieces " +
                     std::to_string(options.piece_statements) + "\ncompiler " + compiler.path + "\n" +
                     compiler.identity + "\nflags";
  for (const std::string& flag : compiler.flags) text += " " + flag;
  return make_key(std::move(text));
}

std::vector<Derivatives> derive_all(const Function& recorded, const CodegenOptions& options) {
  const Function function = simplify(recorded, options.profile);
  std::vector<Derivatives> derivatives;
  for (int order = 0; order <= static_cast<int>(options.order); ++order)
    derivatives.push_back(simplify(derive(function, static_cast<Order>(order)), options.profile));
  return derivatives;
}

std::vector<KernelPlan> schedule_all(std::vector<Derivatives> derivatives, std::size_t piece_statements) {
  std::vector<KernelPlan> plans;
  for (Derivatives& d : derivatives) {
    std::vector<OutputRange> groups = {{0, d.n_y}};
    if (d.order >= Order::kFirst) groups.push_back({d.n_y, d.n_y + d.jacobian.nnz()});
    if (d.order >= Order::kSecond) groups.push_back({groups.back().end, d.function.n_y()});
    Schedule s = schedule(d.function, groups, piece_statements);
    plans.push_back({std::move(d), std::move(s)});
  }
  return plans;
}

// The loaded library of an entry; none if it turns out not to be usable, and then the entry is gone.
bool load_entry(const Cache& cache, const Key& key, const Entry& entry, const std::string& content,
                Product& product) {
  try {
    product.library = timed(product.timings.load, [&] { return Library::load(entry.library(), content); });
  } catch (const ToolError& e) {
    say_once(e.what());
    cache.remove(key);
    return false;
  }
  product.source_path = entry.source();
  return true;
}

Product interpreted(Product product, const CodegenOptions& options) {
  product.interpreted = timed(product.timings.derive, [&] { return derive_all(product.function, options); });
  return product;
}

// Compiles in a folder of the cache, or else in a temporary one; keeps the source if that fails.
void compile_and_load(const Source& source, const Compiler& compiler, const std::optional<Cache>& cache,
                      const Key& key, const std::string& content, const CodegenOptions& options,
                      Product& product) {
  std::optional<TemporaryFolder> folder;
  try {
    if (cache) folder.emplace(cache->folder(), "build-");
  } catch (const FileError& e) {
    say_once("compiled derivatives are not kept: " + std::string(e.what()));
  }
  const bool in_cache = folder.has_value();
  if (!in_cache) folder.emplace(system_temporary_folder(), "dyntape-");
  const std::string final_folder = in_cache ? cache->folder() + "/" + key.digest : folder->path();
  timed(product.timings.compile, [&] {
    write_file(folder->path() + "/" + kSourceFile, source.text);
    try {
      compile(compiler, source, options, folder->path(), final_folder);
    } catch (const ToolError&) {
      folder->release();  // the message says where the source is
      throw;
    }
  });
  const Manifest manifest{source.name,
                          static_cast<int>(options.order),
                          to_string(options.profile),
                          generator_version(),
                          compiler.version,
                          checksum(source.text)};
  if (in_cache) {
    const auto entry = cache->publish(*folder, key, manifest, options.force_rebuild);
    const bool is_loaded = entry && load_entry(*cache, key, *entry, content, product);
    cache->sweep_sometimes();  // not earlier: what is loaded may go
    if (is_loaded) return;
    // Another process swept it away, or replaced it, at this very moment: without the cache nobody can.
    if (folder->path().empty())
      return compile_and_load(source, compiler, std::nullopt, key, content, options, product);
  }
  product.library = timed(product.timings.load,
                          [&] { return Library::load(folder->path() + "/" + kLibraryFile, content); });
}

KernelSets kernel_sets(const Function& function, const std::string& content, const CodegenOptions& options) {
  return {function, options.label.empty() ? function.name : options.label, content, options.profile, {}};
}

}  // namespace

Product produce(const Function& recorded, const CodegenOptions& options) {
  Product product;
  Timings& t = product.timings;
  const Function& function = product.function = compact(recorded);
  const Dump dump(function.name);
  if (options.route == Route::kInterpreter) return interpreted(std::move(product), options);

  const auto cache = options.use_cache ? Cache::open(options.cache_folder) : std::nullopt;
  const auto compiler = timed(t.hash, [&] {
    return find_compiler(options.compiler, accepted_flags(options.flags), cache ? cache->folder() : "");
  });
  const auto stop_if_only_cached = [&] {
    if (options.only_cached) throw NotCached("the cache has no library of \"" + function.name + "\"");
  };
  if (!compiler) {
    stop_if_only_cached();
    if (options.route == Route::kCompiled) throw ToolError(no_compiler(options.compiler));
    say_once(no_compiler(options.compiler) + "; derivatives are interpreted");
    return interpreted(std::move(product), options);
  }
  product.compiler = compiler->version;
  const std::string content = timed(t.hash, [&] { return content_hash(function); });
  const Key key = key_of(content, options, *compiler);
  if (cache && !options.force_rebuild) {
    const auto entry = timed(t.load, [&] { return cache->find(key); });
    if (entry && load_entry(*cache, key, *entry, content, product)) return t.cache_hit = true, product;
  }
  stop_if_only_cached();

  KernelSets sets = kernel_sets(function, content, options);
  dump.graph("recorded", function);
  auto derivatives = timed(t.derive, [&] { return derive_all(function, options); });
  dump.graphs("derived", derivatives);
  sets.kernels =
      timed(t.schedule, [&] { return schedule_all(std::move(derivatives), options.piece_statements); });
  dump.schedules(sets.kernels);
  const Source source = timed(t.print, [&] { return print_c(sets); });
  dump.text("c", source.text);
  compile_and_load(source, *compiler, cache, key, content, options, product);
  return product;
}

}  // namespace codegen

codegen::Source generate_source(const Function& recorded, const CodegenOptions& options) {
  const Function function = compact(recorded);
  codegen::KernelSets sets = codegen::kernel_sets(function, content_hash(function), options);
  sets.kernels = codegen::schedule_all(codegen::derive_all(function, options), options.piece_statements);
  return codegen::print_c(sets);
}

std::vector<std::string> write_source(const codegen::Source& source, const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw FileError(folder + ": cannot be made: " + error.message());
  const codegen::TemporaryFolder temporary(folder, ".dyntape-");
  std::vector<std::string> paths;
  for (const auto& [suffix, text] : {std::pair(".c", &source.text), std::pair(".h", &source.header)}) {
    const std::string file = source.name + suffix, draft = temporary.path() + "/" + file;
    codegen::write_file(draft, *text);
    paths.push_back(folder + "/" + file);
    if (std::rename(draft.c_str(), paths.back().c_str()) != 0)
      throw FileError(paths.back() + ": cannot be written");
  }
  return paths;
}

}  // namespace dyntape
