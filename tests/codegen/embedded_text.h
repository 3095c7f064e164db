// SPDX-License-Identifier: BSD-3-Clause
//
// Embedded text, compiled with the flags of its banner and called.
#pragma once

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

#include <dyntape/codegen/options/flags.h>
#include <dyntape/codegen/pipeline.h>

#include "compilers.h"

namespace dyntape::testing {

class EmbeddedLibrary {
 public:
  explicit EmbeddedLibrary(const codegen::EmbeddedSource& e, std::vector<std::string> flags = {"-O2"}) {
    codegen::write_file(folder_ / "text.c", e.source.text);
    std::vector<std::string> words = {codegen::in_path("gcc"), "-std=c99", "-shared", "-fPIC"};
    words.insert(words.end(), codegen::contract_flags().begin(), codegen::contract_flags().end());
    words.insert(words.end(), flags.begin(), flags.end());
    for (const std::string& last :
         {std::string("-o"), folder_ / "text.so", folder_ / "text.c", std::string("-lm")})
      words.push_back(last);
    EXPECT_EQ(output_of(words, folder_), "");
    handle_ = dlopen((folder_ / "text.so").c_str(), RTLD_NOW | RTLD_LOCAL);
    EXPECT_NE(handle_, nullptr) << dlerror();
  }
  ~EmbeddedLibrary() {
    if (handle_) dlclose(handle_);
  }
  EmbeddedLibrary(const EmbeddedLibrary&) = delete;
  EmbeddedLibrary& operator=(const EmbeddedLibrary&) = delete;

  // The function of that name, called with arrays.
  template <class Return, class... Arrays>
  Return call(const std::string& name, Arrays*... arrays) const {
    auto* const function = reinterpret_cast<Return (*)(Arrays * ...)>(dlsym(handle_, name.c_str()));
    if (!function) throw std::runtime_error(name + " is not in the library");
    return function(arrays...);
  }

  template <class Entry>
  const Entry* table(const std::string& name) const {
    const auto* const entries = static_cast<const Entry*>(dlsym(handle_, name.c_str()));
    if (!entries) throw std::runtime_error(name + " is not in the library");
    return entries;
  }

 private:
  Scratch folder_;
  void* handle_ = nullptr;
};

}  // namespace dyntape::testing
