// SPDX-License-Identifier: BSD-3-Clause
//
// Options of a table (interface/control/nlp/solver_option_table.h) as keyword arguments: their values, and the signature and
// docstring that Python shows.
//
//   KeywordOptions given("solve", function, self, kwargs);
//   visit_options(options, given);
//   given.finish();                                  // TypeError for an argument that no table has
#pragma once

#include <set>
#include <string>

#include <nanobind/stl/string.h>

#include <dyntape/interface/io/choice.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/range.h>

#include "module.h"

namespace dyntape::python {

class KeywordOptions {
 public:
  // `function`: the bound function, whose signature words a wrong call; `self`: its first argument.
  KeywordOptions(std::string where, nb::object function, nb::object self, nb::kwargs given)
      : where_(std::move(where)),
        function_(std::move(function)),
        self_(std::move(self)),
        given_(std::move(given)) {}

  template <class T>
  void number(const char* name, T& value, const io::Range& range, const char*) {
    if (!take(name, value)) return;
    const std::string fault = range.fault(static_cast<double>(value));
    if (!fault.empty())
      throw ArgumentError(where_ + ": " + name + " " + fault + ", got " +
                          io::shortest(static_cast<double>(value)));
  }
  void flag(const char* name, bool& value, const char*) { take(name, value); }
  template <class E>
  void choice(const char* name, E& value, const io::Choice<E>& words, const char*) {
    std::string word;
    if (take(name, word)) value = io::chosen(where_ + ": " + name, word, words);
  }

  void finish() const {
    for (const auto& [name, value] : given_) {
      if (!known_.contains(nb::cast<std::string>(name))) refuse();
    }
  }

 private:
  template <class T>
  bool take(const char* name, T& value) {
    known_.insert(name);
    if (!given_.contains(name)) return false;
    if (!nb::try_cast<T>(given_[name], value)) refuse();
    return true;
  }

  [[noreturn]] void refuse() const {
    nb::list given;
    given.append(self_);
    const nb::object sentence =
        nb::module_::import_("dyntape._messages").attr("of_arguments")(function_, given, given_);
    throw nb::type_error(nb::cast<std::string>(sentence).c_str());
  }

  std::string where_;
  nb::object function_, self_;
  nb::kwargs given_;
  std::set<std::string> known_;
};

// ", tolerance: float = 1e-08, max_iterations: int = 3000" for the signature, and a line an option for the docstring.
struct KeywordTexts {
  std::string signature, lines;

  void number(const char* name, double& value, const io::Range& range, const char* meaning) {
    add(name, "float", io::shortest(value), meaning, range.text);
  }
  void number(const char* name, int& value, const io::Range& range, const char* meaning) {
    add(name, "int", std::to_string(value), meaning, range.text);
  }
  void flag(const char* name, bool& value, const char* meaning) {
    add(name, "bool", value ? "True" : "False", meaning, "");
  }
  template <class E>
  void choice(const char* name, E& value, const io::Choice<E>& words, const char* meaning) {
    add(name, "str", "'" + io::word_of(value, words) + "'", meaning, io::words_of(words));
  }

 private:
  void add(const std::string& name, const char* type, const std::string& fallback, const char* meaning,
           const std::string& values) {
    signature += ", " + name + ": " + type + " = " + fallback;
    lines += name + ": " + meaning + (values.empty() ? "" : "; " + values) + ".\n";
  }
};

}  // namespace dyntape::python
