// SPDX-License-Identifier: BSD-3-Clause
//
// The block in which OCS2's task files say how models are generated:
//
//   model_settings
//   {
//     recompileLibrariesCppAd  false         ; true rebuilds although the cache has the library
//     modelFolderCppAd         /var/models   ; root folder of the cache; "" takes the user's default
//     verboseCppAd             true          ; says what is generated, compiled and loaded
//   }
//
//   const ModelSettings settings = read_model_settings(task);
//
// `recompileLibraries`, the spelling of other OCS2 examples, is read as well; recompileLibrariesCppAd wins.
// The block may be absent.  Unlike OCS2, which rebuilds by default because its libraries go stale, the
// default here is not to: the cache knows libraries by their content.
#pragma once

#include <string>

#include <dyntape/interface/io/section.h>

namespace dyntape::io {

struct ModelSettings {
  bool recompile_libraries = false;
  std::string model_folder;  // empty: the default folder of the cache
  bool verbose = false;
};

// `file` is the section that contains model_settings.  Other keys of the block are for the caller to ask for.
ModelSettings read_model_settings(Section& file, const ModelSettings& defaults = {});

}  // namespace dyntape::io
