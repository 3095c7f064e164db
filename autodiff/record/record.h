// SPDX-License-Identifier: BSD-3-Clause
//
// Recording: run templated code once on AD and keep what it did.
//
//   Function f = record("spring", 2, 1, [](const VectorXad& x, const VectorXad& p) {
//     VectorXad y(1);
//     y[0] = 0.5 * p[0] * (x[0] - x[1]) * (x[0] - x[1]);
//     return y;
//   });
//
// The recording ends when the call returns or throws, whatever the user's function does: there is no state to
// clean up.  One recording a thread at a time; as many threads as there are, without any set-up.
//
// The code runs at a recording point, which decides the branches it takes (see scalar.h); its default is in
// (0.3, 1.1), away from special values.  A NaN there is no error.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/record/eigen.h>

namespace dyntape {

struct RecordOptions {
  std::vector<double> variables;   // the recording point; empty: the default
  std::vector<double> parameters;  // likewise
  // What a branch on a recorded value does: record a guard, or throw RecordingError naming file and line.
  enum class Branches { kGuard, kError } branches = Branches::kGuard;
  std::vector<std::string> variable_names, parameter_names, output_names;
};

// f(x, p) -> y; y may hold any number of entries, constants among them.  Errors name the caller's line; who
// records for somebody else hands that line on, or nullptr where there is none.
Function record(const std::string& name, std::size_t n_x, std::size_t n_p,
                const std::function<VectorXad(const VectorXad& x, const VectorXad& p)>& f,
                const RecordOptions& options = {}, const char* file = __builtin_FILE(),
                int line = __builtin_LINE());

// Without parameters.
Function record(const std::string& name, std::size_t n_x,
                const std::function<VectorXad(const VectorXad& x)>& f, const RecordOptions& options = {},
                const char* file = __builtin_FILE(), int line = __builtin_LINE());

// Inside a recording: the results of a recorded function or kernel as one visible node.
VectorXad call(const std::shared_ptr<const Callee>& callee, const VectorXad& arguments);

}  // namespace dyntape
