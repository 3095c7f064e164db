// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/library.h>

#include <dlfcn.h>

#include <cfenv>
#include <cstring>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/print_c.h>
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

}  // namespace

std::shared_ptr<const Library> Library::load(const std::string& path, const std::string& content_hash) {
  const std::shared_ptr<Library> library(new Library);
  std::fenv_t environment;
  std::fegetenv(&environment);
  const unsigned before = floating_point_control();
  library->handle_ = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  const unsigned after = floating_point_control();
  std::fesetenv(&environment);
  if (!library->handle_) refuse(path, dlerror());
  if (before != after) refuse(path, "loading it changes the floating-point state of the process");

  const std::string symbol = descriptor_symbol(content_hash);
  const auto* d = static_cast<const dyntape_descriptor*>(dlsym(library->handle_, symbol.c_str()));
  if (!d) refuse(path, "it has no symbol " + symbol);
  if (d->abi != DYNTAPE_ABI || d->bytes != sizeof(dyntape_descriptor)) {
    refuse(path, "its interface is number " + std::to_string(d->abi) + ", this program's is number " +
                     std::to_string(DYNTAPE_ABI));
  }
  if (content_hash != d->content_hash || std::strcmp(d->scalar, "double") != 0)
    refuse(path, "it describes another function");
  library->descriptor_ = d;
  return library;
}

Library::~Library() {
  if (handle_) dlclose(handle_);
}

}  // namespace dyntape::codegen
