// SPDX-License-Identifier: BSD-3-Clause
//
// Converts the code-generation settings in the ModelSettings of OCS2's examples to settings of a function.
//
//   CppAdInterface f(flow, 24, 0, settingsFrom(modelSettings, "dynamics"));        // a client's own struct
//   f.createModels(ApproximationOrder::First, modelSettings.verboseCppAd);
#pragma once

#include <filesystem>
#include <string>

#include <dyntape/interface/ocs2/ad_function.h>

namespace dyntape::ocs2 {

// The members of OCS2's ModelSettings that are read here; a client's struct may have any of them, and others.
struct ModelSettings {
  bool recompileLibrariesCppAd = true;
  bool verboseCppAd = true;
  std::string modelFolderCppAd = "";  // OCS2: "/tmp/ocs2"; empty: the user's default cache
};

// The settings of these ModelSettings.  recompileLibrariesCppAd (or recompileLibraries) has no effect unless
// `really`, because the cache never loads a stale library.  With `really`, it compiles even if the cache has the
// library.
template <class Settings>
AdFunctionSettings settingsFrom(const Settings& from, const std::string& modelName, bool really = false) {
  AdFunctionSettings settings;
  settings.name = modelName;
  settings.flags = AdFunction::defaultCompileFlags();
  if constexpr (requires { from.modelFolderCppAd; }) {
    const std::string folder(from.modelFolderCppAd);
    if (!folder.empty()) settings.folder = std::filesystem::absolute(folder).lexically_normal().string();
  }
  if constexpr (requires { from.recompileLibrariesCppAd; }) {
    settings.forceRebuild = really && from.recompileLibrariesCppAd;
  } else if constexpr (requires { from.recompileLibraries; }) {
    settings.forceRebuild = really && from.recompileLibraries;
  }
  return settings;
}

}  // namespace dyntape::ocs2
