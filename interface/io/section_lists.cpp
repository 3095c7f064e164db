// SPDX-License-Identifier: BSD-3-Clause
//
// Vectors, lists of names and matrices: blocks whose keys are indices.
#include <algorithm>
#include <set>
#include <string_view>
#include <unordered_map>

#include <dyntape/autodiff/suggest.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/section.h>
#include <dyntape/interface/io/section_state.h>

namespace dyntape::io {

using detail::answer_node;
using detail::convert;

namespace {

std::string list_key(size_t i) { return "[" + std::to_string(i) + "]"; }
std::string entry_key(int i, int j) { return "(" + std::to_string(i) + "," + std::to_string(j) + ")"; }

// (i, j) of a key that entry_key could have written; empty for any other.
std::optional<std::pair<int, int>> entry_index(const std::string& key) {
  const size_t comma = key.find(',');
  if (key.size() < 5 || comma == std::string::npos) return std::nullopt;
  const auto i = parse_number<unsigned short>(std::string_view(key).substr(1, comma - 1));
  const auto j =
      parse_number<unsigned short>(std::string_view(key).substr(comma + 1, key.size() - comma - 2));
  if (!i || !j || key != entry_key(*i, *j)) return std::nullopt;
  return std::pair<int, int>(*i, *j);
}

bool uses_pairs(const InfoNode& node) {
  return std::any_of(node.children.begin(), node.children.end(),
                     [](const InfoNode& child) { return child.key.starts_with('('); });
}

// One more than the largest row index written.
int rows_of(const InfoNode& node) {
  int rows = 0;
  for (const InfoNode& child : node.children) {
    if (const auto index = entry_index(child.key)) rows = std::max(rows, index->first + 1);
  }
  return rows;
}

// The children by key, the first where several have one.
class ByKey {
 public:
  explicit ByKey(const InfoNode& node) {
    for (const InfoNode& child : node.children) first_.emplace(child.key, &child);
  }
  // Null: there is none.
  const InfoNode* operator[](const std::string& key) const {
    const auto found = first_.find(key);
    return found == first_.end() ? nullptr : found->second;
  }

 private:
  std::unordered_map<std::string_view, const InfoNode*> first_;
};

std::string joined(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : " ") + shortest(value);
  return text;
}

InfoNode block_answer(const std::string& key, const InfoNode* given) {
  InfoNode node = answer_node(key, "", given);
  node.has_value = false;
  node.has_block = true;
  return node;
}

InfoNode list_answer(const std::string& key, const std::vector<std::string>& names, const InfoNode* given) {
  InfoNode node = block_answer(key, given);
  for (size_t i = 0; i < names.size(); ++i) {
    node.children.push_back(answer_node(list_key(i), names[i], &node));
  }
  return node;
}

InfoNode matrix_answer(const std::string& key, const InfoMatrix& matrix, const InfoNode* given) {
  InfoNode node = block_answer(key, given);
  for (int i = 0; i < matrix.rows; ++i) {
    for (int j = 0; j < matrix.cols; ++j) {
      node.children.push_back(answer_node(entry_key(i, j), shortest(matrix(i, j)), &node));
    }
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

std::vector<double> Section::vector(const std::string& key, int size, const Range& range) {
  ask(key, size < 0 ? "numbers" : std::to_string(size) + " numbers", nullptr);
  const InfoNode* node = find(key, true);
  if (!node) return std::vector<double>(static_cast<size_t>(std::max(size, 0)));
  std::vector<double> values;
  if (!node->has_block && strict()) {
    values = list_in_one_value(key, *node, range);
  } else if (uses_pairs(*node)) {
    values = read_entries(key, *node, size >= 0 ? size : rows_of(*node), 1, range).values;
  } else {
    values = list_of_entries(key, *node, range);
  }
  const size_t given = values.size();
  if (size >= 0 && given != static_cast<size_t>(size)) {
    note(node->where,
         "'" + full(key) + "' expects " + std::to_string(size) + " numbers, got " + std::to_string(given));
    values.resize(static_cast<size_t>(size));
  }
  state_->answer(answer_node(key, joined(values), node));
  return values;
}

std::vector<double> Section::vector_or(const std::string& key, const std::vector<double>& fallback,
                                       const Range& range) {
  const std::string text = joined(fallback);
  ask(key, "numbers", &text);
  if (given(key)) return vector(key, -1, range);
  state_->answer(answer_node(key, text, nullptr));
  return fallback;
}

std::vector<double> Section::list_in_one_value(const std::string& key, const InfoNode& node,
                                               const Range& range) {
  std::vector<double> values;
  for (const std::string& word : split(node.value)) {
    std::string wrong;
    const std::optional<double> value = convert<double>(word, range, reading_->mode, wrong);
    if (!value) note(node.value_where, "'" + full(key) + "' " + wrong);
    values.push_back(value.value_or(0));
  }
  if (values.empty()) note(node.where, "'" + full(key) + "' has no value");
  return values;
}

// The nodes [0], [1], ... up to the first that is absent.
std::vector<const InfoNode*> Section::list_nodes(const std::string& key, const InfoNode& node) {
  const ByKey by_key(node);
  std::vector<const InfoNode*> nodes;
  while (const InfoNode* next = by_key[list_key(nodes.size())]) nodes.push_back(next);
  if (!strict()) return nodes;
  const std::set<const InfoNode*> taken(nodes.begin(), nodes.end());
  for (const InfoNode& child : node.children) {
    if (taken.count(&child)) continue;
    const bool duplicate = taken.count(by_key[child.key]) > 0;
    note(child.where, duplicate ? "duplicate entry '" + child.key + "' in '" + full(key) + "'"
                                : "'" + child.key + "' is out of place in the list '" + full(key) +
                                      "', whose next entry would be '" + list_key(nodes.size()) + "'");
  }
  return nodes;
}

std::vector<double> Section::list_of_entries(const std::string& key, const InfoNode& node,
                                             const Range& range) {
  std::vector<double> values;
  for (const InfoNode* entry : list_nodes(key, node)) {
    std::string wrong;
    const std::optional<double> value = convert<double>(entry->value, range, reading_->mode, wrong);
    if (!value && !strict()) return values;
    if (!value) note(entry->value_where, "'" + full(key) + "." + entry->key + "' " + wrong);
    values.push_back(value.value_or(0));
  }
  return values;
}

std::vector<std::string> Section::strings(const std::string& key, const std::vector<std::string>& valid) {
  ask(key, "names", nullptr);
  std::vector<std::string> names;
  const InfoNode* node = find(key, true);
  if (!node) return names;
  const auto take = [&](const std::string& name, const Where& where) {
    const bool known = valid.empty() || std::find(valid.begin(), valid.end(), name) != valid.end();
    if (!known)
      note(where, "'" + full(key) + "' names '" + name + "', which is unknown" + suggestion(name, valid));
    names.push_back(name);
  };
  if (!node->has_block && strict()) {
    for (const std::string& name : split(node->value)) take(name, node->value_where);
  } else {
    for (const InfoNode* entry : list_nodes(key, *node)) take(entry->value, entry->value_where);
  }
  state_->answer(list_answer(key, names, node));
  return names;
}

std::vector<std::string> Section::strings_or(const std::string& key, const std::vector<std::string>& fallback,
                                             const std::vector<std::string>& valid) {
  const std::string none;
  ask(key, "names", &none);
  if (given(key)) return strings(key, valid);
  state_->answer(list_answer(key, fallback, nullptr));
  return fallback;
}

InfoMatrix Section::matrix(const std::string& key, int rows, int cols) {
  ask(key, "a matrix", nullptr);
  const InfoNode* node = find(key, true);
  if (!node) return {rows, cols, std::vector<double>(static_cast<size_t>(rows * cols))};
  const InfoMatrix matrix = read_entries(key, *node, rows, cols, {});
  state_->answer(matrix_answer(key, matrix, node));
  return matrix;
}

double Section::factor(const std::string& key, const InfoNode& node, const std::string& which,
                       double fallback) {
  const InfoNode* given = node.child(which);
  if (!given) return fallback;
  std::string wrong;
  const std::optional<double> value = convert<double>(given->value, {}, reading_->mode, wrong);
  if (!value && strict()) note(given->value_where, "'" + full(key) + "." + which + "' " + wrong);
  return value.value_or(fallback);
}

InfoMatrix Section::read_entries(const std::string& key, const InfoNode& node, int rows, int cols,
                                 const Range& range) {
  const double scaling = factor(key, node, "scaling", 1), absent = factor(key, node, "default", 0);
  InfoMatrix matrix{rows, cols, std::vector<double>(static_cast<size_t>(rows * cols), scaling * absent)};
  const ByKey by_key(node);
  bool any = strict() && by_key["default"];
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < cols; ++j) {
      const InfoNode* entry = by_key[entry_key(i, j)];
      if (!entry) continue;
      std::string wrong;
      const std::optional<double> value = convert<double>(entry->value, range, reading_->mode, wrong);
      if (!value && strict()) note(entry->value_where, "'" + full(key) + "." + entry->key + "' " + wrong);
      any |= value.has_value() || strict();
      if (value) matrix.values[static_cast<size_t>(i * cols + j)] = scaling * *value;
    }
  }
  if (!any) note(node.where, "'" + full(key) + "' has no entry (row,column) that could be read");
  if (strict()) check_entries(key, node, rows, cols);
  return matrix;
}

void Section::check_entries(const std::string& key, const InfoNode& node, int rows, int cols) {
  const std::string size = std::to_string(rows) + " x " + std::to_string(cols);
  std::set<std::string> seen;
  for (const InfoNode& child : node.children) {
    const auto index = entry_index(child.key);
    if (!seen.insert(child.key).second) {
      note(child.where, "duplicate entry '" + child.key + "' in '" + full(key) + "'");
    } else if (index && (index->first >= rows || index->second >= cols)) {
      note(child.where, "entry '" + child.key + "' is outside of '" + full(key) + "', which is " + size);
    } else if (!index && child.key != "scaling" && child.key != "default") {
      note(child.where, "unknown key '" + child.key + "' in the matrix '" + full(key) +
                            "', which knows (row,column), scaling and default");
    }
  }
}

}  // namespace dyntape::io
