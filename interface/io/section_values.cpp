// SPDX-License-Identifier: BSD-3-Clause
//
// Single values: from a word to a T, strictly or as a stream would.
#include <cmath>
#include <locale>
#include <sstream>
#include <type_traits>

#include <dyntape/autodiff/suggest.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/section.h>
#include <dyntape/interface/io/section_state.h>

namespace dyntape::io {

using detail::answer_node;
using detail::convert;

namespace {

template <class T>
std::string expected() {
  if constexpr (std::is_same_v<T, std::string>) return "a word";
  if constexpr (std::is_same_v<T, bool>) return "true or false";
  if constexpr (std::is_same_v<T, double>) return "a number";
  if constexpr (std::is_unsigned_v<T>) return "a whole number without sign";
  return "a whole number";
}

// "a | b"
std::string one_of(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : " | ") + name;
  return text;
}

std::optional<bool> strict_bool(const std::string& word) {
  if (word == "true" || word == "on" || word == "1") return true;
  if (word == "false" || word == "off" || word == "0") return false;
  return std::nullopt;
}

template <class T>
std::optional<T> strict_value(const std::string& word) {
  if constexpr (std::is_same_v<T, std::string>) {
    return word;
  } else if constexpr (std::is_same_v<T, bool>) {
    return strict_bool(word);
  } else {
    return parse_number<T>(word);
  }
}

// What a stream extracts, provided that nothing but blanks is left.
template <class T>
std::optional<T> lenient_value(const std::string& word) {
  if constexpr (std::is_same_v<T, std::string>) {
    return word;
  } else {
    std::istringstream stream(word);
    stream.imbue(std::locale::classic());
    T value{};
    stream >> value;
    if constexpr (std::is_same_v<T, bool>) {
      if (stream.fail()) {
        stream.clear();
        stream >> std::boolalpha >> value;
      }
    }
    if (!stream.eof()) stream >> std::ws;
    if (stream.fail() || stream.get() != std::istringstream::traits_type::eof()) return std::nullopt;
    return value;
  }
}

std::string wrong_range(const Range& range, double value) {
  if (std::isnan(value) || (std::isinf(value) && !range.infinite)) return "must be finite";
  const bool low = range.low_open ? value > range.low : value >= range.low;
  const bool high = range.high_open ? value < range.high : value <= range.high;
  return low && high ? "" : "must be " + range.text;
}

template <class T>
std::string printed(const T& value) {
  if constexpr (std::is_same_v<T, std::string>) return value;
  if constexpr (std::is_same_v<T, bool>) return value ? "true" : "false";
  if constexpr (std::is_same_v<T, double>) return shortest(value);
  if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) return std::to_string(value);
}

Range bounded(double low, double high, std::string text) {
  return {low, high, false, false, false, std::move(text)};
}
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

Range positive() { return {0, kInfinity, true, false, false, "positive"}; }
Range not_negative() { return bounded(0, kInfinity, "zero or more"); }
Range at_least(double low) { return bounded(low, kInfinity, "at least " + shortest(low)); }
Range at_most(double high) { return bounded(-kInfinity, high, "at most " + shortest(high)); }
Range between(double low, double high) {
  return bounded(low, high, "between " + shortest(low) + " and " + shortest(high));
}
Range or_infinite(Range range) {
  range.infinite = true;
  if (!range.text.empty()) range.text += " or infinite";
  return range;
}

template <class T>
std::optional<T> detail::convert(const std::string& word, const Range& range, Mode mode, std::string& wrong) {
  const std::optional<T> value = mode == Mode::kStrict ? strict_value<T>(word) : lenient_value<T>(word);
  if (!value) {
    const bool beyond = std::is_same_v<T, double> && mode == Mode::kStrict && is_out_of_range(word);
    wrong = "expects " + expected<T>() + (beyond ? " in the range of a double" : "") + ", got '" + word + "'";
  } else if constexpr (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) {
    wrong = wrong_range(range, static_cast<double>(*value));
    if (!wrong.empty()) wrong += ", got '" + word + "'";
  }
  return wrong.empty() ? value : std::nullopt;
}

template <class T>
T Section::get(const std::string& key, const Range& range) {
  ask(key, expected<T>() + (range.text.empty() ? "" : ", " + range.text), nullptr);
  const InfoNode* node = find_value(key, true);
  if (!node) return T();
  std::string wrong;
  const std::optional<T> value = convert<T>(node->value, range, reading_->mode, wrong);
  if (!value) note(node->value_where, "'" + full(key) + "' " + wrong);
  if (value) state_->answer(answer_node(key, printed(*value), node));
  return value.value_or(T());
}

template <class T>
T Section::get_or(const std::string& key, T fallback, const Range& range) {
  const std::string text = printed(fallback);
  ask(key, expected<T>() + (range.text.empty() ? "" : ", " + range.text), &text);
  if (given(key)) return get<T>(key, range);
  state_->answer(answer_node(key, text, nullptr));
  return fallback;
}

size_t Section::choose(const std::string& key, const std::vector<std::string>& names,
                       const std::string* fallback) {
  ask(key, one_of(names), fallback);
  const InfoNode* node = !fallback || given(key) ? find_value(key, true) : nullptr;
  if (!node && !fallback) return 0;
  const std::string& wanted = node ? node->value : *fallback;
  for (size_t i = 0; i < names.size(); ++i) {
    if (names[i] != wanted) continue;
    state_->answer(answer_node(key, wanted, node));
    return i;
  }
  const Where place = node ? node->value_where : state_->where;
  note(place, "'" + full(key) + "' cannot be '" + wanted + "'" + suggestion(wanted, names));
  return 0;
}

#define DYNTAPE_INSTANTIATE(T)                                        \
  template T Section::get<T>(const std::string&, const Range&);       \
  template T Section::get_or<T>(const std::string&, T, const Range&); \
  template std::optional<T> detail::convert<T>(const std::string&, const Range&, Mode, std::string&)
DYNTAPE_INSTANTIATE(double);
DYNTAPE_INSTANTIATE(int);
DYNTAPE_INSTANTIATE(long);
DYNTAPE_INSTANTIATE(unsigned);
DYNTAPE_INSTANTIATE(unsigned long);
DYNTAPE_INSTANTIATE(bool);
DYNTAPE_INSTANTIATE(std::string);
#undef DYNTAPE_INSTANTIATE

}  // namespace dyntape::io
