// SPDX-License-Identifier: BSD-3-Clause
//
// What a Section remembers (private to section*.cpp).
#pragma once

#include <list>
#include <optional>
#include <set>

#include <dyntape/interface/io/section.h>

namespace dyntape::io {

// A question and its answer, in the order asked.
struct Answer {
  InfoNode written;  // key, value and comment as effective_values prints them
  int block = -1;    // index into State::blocks if the answer is a block
};

struct Section::State {
  const InfoNode* node;  // null: an optional block that is absent
  std::string path;
  Where where;
  std::vector<std::string> asked = {};
  std::set<std::string> repeatable = {};
  bool all_asked = false;   // every child was handed out by all_children
  bool value_read = false;  // the block's own value was asked for
  std::vector<Answer> answers = {};
  std::list<State> blocks = {};  // a list, since Sections point into it

  void remember(const std::string& key) {
    for (const std::string& known : asked) {
      if (known == key) return;
    }
    asked.push_back(key);
  }

  // The answer is kept once however often the question is asked.
  void answer(InfoNode written) {
    for (Answer& known : answers) {
      if (known.block < 0 && known.written.key == written.key) {
        known.written = std::move(written);
        return;
      }
    }
    answers.push_back({std::move(written), -1});
  }

  State* block_of(const InfoNode* wanted, const std::string& key) {
    for (State& block : blocks) {
      if (wanted ? block.node == wanted : !block.node && block.path == path_of(key)) return &block;
    }
    const Where place = wanted ? wanted->where : where;
    blocks.push_back({wanted, path_of(key), place});
    InfoNode written;
    written.key = key;
    answers.push_back({written, static_cast<int>(blocks.size()) - 1});
    return &blocks.back();
  }

  std::string path_of(const std::string& key) const { return path.empty() ? key : path + '.' + key; }
};

struct Section::Reading {
  InfoNode root;
  Mode mode;
  std::vector<Problem> problems;
  std::list<State> top;  // one element
};

// The value of a word, or empty with `wrong` saying why.
template <class T>
std::optional<T> convert(const std::string& word, const Range& range, Mode mode, std::string& wrong);

// "default" where `given` is null.
InfoNode answer_node(const std::string& key, std::string value, const InfoNode* given);

}  // namespace dyntape::io
