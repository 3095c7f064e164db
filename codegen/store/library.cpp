// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/store/library.h>

#include <dlfcn.h>
#include <sys/mman.h>

#include <atomic>
#include <cfenv>
#include <cstdint>
#include <cstring>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/print/print_tables.h>
#include <dyntape/codegen/system/files.h>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace dyntape::codegen {
namespace {

// Rounding, flush-to-zero and masks of this thread; the exception flags, which any division sets, left out.
unsigned floating_point_control() {
#if defined(__SSE2__)
  return _mm_getcsr() & ~0x3fu;
#else
  return static_cast<unsigned>(std::fegetround());
#endif
}

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw ToolError("library " + path + " cannot be used: " + why);
}

// A file in memory with these bytes; none: the system has none.
Descriptor in_memory(const std::string& image) {
  Descriptor file(memfd_create("dyntape", MFD_CLOEXEC));
  try {
    if (file.number() >= 0) write_all(file.number(), "a file in memory", image);
  } catch (const FileError&) {
    return Descriptor();
  }
  return file;
}

// The loader tells libraries apart by what they are called, and numbers of files are used again: a slash or a slash and
// a dot for each bit of a number that counts up is another name of the same file.
std::string path_of_its_own(const Descriptor& file) {
  static std::atomic<std::uint64_t> counter{1};
  std::string path = "/proc/self/fd/";
  for (std::uint64_t bits = counter++; bits; bits /= 2) path += bits % 2 ? "./" : "/";
  return path + std::to_string(file.number());
}

void* open_library(const std::string& path) { return dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL); }

void* open_image(const std::string& image, const std::string& path) {
  const Descriptor file = in_memory(image);
  void* handle = file.number() >= 0 ? open_library(path_of_its_own(file)) : nullptr;
  const std::string reason = handle || file.number() < 0 ? "" : dlerror();
  if (!handle) handle = open_library(path);
  if (!handle)
    throw Unavailable("library " + path + " cannot be used: " + (reason.empty() ? dlerror() : reason));
  return handle;
}

}  // namespace

std::shared_ptr<const Library> Library::load(const std::string& path, const std::string& content_hash) {
  int error = 0;
  const auto image = read_file(path, error);
  if (!image) throw Unavailable("library " + path + " cannot be used: " + std::strerror(error));
  return load(*image, path, content_hash);
}

void Library::open(const std::string& image, const std::string& path) {
  std::fenv_t environment;
  std::fegetenv(&environment);
  const unsigned before = floating_point_control();
  handle_ = open_image(image, path);
  const unsigned after = floating_point_control();
  std::fesetenv(&environment);
  if (before != after) refuse(path, "loading it changes the floating-point state of the process");
}

std::shared_ptr<const Library> Library::load(const std::string& image, const std::string& path,
                                             const std::string& content_hash) {
  const std::shared_ptr<Library> library(new Library);
  library->open(image, path);
  const std::string symbol = descriptor_symbol(content_hash);
  const auto* d = static_cast<const dyntape_descriptor*>(dlsym(library->handle_, symbol.c_str()));
  if (!d) refuse(path, "it has no symbol " + symbol);
  if (d->abi != DYNTAPE_ABI || d->bytes != sizeof(dyntape_descriptor))
    refuse(path, "its interface is number " + std::to_string(d->abi) + ", this program's is number " +
                     std::to_string(DYNTAPE_ABI));
  if (content_hash != d->content_hash || std::strcmp(d->scalar, "double") != 0)
    refuse(path, "it describes another function");
  library->descriptor_ = d;
  return library;
}

Library::~Library() {
  if (handle_) dlclose(handle_);
}

}  // namespace dyntape::codegen
