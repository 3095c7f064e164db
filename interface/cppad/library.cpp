// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/library.h>

#include <dyntape/interface/cppad/detail/patterns.h>

namespace CppAD::inline dyntape_names {

using namespace dyntape;

Function to_function(const ADFun<double>& f) {
  const auto& recording = f.core().recording();
  Function function = recording.kernels.empty()
                          ? *recording.function
                          : detail::with_patterns(*recording.function, recording.kernels);
  function.outputs.resize(f.Range());  // those of prints come after
  if (!f.function_name_get().empty()) function.name = f.function_name_get();
  return compact(function);
}

CompiledFunction to_library(const ADFun<double>& f, CodegenOptions options) {
  if (!f.core().recording().kernels.empty()) options.route = Route::kInterpreter;
  return CompiledFunction::make(to_function(f), options);
}

}  // namespace CppAD::inline dyntape_names
