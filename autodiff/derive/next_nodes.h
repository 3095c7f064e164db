// SPDX-License-Identifier: BSD-3-Clause
//
// Nodes that are still to be visited, the smallest first, each once.
//
//   NextNodes next(graph.size());
//   next.push(7), next.push(3), next.push(7);
//   next.pop();      // 3, then 7, then it is empty
//
// A bit a node, and above every 64 of them a bit that says whether one is set, up to a single word: what a priority
// queue does with comparisons takes a few instructions, however large the graph.  Internal to the derivation.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include <dyntape/autodiff/graph/node_table.h>

namespace dyntape {

class NextNodes {
 public:
  // Of nodes below `size`.
  explicit NextNodes(std::size_t size) {
    do {
      size = (size + 63) / 64;
      levels_.emplace_back(size > 0 ? size : 1);
    } while (size > 1);
  }

  bool empty() const { return levels_.back()[0] == 0; }

  void push(NodeId id) {
    std::size_t place = id;
    for (auto& words : levels_) {
      std::uint64_t& word = words[place / 64];
      const bool was_empty = word == 0;
      word |= std::uint64_t{1} << (place % 64);
      if (!was_empty) return;
      place /= 64;
    }
  }

  // The smallest, which is taken out.  There is one.
  NodeId pop() {
    std::size_t place = 0;
    for (std::size_t level = levels_.size(); level-- > 0;)
      place = place * 64 + static_cast<std::size_t>(std::countr_zero(levels_[level][place]));
    std::size_t cleared = place;
    for (auto& words : levels_) {
      std::uint64_t& word = words[cleared / 64];
      word &= ~(std::uint64_t{1} << (cleared % 64));
      if (word != 0) break;
      cleared /= 64;
    }
    return static_cast<NodeId>(place);
  }

 private:
  std::vector<std::vector<std::uint64_t>> levels_;
};

}  // namespace dyntape
