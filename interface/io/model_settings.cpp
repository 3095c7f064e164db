// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/io/model_settings.h>

namespace dyntape::io {

ModelSettings read_model_settings(Section& file, const ModelSettings& defaults) {
  Section block = file.child_or_empty("model_settings");
  ModelSettings settings = defaults;
  if (block.has("recompileLibraries")) settings.recompile_libraries = block.get<bool>("recompileLibraries");
  settings.recompile_libraries = block.get_or("recompileLibrariesCppAd", settings.recompile_libraries);
  settings.model_folder = block.get_or("modelFolderCppAd", settings.model_folder);
  settings.verbose = block.get_or("verboseCppAd", settings.verbose);
  return settings;
}

}  // namespace dyntape::io
