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
// clean up.  Where code is not one function, a Recorder begins and ends:
//
//   Recorder recorder("spring", 2, 1);
//   const VectorXad &x = recorder.x(), &p = recorder.p();
//   const AD stretch = x[0] - x[1];
//   Function f = recorder.end(VectorXad::Constant(1, 0.5 * p[0] * stretch * stretch));
//
// A thread may have several recordings open, one within the other or side by side: each value belongs to one, and values
// of two in one operation are a RecordingError that names both.  As many threads as there are, without any set-up.
//
// The code runs at a recording point, which decides the branches it takes (see scalar.h); its default is in
// (0.3, 1.1), away from special values.  A NaN there is no error.
#pragma once

#include <functional>
#include <memory>
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

// A recording that is open from its construction until end() or its destruction, all in one thread.
class Recorder {
 public:
  Recorder(const std::string& name, std::size_t n_x, std::size_t n_p = 0, const RecordOptions& options = {},
           const char* file = __builtin_FILE(), int line = __builtin_LINE());
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  const VectorXad& x() const { return x_; }  // variables
  const VectorXad& p() const { return p_; }  // parameters

  // What was recorded, with these results; the recording is over, also if this throws.
  Function end(const VectorXad& y);

 private:
  struct Open;
  VectorXad make_inputs(Block block, const std::vector<double>& values);

  RecordOptions options_;
  std::unique_ptr<Open> open_;  // null: it is over
  std::string name_;
  VectorXad x_, p_;
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
