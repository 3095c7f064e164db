// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/cg/library_gen.h>

#include <filesystem>

#include <dyntape/codegen/pipeline.h>
#include <dyntape/interface/cppad/conditions.h>
#include <dyntape/interface/cppad/detail/patterns.h>
#include <dyntape/interface/cppad/cg/detail/model_file.hxx>

namespace CppAD::inline dyntape_names::cg {

namespace {

Function function_of(const ModelCSourceGen<double>& model) {
  const auto& recording = model.recording();
  if (!recording.captured.empty())
    detail::refuse("model \"" + model.getName() +
                   "\" was recorded with values of another recording, which a library has not");
  Function function = recording.kernels.empty()
                          ? *recording.function
                          : detail::with_patterns(*recording.function, recording.kernels);
  function.outputs.resize(recording.range);
  function.name = model.getName();
  return compact(function);
}

CodegenOptions options_of(const ModelCSourceGen<double>& model) {
  const ModelChoice& c = model.choice();
  CodegenOptions options;
  options.order = c.hessian || c.sparse_hessian || c.reverse_two                      ? Order::kSecond
                  : c.jacobian || c.sparse_jacobian || c.forward_one || c.reverse_one ? Order::kFirst
                                                                                      : Order::kValue;
  return options;
}

// A model computes on the thread of the caller.
std::vector<std::string> flags_for_models(std::vector<std::string> flags) {
  std::erase_if(flags, [](const std::string& flag) { return flag == "-pthread" || flag == "-fopenmp"; });
  return flags;
}

std::shared_ptr<const ModelState> state_of(const ModelCSourceGen<double>& model, const CodegenOptions& how) {
  CodegenOptions options = how;
  options.order = options_of(model).order;
  if (!model.recording().kernels.empty()) options.route = Route::kInterpreter;
  return std::make_shared<const ModelState>(
      model.getName(), model.choice(), CompiledFunction::make(function_of(model), options),
      detail::recording_of_numbers(model.recording(), "createDynamicLibrary"));
}

}  // namespace

template <>
void ModelLibraryCSourceGen<double>::saveSources(const std::string& folder) const {
  std::filesystem::create_directories(folder);
  for (const auto* model : models_)
    write_source(generate_source(function_of(*model), options_of(*model)), folder);
}

template <>
std::unique_ptr<DynamicLib<double>> DynamicModelLibraryProcessor<double>::createDynamicLibrary(
    AbstractCCompiler<double>& compiler, bool loadLib) {
  CodegenOptions how;
  how.compiler = compiler.getCompilerPath();
  how.flags = flags_for_models(compiler.getCompileFlags());
  Models models;
  for (const auto* model : sources_.getModels()) {
    if (!models.emplace(model->getName(), state_of(*model, how)).second)
      detail::refuse("library \"" + name_ + "\": two models are called \"" + model->getName() + "\"");
  }
  write_models(name_ + (extension_ ? *extension_ : ".so"), models, how);
  if (!loadLib) return nullptr;
  return std::make_unique<DynamicLib<double>>(std::move(models));
}

}  // namespace CppAD::inline dyntape_names::cg
