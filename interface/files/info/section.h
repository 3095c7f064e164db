// SPDX-License-Identifier: BSD-3-Clause
//
// Typed values out of .info files: ask for what you need, then let finish() say what is wrong with the file.
//
//   Section task = Section::parse(text, "swing_up.info");   // a misspelt key is an error
//   Section mesh = task.child("transcription");
//   const int    n = mesh.get<int>("intervals", at_least(1));
//   const double h = mesh.get_or("step", 0.05, positive());            // [s]
//   const Scheme s = mesh.choice_or<Scheme>("scheme", "trapezoid", {{"trapezoid", Scheme::kTrapezoid},
//                                                                   {"hermiteSimpson", Scheme::kHermiteSimpson}});
//   task.finish();                                         // throws if anything is wrong, or was never asked
//   for write_file_atomically("out/effective.info", task.effective_values());
//
//   swing_up.info:7:3: unknown key 'intervalls' in 'transcription'; did you mean 'intervals'?
//   swing_up.info:9:18: 'transcription.step' must be positive, got '-0.05'
//
// No schema is written anywhere: the questions are the schema.  A question with a wrong or missing answer
// gives T() and is noted, so that finish() reports all problems at once, a line each.  Until finish() has
// returned, do not act upon the values.
//
// What is accepted.  Numbers as std::from_chars reads them, with a leading '+' allowed; whole numbers for integers, no
// sign for unsigned ones; true, false, on, off, 1, 0 for bool; infinity only where the range says or_infinite, NaN
// nowhere.  A list of names is one quoted value ("a b", "a, b") or, as OCS2 writes it, a block { [0] a  [1] b }.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <dyntape/interface/files/info/info.h>
#include <dyntape/interface/files/info/question.h>
#include <dyntape/interface/files/info/renamed.h>
#include <dyntape/interface/files/info/settings.h>

namespace dyntape::io {

namespace detail {
struct SectionReading;  // what all sections of a file share
struct SectionState;    // what is known of one block
}  // namespace detail

class Section {
 public:
  // Keys that had another name in the version before are read by it as well (renamed.h).  Settings stand in place of what the file
  // says (settings.h).
  static Section parse(std::string_view text, const std::string& file_name,
                       const std::vector<Renamed>& renamed = {}, const std::vector<Setting>& settings = {});
  const std::vector<Replacement>& replacements() const;

  // For the list of all keys: a file in which nothing stands, where has() says yes and nothing is a problem, so that a
  // reader asks all that it would ever ask; questions() are then in the order of asking, each once.
  //
  //   Section file = Section::catalogue();
  //   read_all(file);
  //   for (const Question& q : file.questions()) ...
  static Section catalogue();
  const std::vector<Question>& questions() const;

  // What the key means that is asked for next, with its unit: section.about("most time [s]").get_or("time", 1.0).
  Section& about(const std::string& meaning);

  // T: double, int, long, unsigned, unsigned long, bool, std::string.
  template <class T>
  T get(const std::string& key, const Range& range = {});
  template <class T>
  T get_or(const std::string& key, T fallback, const Range& range = {});
  std::string get_or(const std::string& key, const char* fallback) {
    return get_or<std::string>(key, fallback);
  }

  // One of a list of names.
  template <class E>
  E choice_or(const std::string& key, const std::string& fallback,
              const std::vector<std::pair<std::string, E>>& names) {
    std::vector<std::string> firsts;
    for (const auto& [name, value] : names) firsts.push_back(name);
    return names[choose(key, firsts, fallback)].second;
  }

  // A list of any length; `valid` empty takes any name.
  std::vector<std::string> strings_or(const std::string& key, const std::vector<std::string>& fallback,
                                      const std::vector<std::string>& valid = {});

  // Blocks.  An optional one that is absent answers get_or with the fallback, as if it were empty.
  Section child(const std::string& key);
  Section child_or_empty(const std::string& key);
  std::vector<Section> children(const std::string& key);  // every block of this name: repeating it is legal
  std::vector<Section> each(const std::string& key);      // these, or a first one where there is none
  std::vector<Section> all_children();                    // whatever the names

  std::string name() const;          // its key, "" for the file itself
  std::string path() const;          // "solver.lineSearch"
  std::string value();               // of a block that has one: `cost quadratic { ... }` gives "quadratic"
  bool present() const;              // false for an optional block that is absent
  bool has(const std::string& key);  // whether the key is there; it counts as known from now on
  // Known, but not read now, since what its value depends on is missing; a problem if it is absent without fallback.
  void defer(const std::string& key, const std::string& takes, const char* fallback = nullptr);
  // Notes a problem found by the caller, at the value of `key`.
  void problem(const std::string& key, const std::string& message);

  // The answer to `key`, as effective_values writes it: of a path, what it means elsewhere as well.
  void understood_as(const std::string& key, const std::string& value);

  // The paths of this file, of those that it includes and of those that its readers note, as the robot's.
  void note_file(const std::string& path);
  const std::vector<std::string>& files() const;

  // Reports everything noted in the file so far, and in this block and those below it every key that was not
  // asked for, is given twice, or has a value or block that nothing reads.  Throws FileError or
  // returns.
  void finish();

  // What was asked for in this block and what the answers were, as .info text; defaults are marked in a
  // comment.
  std::string effective_values() const;

  // Whether nothing was wrong so far, and all that stands in this block was asked for.
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
  bool given(const std::string& key);  // has(), whatever the list of keys wants
  void ask(const std::string& key, const std::string& takes, const std::string* fallback);
  void check_unread();
  std::string unknown(const std::string& key) const;
  std::string hint(const std::string& key) const;
  static InfoNode effective(const State& state);
  static InfoNode effective_block(const State& block, const std::string& key);
  std::string full(const std::string& key) const;

  std::shared_ptr<Reading> reading_;
  State* state_;
};

}  // namespace dyntape::io
