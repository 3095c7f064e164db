// SPDX-License-Identifier: BSD-3-Clause
//
// Single values, from a word to a T, and lists of names.
#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>
#include <type_traits>
#include <unordered_map>

#include <dyntape/autodiff/suggest.h>
#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/info/section_state.h>
#include <dyntape/interface/files/info/synonyms.h>
#include <dyntape/interface/io/number.h>

namespace dyntape::io {

using detail::answer_node;
using detail::convert;

namespace {

template <class T>
std::string expected() {
  if constexpr (std::is_same_v<T, std::string>) return "text";
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

std::optional<bool> parse_bool(const std::string& word) {
  if (word == "true" || word == "on" || word == "1") return true;
  if (word == "false" || word == "off" || word == "0") return false;
  return std::nullopt;
}

template <class T>
std::optional<T> value_of(const std::string& word) {
  if constexpr (std::is_same_v<T, std::string>) {
    return word;
  } else if constexpr (std::is_same_v<T, bool>) {
    return parse_bool(word);
  } else {
    return parse_number<T>(word);
  }
}

template <class T>
std::string printed(const T& value) {
  if constexpr (std::is_same_v<T, std::string>) return value;
  if constexpr (std::is_same_v<T, bool>) return value ? "true" : "false";
  if constexpr (std::is_same_v<T, double>) return shortest(value);
  if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) return std::to_string(value);
}

std::string list_key(size_t i) { return "[" + std::to_string(i) + "]"; }

// As a block { [0] a  [1] b }.
InfoNode list_answer(const std::string& key, const std::vector<std::string>& names, const InfoNode* given) {
  InfoNode node = answer_node(key, "", given);
  node.has_value = false;
  node.has_block = true;
  for (size_t i = 0; i < names.size(); ++i) {
    node.children.push_back(answer_node(list_key(i), names[i], &node));
  }
  return node;
}

// Words between blanks or commas.
std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> words(1);
  for (const char c : text) {
    if (c != ' ' && c != '\t' && c != ',') {
      words.back() += c;
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

}  // namespace

template <class T>
std::optional<T> detail::convert(const std::string& word, const Range& range, std::string& wrong) {
  const std::optional<T> value = value_of<T>(word);
  if (!value) {
    const bool beyond = std::is_same_v<T, double> && is_out_of_range(word);
    wrong = "expects " + expected<T>() + (beyond ? " in the range of a double" : "") + ", got '" + word + "'";
  } else if constexpr (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) {
    wrong = range.fault(static_cast<double>(*value));
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
  const std::optional<T> value = convert<T>(node->value, range, wrong);
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
                       const std::string& fallback) {
  ask(key, one_of(names), &fallback);
  const InfoNode* node = given(key) ? find_value(key, true) : nullptr;
  const std::string& wanted = node ? node->value : fallback;
  for (size_t i = 0; i < names.size(); ++i) {
    if (names[i] != wanted) continue;
    state_->answer(answer_node(key, wanted, node));
    return i;
  }
  const Where place = node ? node->value_where : state_->where;
  const std::string meant = synonym_of(wanted, names);
  note(place, "'" + full(key) + "' cannot be '" + wanted + "'" +
                  (meant.empty() ? suggestion(wanted, names) : "; did you mean '" + meant + "'?"));
  return 0;
}

// The nodes [0], [1], ... up to the first that is absent.
std::vector<const InfoNode*> Section::list_nodes(const std::string& key, const InfoNode& node) {
  std::unordered_map<std::string_view, const InfoNode*> first;  // where several have one key
  for (const InfoNode& child : node.children) first.emplace(child.key, &child);
  std::vector<const InfoNode*> nodes;
  for (auto next = first.find("[0]"); next != first.end(); next = first.find(list_key(nodes.size())))
    nodes.push_back(next->second);
  const std::set<const InfoNode*> taken(nodes.begin(), nodes.end());
  for (const InfoNode& child : node.children) {
    if (taken.count(&child)) continue;
    const bool duplicate = taken.count(first[child.key]) > 0;
    note(child.where, duplicate ? "duplicate entry '" + child.key + "' in '" + full(key) + "'"
                                : "'" + child.key + "' is out of place in the list '" + full(key) +
                                      "', whose next entry would be '" + list_key(nodes.size()) + "'");
  }
  return nodes;
}

std::vector<std::string> Section::strings_or(const std::string& key, const std::vector<std::string>& fallback,
                                             const std::vector<std::string>& valid) {
  const std::string none;
  ask(key, "names", &none);
  const InfoNode* node = given(key) ? find(key, true) : nullptr;
  if (!node) {
    state_->answer(list_answer(key, fallback, nullptr));
    return fallback;
  }
  std::vector<std::string> names;
  const auto take = [&](const std::string& name, const Where& where) {
    const bool known = valid.empty() || std::find(valid.begin(), valid.end(), name) != valid.end();
    if (!known)
      note(where, "'" + full(key) + "' names '" + name + "', which is unknown" + suggestion(name, valid));
    names.push_back(name);
  };
  if (!node->has_block) {
    for (const std::string& name : split(node->value)) take(name, node->value_where);
  } else {
    for (const InfoNode* entry : list_nodes(key, *node)) take(entry->value, entry->value_where);
  }
  state_->answer(list_answer(key, names, node));
  return names;
}

#define DYNTAPE_INSTANTIATE(T)                                        \
  template T Section::get<T>(const std::string&, const Range&);       \
  template T Section::get_or<T>(const std::string&, T, const Range&); \
  template std::optional<T> detail::convert<T>(const std::string&, const Range&, std::string&)
DYNTAPE_INSTANTIATE(double);
DYNTAPE_INSTANTIATE(int);
DYNTAPE_INSTANTIATE(long);
DYNTAPE_INSTANTIATE(unsigned);
DYNTAPE_INSTANTIATE(unsigned long);
DYNTAPE_INSTANTIATE(bool);
DYNTAPE_INSTANTIATE(std::string);
#undef DYNTAPE_INSTANTIATE

}  // namespace dyntape::io
