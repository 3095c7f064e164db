// SPDX-License-Identifier: BSD-3-Clause
//
// Reads typed values from .info files.  Ask for each value; then finish() reports all errors of the file at once.
//
//   Section task = Section::parse(text, "swing_up.info");   // a misspelt key is an error
//   Section mesh = task.child("transcription");
//   const int    n = mesh.get<int>("intervals", at_least(1));
//   const double h = mesh.get_or("step", 0.05, positive());            // [s]
//   const Scheme s = mesh.choice_or<Scheme>("scheme", "trapezoid", {{"trapezoid", Scheme::kTrapezoid},
//                                                                   {"hermiteSimpson", Scheme::kHermiteSimpson}});
//   task.finish();                                         // throws if a value is wrong or a key was never asked for
//   for write_file_atomically("out/effective.info", task.effective_values());
//
//   swing_up.info:7:3: unknown key 'intervalls' in 'transcription'; did you mean 'intervals'?
//   swing_up.info:9:18: 'transcription.step' must be positive, got '-0.05'
//
// There is no separate schema: the calls define the keys.  If a value is wrong or missing, the call returns T() and
// records the problem; finish() reports all problems, one line each.  Do not use the values before finish() returns.
//
// Accepted values:
//
// - numbers as std::from_chars reads them, also with a leading '+'; unsigned integers have no sign
// - true, false, on, off, 1, 0 for bool
// - infinity only if the range says or_infinite; never NaN
// - a list of names as one quoted value ("a b", "a, b") or, as in OCS2, as a block { [0] a  [1] b }
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <dyntape/interface/files/info/info.h>
#include <dyntape/interface/files/info/places.h>
#include <dyntape/interface/files/info/question.h>
#include <dyntape/interface/files/info/renamed.h>
#include <dyntape/interface/files/info/settings.h>

namespace dyntape::io {

namespace detail {
struct SectionReading;  // shared by all sections of a file
struct SectionState;    // the state of one block
}  // namespace detail

class Section {
 public:
  // Parses a file.  `renamed`: old names of keys, which are accepted too (renamed.h).  `settings` override values of
  // the file (settings.h).
  static Section parse(std::string_view text, const std::string& file_name,
                       const std::vector<Renamed>& renamed = {}, const std::vector<Setting>& settings = {});
  const std::vector<Replacement>& replacements() const;

  // An empty file to list all keys that a reader knows: has() returns true and nothing is a problem.  Then
  // questions() has each key once, in the order of the calls.
  //
  //   Section file = Section::catalogue();
  //   read_all(file);
  //   for (const Question& q : file.questions()) ...
  static Section catalogue();
  const std::vector<Question>& questions() const;

  // Sets the meaning and unit of the next key: section.about("most time [s]").get_or("time", 1.0).
  Section& about(const std::string& meaning);

  // T: double, int, long, unsigned, unsigned long, bool, std::string.
  template <class T>
  T get(const std::string& key, const Range& range = {});
  template <class T>
  T get_or(const std::string& key, T fallback, const Range& range = {});
  std::string get_or(const std::string& key, const char* fallback) {
    return get_or<std::string>(key, fallback);
  }

  // One of a list of names, as an enum value.
  template <class E>
  E choice_or(const std::string& key, const std::string& fallback,
              const std::vector<std::pair<std::string, E>>& names) {
    std::vector<std::string> firsts;
    for (const auto& [name, value] : names) firsts.push_back(name);
    return names[choose(key, firsts, fallback)].second;
  }

  // A list of any length.  If `valid` is empty, every name is accepted.
  std::vector<std::string> strings_or(const std::string& key, const std::vector<std::string>& fallback,
                                      const std::vector<std::string>& valid = {});

  // Blocks.  If an optional block is absent, get_or returns the fallback, as for an empty block.
  Section child(const std::string& key);
  Section child_or_empty(const std::string& key);
  std::vector<Section> children(const std::string& key);  // all blocks of this name, which may be repeated
  std::vector<Section> each(const std::string& key);      // the same, or one empty block if there is none
  std::vector<Section> all_children();                    // all blocks of any name
  std::vector<std::string> keys() const;  // of this block in the file, in order; marks none as known

  std::string name() const;          // the key; "" for the file itself
  std::string path() const;          // "solver.lineSearch"
  std::string value();               // the value of a block: `cost quadratic { ... }` returns "quadratic"
  bool present() const;              // false for an optional block that is absent
  bool has(const std::string& key);  // true if the key is present; marks the key as known
  // Marks a key as known without reading it, because its dependency is missing.  A problem if absent without
  // fallback.
  void defer(const std::string& key, const std::string& takes, const char* fallback = nullptr);
  // Records a problem found by the caller, at the value of `key`.
  void problem(const std::string& key, const std::string& message);

  // Sets the value that effective_values() writes for `key`, e.g. a resolved path.
  void understood_as(const std::string& key, const std::string& value);

  // Paths of this file, of included files, and of files noted by readers, e.g. the robot's.
  void note_file(const std::string& path);
  const std::vector<std::string>& files() const;

  // Positions of the values of all keys of the file, of repeated keys the first.
  Places places() const;

  // Throws FileError with all problems of the file so far, and with the unread content of this block and the blocks
  // below: unknown keys, repeated keys, values or blocks without reader.
  void finish();

  // The keys read from this block and their values as .info text.  Comments mark default values.
  std::string effective_values() const;

  // Returns true if the file has a problem so far.
  bool has_problems() const;
  // Returns true if there is no problem so far and every entry of this block was read.
  bool sound() const;

 private:
  using Reading = detail::SectionReading;
  using State = detail::SectionState;
  Section(std::shared_ptr<Reading> reading, State* state) : reading_(std::move(reading)), state_(state) {}

  size_t choose(const std::string& key, const std::vector<std::string>& names, const std::string& fallback);
  const InfoNode* find(const std::string& key, bool required);
  const InfoNode* find_value(const std::string& key, bool required);
  std::vector<const InfoNode*> list_nodes(const std::string& key, const InfoNode& node);
  void note(const Where& where, std::string message);
  bool given(const std::string& key);  // has(), independent of catalogue()
  void ask(const std::string& key, const std::string& takes, const std::string* fallback);
  void check_unread();
  std::string unknown(const std::string& key) const;
  std::string hint(const std::string& key) const;
  std::string missing(const std::string& key) const;
  void forgive_missing(const std::string& key);
  static InfoNode effective(const State& state);
  static InfoNode effective_block(const State& block, const std::string& key);
  std::string full(const std::string& key) const;

  std::shared_ptr<Reading> reading_;
  State* state_;
};

}  // namespace dyntape::io
