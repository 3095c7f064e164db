// SPDX-License-Identifier: BSD-3-Clause
//
// What may stand behind an option, where CLI11 would take more than is meant: 010 for 8, -1 for 2^64 - 1, "" for a path.
//
//   command->add_option("--states", options->states, "random states")->transform(whole_number(1, 100000));
//   add_path(*command, "--output", options->output, "results", "DIR");
//   add_choice(*command, "--base", options->base, "of the robot", {"fixed", "floating"})->capture_default_str();
#pragma once

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <dyntape/interface/io/number.h>

namespace dyntape::tools {

// Decimal digits, both bounds allowed.  For transform(): what CLI11 gets to read has no zeros in front.
template <class T>
CLI::Validator whole_number(T least, T most) {
  const std::string range = std::to_string(least) + " to " + std::to_string(most);
  const auto read = [=](std::string& word) -> std::string {
    const auto value = io::parse_number<T>(word);
    if (!value || *value < least || *value > most)
      return "expected a whole number of " + range + ", got '" + word + "'";
    word = std::to_string(*value);
    return {};
  };
  return CLI::Validator(read, range);
}

// Of random numbers.
inline CLI::Validator seed() {
  return whole_number<std::uint64_t>(0, std::numeric_limits<std::uint64_t>::max()).description("");
}

inline CLI::Validator positive_number() {
  const auto fault = [](std::string& word) -> std::string {
    const auto value = io::parse_double(word);
    if (value && *value > 0 && std::isfinite(*value)) return {};
    return "expected a finite number above zero, got '" + word + "'";
  };
  return CLI::Validator(fault, "above 0");
}

// A variable of the shell that is not set leaves such a word.
inline CLI::Validator not_empty() {
  return CLI::Validator(
      [](std::string& word) { return std::string(word.empty() ? "expected a name, got ''" : ""); }, "");
}

inline CLI::Option* add_path(CLI::App& command, const std::string& name, std::string& path,
                             const std::string& what, const std::string& type) {
  return command.add_option(name, path, what)->check(not_empty())->type_name(type);
}

// One of these words.
inline CLI::Option* add_choice(CLI::App& command, const std::string& name, std::string& word,
                               const std::string& what, const std::vector<std::string>& words) {
  return command.add_option(name, word, what)
      ->check(CLI::IsMember(words))
      ->type_name(CLI::detail::join(words, "|"));
}

}  // namespace dyntape::tools
