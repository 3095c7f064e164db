// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/device/opencl_api.h>

#include <dlfcn.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/system/files.h>

namespace dyntape::codegen::opencl {
namespace {

constexpr char kLoader[] = "libOpenCL.so.1";

}  // namespace

Api load(const std::string& library) {
  void* const handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle)
    throw ToolError("OpenCL: the loader " + library +
                    " cannot be opened; expected an installed loader and a driver of the device (Debian: " +
                    "ocl-icd-libopencl1), or its path in DYNTAPE_OPENCL");
  Api found;
  const auto find = [&](const char* symbol) {
    void* const function = dlsym(handle, symbol);
    if (!function)
      throw ToolError("OpenCL: " + library + " has no function " + symbol + "; expected a loader of OpenCL");
    return function;
  };
#define DYNTAPE_OPENCL_FIND(name, symbol, result, parameters) \
  found.name = reinterpret_cast<result(*) parameters>(find(#symbol));
  DYNTAPE_OPENCL_FUNCTIONS(DYNTAPE_OPENCL_FIND)
#undef DYNTAPE_OPENCL_FIND
  return found;  // open for good: drivers keep threads
}

const Api& api() {
  static const Api loaded = [] {
    const std::string named = environment_variable("DYNTAPE_OPENCL");
    return load(named.empty() ? kLoader : named);
  }();
  return loaded;
}

}  // namespace dyntape::codegen::opencl
