// SPDX-License-Identifier: BSD-3-Clause
//
// Records a function: runs templated code once on AD and returns its operations as a Function.
//
//   Function f = record("spring", 2, 1, [](const VectorXad& x, const VectorXad& p) {
//     VectorXad y(1);
//     y[0] = 0.5 * p[0] * (x[0] - x[1]) * (x[0] - x[1]);
//     return y;
//   });
//
// The recording ends when the call returns or throws.  Use a Recorder if the code is not one function:
//
//   Recorder recorder("spring", 2, 1);
//   const VectorXad &x = recorder.x(), &p = recorder.p();
//   const AD stretch = x[0] - x[1];
//   Function f = recorder.end(VectorXad::Constant(1, 0.5 * p[0] * stretch * stretch));
//
// A thread may have several recordings open at once, nested or interleaved.  Each value belongs to one recording.
// An operation on values of two recordings is a RecordingError that names both.  Any number of threads may record at
// the same time.
//
// The code runs at a recording point, which decides the branches taken (scalar.h).  The entries of the default point
// are in (0.3, 1.1), away from special values.  A NaN at the recording point is no error.
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
  std::vector<double> variables;   // the recording point; empty: the default point
  std::vector<double> parameters;  // likewise
  // A branch on a recorded value records a guard (kGuard), or throws a RecordingError with file and line (kError).
  enum class Branches { kGuard, kError } branches = Branches::kGuard;
  std::vector<std::string> variable_names, parameter_names, output_names;
};

// An open recording: begins with the construction, ends with end() or the destruction, all in one thread.
class Recorder {
 public:
  Recorder(const std::string& name, std::size_t n_x, std::size_t n_p = 0, const RecordOptions& options = {},
           const char* file = __builtin_FILE(), int line = __builtin_LINE());
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  const VectorXad& x() const { return x_; }  // variables
  const VectorXad& p() const { return p_; }  // parameters

  // Ends the recording, also if it throws; returns the recorded function with outputs y.
  Function end(const VectorXad& y);

 private:
  struct Open;
  VectorXad make_inputs(Block block, const std::vector<double>& values);

  RecordOptions options_;
  std::unique_ptr<Open> open_;  // null after end()
  std::string name_;
  VectorXad x_, p_;
};

// Records f(x, p) -> y.  y may have any number of entries; entries may be constants.
//   file, line   the place that errors name; file may be nullptr
Function record(const std::string& name, std::size_t n_x, std::size_t n_p,
                const std::function<VectorXad(const VectorXad& x, const VectorXad& p)>& f,
                const RecordOptions& options = {}, const char* file = __builtin_FILE(),
                int line = __builtin_LINE());

// Without parameters.
Function record(const std::string& name, std::size_t n_x,
                const std::function<VectorXad(const VectorXad& x)>& f, const RecordOptions& options = {},
                const char* file = __builtin_FILE(), int line = __builtin_LINE());

// Calls a recorded function or a kernel inside a recording, as one node of the tape; returns its results.
VectorXad call(const std::shared_ptr<const Callee>& callee, const VectorXad& arguments);

}  // namespace dyntape
