// SPDX-License-Identifier: BSD-3-Clause
//
// Words that choose a value: of an option, the same in files, on the command line and in Python.
//
//   const Choice<Colour> colours = {{"red", Colour::kRed}, {"blue", Colour::kBlue}};
//   chosen("paint: colour", "green", colours)     // throws: paint: colour: expected "red" or "blue", got "green"
//   word_of(Colour::kRed, colours)                // "red"
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <dyntape/autodiff/error.h>

namespace dyntape::io {

template <class E>
using Choice = std::vector<std::pair<std::string, E>>;

template <class E>
std::string word_of(E value, const Choice<E>& choice) {
  for (const auto& [word, chosen] : choice) {
    if (chosen == value) return word;
  }
  return "";
}

// "red", "blue" or "green", in quotes.
template <class E>
std::string words_of(const Choice<E>& choice) {
  std::string text;
  for (std::size_t i = 0; i < choice.size(); ++i) {
    if (i > 0) text += i + 1 < choice.size() ? ", " : " or ";
    text += "\"" + choice[i].first + "\"";
  }
  return text;
}

// Throws ArgumentError for another word.
template <class E>
E chosen(const std::string& where, const std::string& word, const Choice<E>& choice) {
  for (const auto& [known, value] : choice) {
    if (known == word) return value;
  }
  throw ArgumentError(where + ": expected " + words_of(choice) + ", got \"" + word + "\"");
}

}  // namespace dyntape::io
