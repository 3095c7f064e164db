// SPDX-License-Identifier: BSD-3-Clause
//
// Numbers to text and back, the same in every locale.
//
//   shortest(0.1)                 // "0.1": the fewest digits that read back to the same bits
//   parse_double("1e-3")          // 0.001;   parse_double("1e-3x") is empty
//
// Not empty for "inf" and "nan": whether those make sense is for the caller to say.
#pragma once

#include <charconv>
#include <optional>
#include <string>
#include <string_view>

namespace dyntape::io {

// The whole of `text` as a T (double, float or an integer), a leading '+' allowed; empty if it is anything
// else or does not fit.
template <class T>
std::optional<T> parse_number(std::string_view text) {
  if (text.starts_with('+') && text.size() > 1 && text[1] != '-') text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return value;
}

inline std::optional<double> parse_double(std::string_view text) { return parse_number<double>(text); }

inline std::string shortest(double value) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

}  // namespace dyntape::io
