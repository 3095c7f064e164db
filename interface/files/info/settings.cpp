// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/info/settings.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include <dyntape/autodiff/error.h>

namespace dyntape::io {

namespace {

constexpr const char* kOption = "--set ";

struct PathStep {
  std::string key;
  std::size_t number;  // among those of this key
};

[[noreturn]] void refuse_option(const std::string& option) {
  throw ArgumentError(option +
                      ": expected a path of keys, '=' and a value, as in --set horizon.intervals=60");
}

// "mass", or "point[2]".
std::optional<PathStep> read_step(std::string key) {
  PathStep step{std::move(key), 0};
  if (const std::size_t bracket = step.key.find('['); bracket != std::string::npos) {
    const char *first = step.key.data() + bracket + 1, *last = step.key.data() + step.key.size();
    const auto read = std::from_chars(first, last, step.number);
    if (read.ec != std::errc() || read.ptr + 1 != last || *read.ptr != ']') return {};
    step.key.resize(bracket);
  }
  if (step.key.empty()) return {};
  return step;
}

// What messages name.
std::string option_of(const Setting& setting) {
  return setting.option.empty() ? kOption + setting.path : setting.option;
}

std::vector<PathStep> steps_of(const Setting& setting) {
  std::vector<PathStep> steps;
  const std::string& path = setting.path;
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t end = std::min(path.find('.', begin), path.size());
    std::optional<PathStep> step = read_step(path.substr(begin, end - begin));
    if (!step) refuse_option(option_of(setting) + "=" + setting.value);
    steps.push_back(std::move(*step));
    begin = end + 1;
  }
  return steps;
}

// The block's entry of this key and number, made where there is none.
InfoNode& entry_of(InfoNode& block, const PathStep& step, const Where& where) {
  std::size_t number = 0;
  for (InfoNode& node : block.children) {
    if (node.key == step.key && number++ == step.number) return node;
  }
  if (step.number > number)
    throw ArgumentError(*where.file + ": '" + step.key + "[" + std::to_string(step.number) +
                        "]' counts from 0 what has this name, and there are " + std::to_string(number) +
                        "; expected at most '" + step.key + "[" + std::to_string(number) + "]'");
  InfoNode made;
  made.key = step.key;
  made.where = made.value_where = where;
  block.has_block = true;
  block.children.push_back(std::move(made));
  return block.children.back();
}

// Keys on the way and the value by their names of today.
void rename(std::vector<PathStep>& steps, std::string& value, const Where& where,
            const std::vector<Renamed>& renamed, std::vector<Replacement>& replacements) {
  InfoNode alone;
  InfoNode* node = &alone;
  for (const PathStep& step : steps) node = &entry_of(*node, {step.key, 0}, where);
  node->value = value;
  const std::vector<Replacement> found = replace_old_names(alone, renamed);
  replacements.insert(replacements.end(), found.begin(), found.end());
  node = &alone;
  for (PathStep& step : steps) node = &node->children[0], step.key = node->key;
  value = node->value;
}

}  // namespace

std::vector<Setting> settings_of(const std::vector<std::string>& options) {
  std::vector<Setting> settings;
  for (const std::string& option : options) {
    const std::size_t equals = option.find('=');
    if (equals == std::string::npos || equals == 0) refuse_option(kOption + option);
    settings.push_back({option.substr(0, equals), option.substr(equals + 1)});
    steps_of(settings.back());
  }
  return settings;
}

std::vector<Replacement> apply(const std::vector<Setting>& settings, InfoNode& root,
                               const std::vector<Renamed>& renamed) {
  std::vector<Replacement> replacements;
  for (const Setting& setting : settings) {
    const Where where{std::make_shared<const std::string>(option_of(setting)), 0, 0};
    std::vector<PathStep> steps = steps_of(setting);
    std::string value = setting.value;
    rename(steps, value, where, renamed, replacements);
    InfoNode* block = &root;
    for (std::size_t k = 0; k + 1 < steps.size(); ++k) block = &entry_of(*block, steps[k], where);
    InfoNode& node = entry_of(*block, steps.back(), where);
    if (value.empty()) {
      block->children.erase(block->children.begin() + (&node - block->children.data()));
      continue;
    }
    node.value = value, node.has_value = true, node.value_where = where;
  }
  return replacements;
}

}  // namespace dyntape::io
