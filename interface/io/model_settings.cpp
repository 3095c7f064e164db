// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/io/model_settings.h>

namespace dyntape::io {

ModelSettings read_model_settings(Section& file, const ModelSettings& defaults) {
  Section block = file.about("compiled libraries, as OCS2 spells it").child_or_empty("model_settings");
  ModelSettings settings = defaults;
  block.about(
      "compile the dynamics again even if the cache has them (another name of recompileLibrariesCppAd)");
  if (block.has("recompileLibraries")) settings.recompile_libraries = block.get<bool>("recompileLibraries");
  settings.recompile_libraries = block.about("compile the dynamics again even if the cache has them")
                                     .get_or("recompileLibrariesCppAd", settings.recompile_libraries);
  settings.model_folder =
      block.about("the cache; empty: the usual one").get_or("modelFolderCppAd", settings.model_folder);
  settings.verbose = block.about("say what is compiled").get_or("verboseCppAd", settings.verbose);
  return settings;
}

}  // namespace dyntape::io
