// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/info/section.h>

#include <algorithm>
#include <map>
#include <utility>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/suggest.h>
#include <dyntape/interface/files/info/section_state.h>
#include <dyntape/interface/files/info/synonyms.h>

namespace dyntape::io {

using detail::Answer;
using detail::answer_node;

namespace {

// The mistake behind OCS2's `barrierReductionCostTol `: no file can answer such a question.
void check_question(const std::string& key) {
  if (key.empty() || key.front() == ' ' || key.back() == ' ')
    throw ArgumentError("section: the key '" + key + "' asked for is empty or begins or ends with a blank");
}

// Numbers of more than 60 characters by their first 20.
std::string with_short_numbers(const std::string& message) {
  constexpr std::size_t kMost = 60, kShown = 20;
  std::string text;
  for (std::size_t at = 0; at < message.size();) {
    const std::size_t end = std::min(message.find_first_not_of("0123456789.+-eE", at), message.size());
    if (end - at > kMost)
      text += message.substr(at, kShown) + "... (" + std::to_string(end - at) + " characters)";
    else
      text += message.substr(at, end - at);
    at = end;
    if (at < message.size()) text += message[at++];
  }
  return text;
}

std::string no_block(const std::string& path) { return "'" + path + "' is a block; '{' was expected"; }

}  // namespace

InfoNode detail::answer_node(const std::string& key, std::string value, const InfoNode* given) {
  InfoNode node;
  node.key = key;
  node.value = std::move(value);
  node.has_value = true;
  if (!given) node.comment = "default";
  return node;
}

Section Section::parse(std::string_view text, const std::string& file_name,
                       const std::vector<Renamed>& renamed, const std::vector<Setting>& settings) {
  InfoScan scan = scan_info(text, file_name);
  std::vector<Replacement> replacements = replace_old_names(scan.root, renamed);
  const std::vector<Replacement> of_settings = apply(settings, scan.root, renamed);
  replacements.insert(replacements.end(), of_settings.begin(), of_settings.end());
  std::vector<std::string> files = {file_name};
  files.insert(files.end(), scan.included.begin(), scan.included.end());
  auto reading = std::make_shared<Reading>(
      Reading{std::move(scan.root), std::move(scan.problems), std::move(files), {}, {}});
  reading->replacements = std::move(replacements);
  reading->top.push_back({&reading->root, "", reading->root.where});
  State* top = &reading->top.front();
  return Section(std::move(reading), top);
}

Section Section::catalogue() {
  Section section = parse("", "");
  section.reading_->is_catalogue = true;
  return section;
}

const std::vector<Replacement>& Section::replacements() const { return reading_->replacements; }

const std::vector<Question>& Section::questions() const { return reading_->questions; }

Section& Section::about(const std::string& meaning) {
  state_->meaning = meaning;
  return *this;
}

// Asked first, the question decides; what it takes may become known later.
void Section::ask(const std::string& key, const std::string& takes, const std::string* fallback) {
  if (!reading_->is_catalogue) return;
  given(key);
  Question& question = reading_->question(full(key));
  if (question.takes.empty()) question.takes = takes;
  if (!fallback) return;
  question.is_required = false;
  if (question.fallback.empty()) question.fallback = *fallback;
}

bool Section::present() const { return state_->node != nullptr; }
std::string Section::name() const { return state_->node ? state_->node->key : ""; }
std::string Section::path() const { return state_->path; }
std::string Section::full(const std::string& key) const { return state_->path_of(key); }

void Section::note(const Where& where, std::string message) {
  message = with_short_numbers(message);
  const bool is_new = reading_->noted.insert(to_string(where) + ": " + message).second;
  if (is_new)
    reading_->problems.push_back({where, std::move(message)});  // a question asked twice is one problem
}

void Section::problem(const std::string& key, const std::string& message) {
  const InfoNode* node = state_->node ? state_->node->child(key) : nullptr;
  note(node ? node->value_where : state_->where, message);
}

bool Section::given(const std::string& key) {
  check_question(key);
  state_->remember(key);
  if (reading_->is_catalogue && !state_->meaning.empty())
    reading_->question(full(key)).meaning = std::exchange(state_->meaning, {});
  return state_->node && state_->node->child(key);
}

bool Section::has(const std::string& key) {
  const bool is_there = given(key);
  if (reading_->is_catalogue) reading_->question(full(key)).is_required = false;
  return is_there || reading_->is_catalogue;
}

void Section::defer(const std::string& key, const std::string& takes, const char* fallback) {
  const std::string otherwise = fallback ? fallback : "";
  ask(key, takes, fallback ? &otherwise : nullptr);
  find(key, !fallback);
}

const InfoNode* Section::find(const std::string& key, bool required) {
  if (given(key)) return state_->node->child(key);
  if (required && !state_->is_missing) note(state_->where, missing(key));
  return nullptr;
}

std::string Section::missing(const std::string& key) const {
  return "required key '" + full(key) + "' is missing";
}

const InfoNode* Section::find_value(const std::string& key, bool required) {
  const InfoNode* node = find(key, required);
  if (!node) return nullptr;
  if (node->has_block) note(node->where, "'" + full(key) + "' is a value, but a block was written");
  if (!node->has_block && !node->has_value) note(node->where, "'" + full(key) + "' has no value");
  return node->has_block || !node->has_value ? nullptr : node;
}

std::string Section::value() {
  state_->value_read = true;
  return state_->node ? state_->node->value : "";
}

Section Section::child(const std::string& key) {
  ask(key, "a block", nullptr);
  const InfoNode* node = find(key, true);
  if (node && !node->has_block) note(node->where, no_block(full(key)));
  State* const block = state_->block_of(node, key);
  block->is_missing = !node || !node->has_block;
  return Section(reading_, block);
}

Section Section::child_or_empty(const std::string& key) {
  const std::string absent;
  ask(key, "a block", &absent);
  return given(key) ? child(key) : Section(reading_, state_->block_of(nullptr, key));
}

std::vector<Section> Section::children(const std::string& key) {
  std::vector<Section> sections;
  if (!given(key)) return sections;
  state_->repeatable.insert(key);
  for (const InfoNode& node : state_->node->children) {
    if (node.key == key) sections.push_back(Section(reading_, state_->block_of(&node, key)));
  }
  return sections;
}

std::vector<Section> Section::each(const std::string& key) {
  std::vector<Section> sections = children(key);
  if (sections.empty()) sections.push_back(child(key));
  return sections;
}

std::vector<Section> Section::all_children() {
  std::vector<Section> sections;
  if (!state_->node) return sections;
  for (const InfoNode& node : state_->node->children) {
    state_->remember(node.key);
    sections.push_back(Section(reading_, state_->block_of(&node, node.key)));
  }
  return sections;
}

std::vector<std::string> Section::keys() const {
  std::vector<std::string> keys;
  if (!state_->node) return keys;
  for (const InfoNode& node : state_->node->children) keys.push_back(node.key);
  return keys;
}

bool Section::has_problems() const { return !reading_->problems.empty(); }

bool Section::sound() const {
  if (!reading_->problems.empty()) return false;
  std::set<std::string> met;
  for (const InfoNode& child : state_->node ? state_->node->children : std::vector<InfoNode>{}) {
    const bool is_again = !met.insert(child.key).second && !state_->repeatable.count(child.key);
    if (is_again || !state_->known.count(child.key)) return false;
  }
  return true;
}

void Section::finish() {
  if (reading_->is_catalogue) return;
  reading_->find_asked();
  check_unread();
  throw_if_any(reading_->problems);
}

namespace {

// "; its keys are 'duration', 'intervals', ..."
std::string its_keys(const std::vector<std::string>& keys) {
  constexpr std::size_t kShown = 6;
  std::string text;
  for (std::size_t k = 0; k < std::min(keys.size(), kShown); ++k)
    text += (k ? ", '" : "; its keys are '") + keys[k] + "'";
  return text + (keys.size() > kShown ? ", ..." : "");
}

// "in 'horizon' or in 'mpc'": where else the key was asked for; empty of none and of many.
std::string other_blocks(const detail::SectionReading& reading, const std::string& here,
                         const std::string& key) {
  constexpr std::size_t kMost = 2;
  const auto found = reading.asked_in.find(key);
  std::set<std::string> paths = found == reading.asked_in.end() ? std::set<std::string>() : found->second;
  paths.erase(here);  // asked for in another block of this name
  if (paths.size() > kMost) return "";
  std::string text;
  for (const std::string& path : paths)
    text += (text.empty() ? "" : " or ") + (path.empty() ? "outside all blocks" : "in '" + path + "'");
  return text;
}

}  // namespace

void Section::check_unread() {
  if (!state_->node) return;
  const bool stray = state_->node->has_value && !state_->value_read;
  if (stray && !state_->node->has_block) {  // the value takes the place of the block: one problem
    std::erase_if(reading_->problems, [&](const Problem& p) { return p.message == no_block(path()); });
  }
  if (stray)
    note(state_->node->value_where, "'" + path() + "' is a block, which takes no value '" +
                                        state_->node->value + "'" + its_keys(state_->asked));
  std::map<std::string, Where> first;
  for (const InfoNode& child : state_->node->children) {
    const auto [place, is_first] = first.emplace(child.key, child.where);
    if (!state_->known.count(child.key)) {
      if (is_first) note(child.where, unknown(child.key));
      forgive_missing(child.key);
    } else if (!is_first && !state_->repeatable.count(child.key)) {
      note(child.where,
           "duplicate key '" + full(child.key) + "'; it is given first at " + to_string(place->second));
    }
  }
  for (State& block : state_->blocks) Section(reading_, &block).check_unread();
}

// A required key that is misspelt is one problem: its place says what is wrong.
void Section::forgive_missing(const std::string& misspelt) {
  const std::string synonym = synonym_of(misspelt, state_->asked);
  const std::string meant = synonym.empty() ? nearest_name(misspelt, state_->asked) : synonym;
  if (meant.empty()) return;
  std::erase_if(reading_->problems, [&](const Problem& p) { return p.message == missing(meant); });
}

std::string Section::unknown(const std::string& key) const {
  const std::string place = state_->path.empty() ? "" : " in '" + state_->path + "'";
  return "unknown key '" + key + "'" + place + hint(key);
}

// What other tools call a key of this block; the nearest key that was asked for here; failing that, up to two other blocks where
// this very key was asked for, or a key here that ends in it (joint_damping for damping).
std::string Section::hint(const std::string& key) const {
  if (const std::string meant = synonym_of(key, state_->asked); !meant.empty())
    return "; did you mean '" + meant + "'?";
  if (nearest_name(key, state_->asked).empty()) {
    const std::string blocks = other_blocks(*reading_, state_->path, key);
    if (!blocks.empty()) return "; it belongs " + blocks;
    for (const std::string& asked : state_->asked)
      if (asked.ends_with("_" + key)) return "; did you mean '" + asked + "'?";
  }
  return suggestion(key, state_->asked);
}

void Section::note_file(const std::string& path) { reading_->files.push_back(path); }

const std::vector<std::string>& Section::files() const { return reading_->files; }

Places Section::places() const {
  Places places;
  const auto add = [&](const auto& self, const InfoNode& block, const std::string& path) -> void {
    for (const InfoNode& node : block.children) {
      places.of_keys.emplace(path + node.key, to_string(node.value_where));
      self(self, node, path + node.key + ".");
    }
  };
  add(add, reading_->root, "");
  return places;
}

void Section::understood_as(const std::string& key, const std::string& value) {
  const auto place = state_->places.find(key);
  if (place != state_->places.end()) state_->answers[place->second].written.value = value;
}

std::string Section::effective_values() const { return write_info(effective(*state_)); }

InfoNode Section::effective_block(const State& block, const std::string& key) {
  InfoNode node = effective(block);
  node.key = key;
  node.has_block = !block.node || block.node->has_block;
  if (block.value_read && block.node && block.node->has_value) {
    node.value = block.node->value;
    node.has_value = true;
  }
  if (!block.node) node.comment = "absent: defaults";
  return node;
}

InfoNode Section::effective(const State& state) {
  InfoNode node;
  auto next = state.blocks.begin();
  for (const Answer& answer : state.answers) {
    node.children.push_back(answer.is_block ? effective_block(*next++, answer.written.key) : answer.written);
  }
  return node;
}

}  // namespace dyntape::io
