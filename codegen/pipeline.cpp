// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/pipeline.h>

#include <unistd.h>

#include <utility>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/codegen/build/compile.h>
#include <dyntape/codegen/options/flags.h>
#include <dyntape/codegen/pipeline_stages.h>
#include <dyntape/codegen/system/files.h>

namespace dyntape {
namespace {

// For another target, where no call takes several values: nothing is brought together.
codegen::KernelSets planned_alone(codegen::Product& product, CodegenOptions options) {
  const Functions functions = std::exchange(options.functions, Functions::kLibm);
  auto derived = codegen::derive(product, options);
  codegen::KernelSets sets =
      codegen::plan(product, std::move(derived), content_hash(product.function), options, false);
  sets.functions = functions;
  return sets;
}

}  // namespace

codegen::Source generate_source(const Function& recorded, const CodegenOptions& options) {
  codegen::Product product = codegen::begin(recorded);
  return codegen::print(product, codegen::derive(product, options), content_hash(product.function), options);
}

codegen::EmbeddedSource generate_embedded(const Function& recorded, const CodegenOptions& options,
                                          const codegen::EmbeddedOptions& how) {
  codegen::Product product = codegen::begin(recorded);
  return codegen::print_embedded(planned_alone(product, options), how);
}

codegen::Source generate_casadi(const Function& recorded, const codegen::CasadiBlocks& blocks,
                                const CodegenOptions& options) {
  codegen::Product product = codegen::begin(recorded);
  return codegen::print_casadi(planned_alone(product, options), blocks);
}

void compile_casadi(const codegen::Source& source, const std::string& library,
                    const CodegenOptions& options) {
  const auto compiler = codegen::find_compiler(options.compiler, codegen::accepted_flags(options.flags));
  if (!compiler) throw ToolError(codegen::no_compiler(options.compiler));
  const codegen::TemporaryFolder folder(codegen::system_temporary_folder(), "dyntape-casadi-");
  codegen::write_file(folder.path() + "/" + codegen::kSourceFile, source.text);
  codegen::compile(*compiler, source, options, folder.path(), folder.path());
  int error = 0;
  const auto bytes = codegen::read_file(folder.path() + "/" + codegen::kLibraryFile, error);
  if (!bytes) throw FileError(folder.path() + ": the compiler's library is gone");
  write_file_atomically(library, *bytes);
}

std::vector<std::string> write_source(const codegen::Source& source, const std::string& folder) {
  std::vector<std::string> paths;
  for (const auto& [suffix, text] : {std::pair(".c", &source.text), std::pair(".h", &source.header)}) {
    if (text->empty()) continue;
    paths.push_back((folder.empty() ? "" : folder + "/") + source.name + suffix);  // "": the current folder
    write_file_atomically(paths.back(), *text);
  }
  return paths;
}

}  // namespace dyntape
