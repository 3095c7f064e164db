// SPDX-License-Identifier: BSD-3-Clause
//
// Compiles C files to a shared library and loads its functions, by CppAD's names.
//
//   std::string error = create_dll_lib("./f.so", std::vector<std::string>{"f.c"}, {});      // empty: no error
//   link_dll_lib library("./f.so", error);
//   const auto f = reinterpret_cast<jit_double>(library("cppad_jit_f", error));
//
// to_library() (library.h) does this for a recorded function, with derivatives and a cache.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace CppAD::inline dyntape_names {

using jit_double = int (*)(std::size_t, const double*, std::size_t, double*, std::size_t*);
using jit_float = int (*)(std::size_t, const float*, std::size_t, float*, std::size_t*);

namespace detail {
// In compiler.cpp.
std::string make_library(const std::string& library, const std::vector<std::string>& sources,
                         const std::map<std::string, std::string>& options);
}  // namespace detail

// options["compile"] and options["link"] are the commands, without a shell: "gcc -c -fPIC", "gcc -shared".  Returns what went wrong.
template <class StringVector>
std::string create_dll_lib(const std::string& library, const StringVector& sources,
                           const std::map<std::string, std::string>& options) {
  std::vector<std::string> files;
  for (std::size_t i = 0; i < std::size_t(sources.size()); ++i) files.push_back(sources[i]);
  return detail::make_library(library, files, options);
}

// A library that is loaded as long as this lives.  Members set the sentence to what went wrong, or empty it.
class link_dll_lib {
 public:
  link_dll_lib(const std::string& library, std::string& error);
  void* operator()(const std::string& function, std::string& error) const;

 private:
  std::string path_;
  std::shared_ptr<void> handle_;
};

}  // namespace CppAD::inline dyntape_names
