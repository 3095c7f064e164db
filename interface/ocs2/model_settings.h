// SPDX-License-Identifier: BSD-3-Clause
//
// What OCS2's examples keep of code generation in their ModelSettings, as settings of a function here.
//
//   CppAdInterface f(flow, 24, 0, settingsFrom(modelSettings, "dynamics"));        // a client's own struct
//   f.createModels(ApproximationOrder::First, modelSettings.verboseCppAd);
#pragma once

#include <filesystem>
#include <string>

#include <dyntape/interface/ocs2/ad_function.h>

namespace dyntape::ocs2 {

// The members of OCS2's that matter here; a client's struct may have any of them, and others.
struct ModelSettings {
  bool recompileLibrariesCppAd = true;
  bool verboseCppAd = true;
  std::string modelFolderCppAd = "";  // OCS2: "/tmp/ocs2"; empty: the user's default cache
};

// recompileLibrariesCppAd (or recompileLibraries) says "compile, what is there may be stale": here nothing stale can be loaded, so
// that it changes nothing unless `really`, which compiles whatever is there.
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
