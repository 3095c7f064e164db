// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/pipeline.h>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/codegen/pipeline_stages.h>
#include <dyntape/codegen/system/files.h>

namespace dyntape {

codegen::Source generate_source(const Function& recorded, const CodegenOptions& options) {
  codegen::Product product = codegen::begin(recorded);
  return codegen::print(product, codegen::derive(product, options), content_hash(product.function), options);
}

codegen::EmbeddedSource generate_embedded(const Function& recorded, const CodegenOptions& options,
                                          const codegen::EmbeddedOptions& how) {
  codegen::Product product = codegen::begin(recorded);
  // The target is another one, and may have to do without fma.
  auto derived = codegen::derive(product, options, false);
  return codegen::print_embedded(
      codegen::plan(product, std::move(derived), content_hash(product.function), options, false), how);
}

std::vector<std::string> write_source(const codegen::Source& source, const std::string& folder) {
  std::vector<std::string> paths;
  for (const auto& [suffix, text] : {std::pair(".c", &source.text), std::pair(".h", &source.header)}) {
    paths.push_back((folder.empty() ? "" : folder + "/") + source.name + suffix);  // "": the current folder
    write_file_atomically(paths.back(), *text);
  }
  return paths;
}

}  // namespace dyntape
