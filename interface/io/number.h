// SPDX-License-Identifier: BSD-3-Clause
//
// Converts numbers to text and back, independent of the locale.
//
//   shortest(0.1)                 // "0.1": the fewest digits that read back to the same bits
//   parse_double("1e-3")          // 0.001;   parse_double("1e-3x") is empty
//   with_digits(1. / 3, 4)        // "0.3333"
//   is_out_of_range("1e400")      // true: a number beyond the range of double
//
// parse_double accepts "inf" and "nan"; the caller decides whether they are valid.
#pragma once

#include <charconv>
#include <optional>
#include <string>
#include <string_view>

namespace dyntape::io {

// Parses the whole of `text` as a T (double, float or an integer), also with a leading '+'.  result_out_of_range if
// the number is outside the range of T, invalid_argument for any other text.
template <class T>
std::errc read_number(std::string_view text, T& value) {
  if (text.starts_with('+') && text.size() > 1 && text[1] != '-') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return end == text.data() + text.size() && !text.empty() ? error : std::errc::invalid_argument;
}

template <class T>
std::optional<T> parse_number(std::string_view text) {
  T value{};
  return read_number(text, value) == std::errc() ? std::optional<T>(value) : std::nullopt;
}

inline std::optional<double> parse_double(std::string_view text) { return parse_number<double>(text); }

inline bool is_out_of_range(std::string_view text) {
  double value = 0;
  return read_number(text, value) == std::errc::result_out_of_range;
}

inline std::string shortest(double value) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

// At most so many digits, none of them zeros at the end: "0.25", "1.234e-05".
inline std::string with_digits(double value, int digits) {
  char buffer[40];
  return {buffer,
          std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, digits).ptr};
}

}  // namespace dyntape::io
