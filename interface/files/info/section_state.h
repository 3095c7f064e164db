// SPDX-License-Identifier: BSD-3-Clause
//
// The state of a Section (private to section*.cpp).
#pragma once

#include <list>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>
#include <unordered_set>

#include <dyntape/interface/files/info/info.h>
#include <dyntape/interface/files/info/question.h>
#include <dyntape/interface/files/info/renamed.h>

namespace dyntape::io::detail {

// A question and its answer, in the order asked.
struct Answer {
  InfoNode written;       // key, value and comment as effective_values prints them
  bool is_block = false;  // the next of SectionState::blocks
};

struct SectionState {
  const InfoNode* node;  // null: an optional block that is absent
  std::string path;
  Where where;
  std::vector<std::string> asked = {};
  std::unordered_set<std::string> known = {};  // the same
  std::set<std::string> repeatable = {};
  bool all_asked = false;    // all_children returned every child
  bool value_read = false;   // the block's own value was read
  bool is_missing = false;   // a required block that is absent: its keys are not missing as well
  std::string meaning = {};  // of the next key
  std::vector<Answer> answers = {};
  std::unordered_map<std::string, std::size_t> places = {};  // of the answers that are no blocks, by key
  std::list<SectionState> blocks = {};                       // a list, since Sections point into it
  std::map<std::pair<const InfoNode*, std::string>, SectionState*> found =
      {};  // by node, or by path if it is absent

  void remember(const std::string& key) {
    if (known.insert(key).second) asked.push_back(key);
  }

  // The answer is kept once however often the question is asked.
  void answer(InfoNode written) {
    const auto [place, is_new] = places.emplace(written.key, answers.size());
    if (is_new) answers.emplace_back();
    answers[place->second].written = std::move(written);
  }

  SectionState* block_of(const InfoNode* wanted, const std::string& key) {
    SectionState*& block = found[{wanted, wanted ? "" : path_of(key)}];
    if (block) return block;
    const Where place = wanted ? wanted->where : where;
    blocks.push_back({wanted, path_of(key), place});
    answers.emplace_back();
    answers.back().written.key = key;
    answers.back().is_block = true;
    return block = &blocks.back();
  }

  std::string path_of(const std::string& key) const { return path.empty() ? key : path + '.' + key; }
};

struct SectionReading {
  InfoNode root;
  std::vector<Problem> problems;
  std::vector<std::string> files;
  std::set<std::string> noted;                                           // by sections
  std::list<SectionState> top;                                           // one element
  std::unordered_map<std::string, std::set<std::string>> asked_in = {};  // paths of blocks, by keys asked for
  bool is_catalogue = false;
  std::vector<Question> questions = {};
  std::vector<Replacement> replacements = {};

  Question& question(const std::string& path) {
    for (Question& q : questions)
      if (q.path == path) return q;
    questions.push_back({path, "", "", true, ""});
    return questions.back();
  }

  void find_asked() {
    asked_in.clear();
    std::vector<const SectionState*> open = {&top.front()};
    while (!open.empty()) {
      const SectionState* state = open.back();
      open.pop_back();
      for (const std::string& key : state->asked) asked_in[key].insert(state->path);
      for (const SectionState& block : state->blocks) open.push_back(&block);
    }
  }
};

// The value of a word, or empty with `wrong` saying why.
template <class T>
std::optional<T> convert(const std::string& word, const Range& range, std::string& wrong);

// "default" where `given` is null.
InfoNode answer_node(const std::string& key, std::string value, const InfoNode* given);

}  // namespace dyntape::io::detail
