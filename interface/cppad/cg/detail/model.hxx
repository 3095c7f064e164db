// SPDX-License-Identifier: BSD-3-Clause
//
// What a model is behind its face: a compiled function, and which elements were asked for.  For the sources here.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/run/workspace_pool.h>
#include <dyntape/interface/cppad/cg/model.h>

namespace CppAD::inline dyntape_names::cg {

using namespace dyntape;

struct ModelState {
  struct Elements {
    std::vector<std::size_t> row, col,
        place;                // place: in the pattern of the function; SIZE_MAX: zero by structure
    bool is_pattern = false;  // the elements are the non-zeros of the function, in their order
  };
  ModelState(std::string name, ModelChoice choice, CompiledFunction function,
             std::shared_ptr<const detail::Recording<double>> recording);

  std::string name;
  ModelChoice choice;
  CompiledFunction function;
  std::shared_ptr<const detail::Recording<double>> recording;
  Elements jacobian, hessian;
  std::size_t n_x, n_y;
  const Pattern no_pattern{};
  const Pattern &jacobian_pattern, &hessian_pattern;  // of the function; empty if it has none
  const bool hessian_is_zero;                         // of every sum of results, at every point
  mutable dyntape::detail::WorkspacePool<CompiledFunction::Workspace> workspaces;
};

}  // namespace CppAD::inline dyntape_names::cg
