// SPDX-License-Identifier: BSD-3-Clause
//
// A queue of nodes to visit: returns the smallest node first, each node once.
//
//   NextNodes next(graph.size());
//   next.push(7), next.push(3), next.push(7);
//   next.pop();      // 3, then 7; then the queue is empty
//
// Stores a bit for each node; a bit above marks each group of 64 that has a set bit, up to a single word.  An
// operation takes a few instructions for any size of graph, less than the comparisons of a priority queue.  Internal
// to the derivation.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include <dyntape/autodiff/graph/node_table.h>

namespace dyntape {

class NextNodes {
 public:
  // For nodes below `size`.
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

  // Removes and returns the smallest node.  The queue must not be empty.
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
