// SPDX-License-Identifier: BSD-3-Clause
//
// The one family of exceptions of the project.
//
//   try { ... } catch (const dyntape::Error& e) { std::cerr << e.what() << "\n"; }
//
// A message is one clear sentence: what is wrong, where, what was expected, what was found, and the nearest
// valid choice where there is one.  It quotes names and values as they were given, and stands on one line whatever
// they hold: what would break it becomes a blank.  This header depends on nothing and is everybody's.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace dyntape {

// Root of the family.
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

// An error of one sentence.
struct Sentence : Error {
  explicit Sentence(std::string sentence) : Error(one_line(std::move(sentence))) {}

 protected:
  explicit Sentence(const std::vector<std::string>& sentences) : Error(detail::a_line_each(sentences)) {}
};

// Something the caller passed has the wrong size, index, name or value.
struct ArgumentError : Sentence {
  using Sentence::Sentence;
};

// A file could not be read, or says something that cannot be: `file:line:column: ...`; several things, a line each.
struct FileError : Sentence {
  using Sentence::Sentence;
  explicit FileError(const std::vector<std::string>& sentences) : Sentence(sentences) {}
};

// Recording was used in a way that cannot give a correct tape.
struct RecordingError : Sentence {
  using Sentence::Sentence;
};

// An evaluation left the branch that was recorded: the message names file and line of the comparison.
struct GuardViolation : Sentence {
  using Sentence::Sentence;
};

// An external tool (the compiler) failed: command, exit status, its messages, where the source is kept.
struct ToolError : Error {
  using Error::Error;
};

// A numerical procedure has no valid answer (zero inertia about a joint, a matrix that is not definite, ...).
struct NumericalError : Sentence {
  using Sentence::Sentence;
};

}  // namespace dyntape
