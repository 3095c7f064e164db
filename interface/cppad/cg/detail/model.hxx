// SPDX-License-Identifier: BSD-3-Clause
//
// What a model is behind its face: a compiled function, and which elements were asked for.  For the sources here.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/cppad/cg/model.h>

namespace CppAD::inline dyntape_names::cg {

using namespace dyntape;

struct ModelState {
  struct Elements {
    std::vector<std::size_t> row, col,
        place;  // place: in the pattern of the function; SIZE_MAX: zero by structure
  };
  ModelState(std::string name, ModelChoice choice, CompiledFunction function,
             std::shared_ptr<const detail::Recording<double>> recording);

  std::string name;
  ModelChoice choice;
  CompiledFunction function;
  std::shared_ptr<const detail::Recording<double>> recording;
  Elements jacobian, hessian;
  mutable std::mutex mutex;
  mutable std::vector<std::unique_ptr<CompiledFunction::Workspace>> free;
};

}  // namespace CppAD::inline dyntape_names::cg
