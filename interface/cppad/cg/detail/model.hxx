// SPDX-License-Identifier: BSD-3-Clause
//
// What a model is behind its face: a compiled function, and which elements were asked for.  For the sources here.
#pragma once

#include <atomic>
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
        place;                // place: in the pattern of the function; SIZE_MAX: zero by structure
    bool is_pattern = false;  // the elements are the non-zeros of the function, in their order
  };
  // Memory of one call at a time.
  struct Work {
    explicit Work(const CompiledFunction& f) : workspace(f) {}
    CompiledFunction::Workspace workspace;
    std::vector<double> values;  // non-zeros
  };
  ModelState(std::string name, ModelChoice choice, CompiledFunction function,
             std::shared_ptr<const detail::Recording<double>> recording);

  std::string name;
  ModelChoice choice;
  CompiledFunction function;
  std::shared_ptr<const detail::Recording<double>> recording;
  Elements jacobian, hessian;
  // A call takes `first`, or one of `others` if another call has it.
  mutable std::atomic<bool> is_first_taken = false;
  mutable std::unique_ptr<Work> first;
  mutable std::mutex mutex;
  mutable std::vector<std::unique_ptr<Work>> others;
};

}  // namespace CppAD::inline dyntape_names::cg
