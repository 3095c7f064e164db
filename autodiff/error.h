// SPDX-License-Identifier: BSD-3-Clause
//
// The exception types of dyntape.  Catch Error for all failures, or a derived type for one kind.
//
//   try { ... } catch (const dyntape::Error& e) { std::cerr << e.what() << "\n"; }
//
// A message says where the problem is, what is wrong, what was expected and what was found.  If a valid alternative
// is close, the message names the nearest one.  Names and values are quoted as given.  Control characters become
// blanks, so that a message is one line.  This header includes no other header of dyntape; every part may include
// this header.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace dyntape {

// The base class of all exceptions of dyntape.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline std::string one_line(std::string sentence) {
  for (char& c : sentence)
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = ' ';
  return sentence;
}

namespace detail {

inline std::string a_line_each(const std::vector<std::string>& sentences) {
  std::string text;
  for (const std::string& sentence : sentences) text += (text.empty() ? "" : "\n") + one_line(sentence);
  return text;
}

}  // namespace detail

// An error with a message of one line.
struct Sentence : Error {
  explicit Sentence(std::string sentence) : Error(one_line(std::move(sentence))) {}

 protected:
  explicit Sentence(const std::vector<std::string>& sentences) : Error(detail::a_line_each(sentences)) {}
};

// An argument has a wrong size, index, name or value.
struct ArgumentError : Sentence {
  using Sentence::Sentence;
};

// A file cannot be read or is invalid: `file:line:column: ...`, one line for each problem.
struct FileError : Sentence {
  using Sentence::Sentence;
  explicit FileError(const std::vector<std::string>& sentences) : Sentence(sentences) {}
};

// The recorded code cannot give a correct tape.
struct RecordingError : Sentence {
  using Sentence::Sentence;
};

// An evaluation took another branch than the recording.  The message names file and line of the comparison.
struct GuardViolation : Sentence {
  using Sentence::Sentence;
};

// An external tool (the compiler) failed.  The message has the command, exit status, output and the kept source.
struct ToolError : Error {
  using Error::Error;
};

// A numerical method has no valid result (zero inertia about a joint, a matrix that is not positive definite, ...).
struct NumericalError : Sentence {
  using Sentence::Sentence;
};

}  // namespace dyntape
