// SPDX-License-Identifier: BSD-3-Clause
//
// What a model is behind its face: a compiled function, and which elements were asked for.  For the sources here.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/run/workspace_pool.h>
#include <dyntape/interface/cppad/cg/model.h>

namespace CppAD::inline dyntape_names::cg {

using namespace dyntape;

struct ModelState {
  // How the non-zeros of the function's pattern get into an array of results.
  struct Moves {
    struct Move {
      std::size_t from, to;
    };
    std::vector<Move> moves;
    std::size_t size = 0;     // of the array
    bool has_zeros = false;   // some entries are zero by structure
    bool is_pattern = false;  // the array is the non-zeros in their order
  };
  // The elements that were asked for; their values, a dense matrix of them, and the dense matrix of all.
  struct Elements {
    std::vector<std::size_t> row, col;
    Moves values, spread, dense;
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
  std::array<dyntape_run, 3> kernels{};  // by order, for a call on the stack; null: by a workspace
  mutable dyntape::detail::WorkspacePool<CompiledFunction::Workspace> workspaces;
};

}  // namespace CppAD::inline dyntape_names::cg
