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
codegen::KernelSets planned_alone(codegen::Product& product, CodegenOptions options,
                                  codegen::StatementOrder order = codegen::StatementOrder::kRecorded) {
  const Functions functions = std::exchange(options.functions, Functions::kLibm);
  auto derived = codegen::derive(product, options);
  codegen::KernelSets sets =
      codegen::plan(product, std::move(derived), content_hash(product.function), options, false, order);
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

codegen::EmbeddedSource generate_embedded_parts(const std::vector<EmbeddedPart>& parts,
                                                const CodegenOptions& options, bool single) {
  if (parts.empty()) throw ArgumentError("embedded parts: expected at least one function");
  codegen::EmbeddedOptions how;
  how.single = single;
  std::vector<codegen::KernelPlan> kernels;
  codegen::Product first = codegen::begin(parts.front().function);
  for (const EmbeddedPart& part : parts) {
    codegen::Product product = codegen::begin(part.function);
    CodegenOptions own = options;
    own.order = part.order;
    codegen::KernelSets sets = planned_alone(product, own);
    kernels.push_back(std::move(sets.kernels.back()));
    how.parts.push_back(part.name);
  }
  const codegen::KernelSets all = {first.function,
                                   options.label.empty() ? first.function.name : options.label,
                                   content_hash(first.function),
                                   std::move(kernels),
                                   options.piece_statements,
                                   options.functions};
  return codegen::print_embedded(all, how);
}

codegen::DeviceSource generate_device(const Function& recorded, const CodegenOptions& options,
                                      const codegen::DeviceOptions& how) {
  codegen::Product product = codegen::begin(recorded);
  CodegenOptions longer = options;
  longer.piece_statements = how.piece_statements;
  return codegen::print_device(planned_alone(product, longer, codegen::StatementOrder::kFewLive), how);
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

std::vector<std::string> write_source(const codegen::Source& source, const std::string& folder,
                                      const std::string& suffix) {
  std::vector<std::string> paths;
  std::vector<const std::string*> texts;
  for (const auto& [end, text] :
       {std::pair(suffix, &source.text), std::pair(std::string(".h"), &source.header)}) {
    if (text->empty()) continue;
    texts.push_back(text);
    paths.push_back((folder.empty() ? "" : folder + "/") + source.name + end);  // "": the current folder
  }
  for (const std::string& path : paths) check_can_write(path);
  for (std::size_t i = 0; i < paths.size(); ++i) write_file_atomically(paths[i], *texts[i]);
  return paths;
}

}  // namespace dyntape
