// SPDX-License-Identifier: BSD-3-Clause
//
// The one family of exceptions of the project.
//
//   try { ... } catch (const dyntape::Error& e) { std::cerr << e.what() << "\n"; }
//
// A message is one clear sentence: what is wrong, where, what was expected, what was found, and the nearest
// valid choice where there is one.  This header depends on nothing; it is the only header of autodiff/ that
// dynamics/ may include.
#pragma once

#include <stdexcept>
#include <string>

namespace dyntape {

// Root of the family.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Something the caller passed has the wrong size, index, name or value.
struct ArgumentError : Error {
  using Error::Error;
};

// A file could not be read, or says something that cannot be: `file:line:column: ...`.
struct FileError : Error {
  using Error::Error;
};

// Recording was used in a way that cannot give a correct tape.
struct RecordingError : Error {
  using Error::Error;
};

// An evaluation left the branch that was recorded: the message names file and line of the comparison.
struct GuardViolation : Error {
  using Error::Error;
};

// An external tool (the compiler) failed: command, exit status, its messages, where the source is kept.
struct ToolError : Error {
  using Error::Error;
};

// A numerical procedure has no valid answer (zero inertia about a joint, a matrix that is not definite, ...).
struct NumericalError : Error {
  using Error::Error;
};

}  // namespace dyntape
