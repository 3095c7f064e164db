// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/build/text_library.h>

#include <dlfcn.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/build/compile.h>
#include <dyntape/codegen/options/flags.h>
#include <dyntape/codegen/print/print_tables.h>
#include <dyntape/codegen/store/cache.h>
#include <dyntape/codegen/system/files.h>

namespace dyntape::codegen {

namespace {

Key key_of_text(const Source& source, const Compiler& compiler) {
  std::string text = "text " + checksum(source.text) + "\ngenerator " + generator_version() + "\ncompiler " +
                     compiler.path + "\n" + compiler.identity + "\nflags";
  for (const std::string& flag : compiler.flags) text += " " + flag;
  return make_key(std::move(text));
}

void compile_text(const Source& source, const CodegenOptions& options, const Compiler& compiler,
                  const std::string& folder, const std::string& final_folder) {
  write_file(folder + "/" + kSourceFile, source.text);
  compile(compiler, source, options, folder, final_folder);
}

}  // namespace

std::shared_ptr<const TextLibrary> TextLibrary::make(const Source& source, const CodegenOptions& options) {
  const auto cache = options.use_cache ? Cache::open(options.cache_folder) : std::nullopt;
  const auto compiler =
      find_compiler(options.compiler, accepted_flags(options.flags), cache ? cache->folder() : "");
  if (!compiler) throw ToolError(no_compiler(options.compiler));
  const auto load = [](const std::string& path) {
    return std::shared_ptr<const TextLibrary>(new TextLibrary(path));
  };
  if (!cache) {
    const TemporaryFolder folder(system_temporary_folder(), "dyntape-text-");
    compile_text(source, options, *compiler, folder.path(), folder.path());
    return load(folder.path() + "/" + kLibraryFile);
  }
  const Key key = key_of_text(source, *compiler);
  if (!options.force_rebuild) {
    if (const auto entry = cache->find(key)) return load(entry->library());
  }
  TemporaryFolder folder(cache->folder(), "build-");
  compile_text(source, options, *compiler, folder.path(), cache->folder() + "/" + key.digest);
  const auto library = load(folder.path() + "/" + kLibraryFile);
  cache->publish(folder, key, {source.name, 0, generator_version(), compiler->version, checksum(source.text)},
                 options.force_rebuild);
  cache->sweep_sometimes();
  return library;
}

TextLibrary::TextLibrary(const std::string& path) : handle_(dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL)) {
  if (!handle_) throw ToolError("the library " + path + " cannot be loaded: " + dlerror());
}

TextLibrary::~TextLibrary() { dlclose(handle_); }

void* TextLibrary::symbol(const std::string& name) const {
  void* const found = dlsym(handle_, name.c_str());
  if (!found) throw ToolError("a library has no function \"" + name + "\"");
  return found;
}

}  // namespace dyntape::codegen
