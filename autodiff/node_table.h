// SPDX-License-Identifier: BSD-3-Clause
//
// Where a graph looks up whether it has a node already: open addressing over the array of nodes.
//
//   NodeId& slot = table.slot(hash, anchor, [&](NodeId other) { return nodes[other] == node; });
//   if (slot == kNoNode) slot = append(node);
//
// A plain hash scatters neighbours over the whole table, and on a tape of millions of nodes each look-up is
// then a miss in every cache.  But a new node mostly uses a node that is new itself, so each is kept near the
// place of its newest argument (the anchor), where the processor is working anyway.  When the few slots there
// are taken, as they are for an input that a million nodes use, the plain hash decides.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace dyntape {

using NodeId = std::uint32_t;
inline constexpr NodeId kNoNode = 0xffffffffu;

class NodeTable {
 public:
  // Whether one more of `nodes` fits; if not, grow() and put all of them in again.
  bool has_room(std::size_t nodes) const { return (nodes + 1) * 2 <= slots_.size(); }
  void grow(std::size_t nodes) { slots_.assign(std::bit_ceil((nodes + 32) * 2), kNoNode); }

  // The slot of the node for which is_it says so, or the empty slot where it belongs.
  // anchor == kNoNode: the node has no neighbourhood.
  template <class IsIt>
  NodeId& slot(std::uint64_t hash, NodeId anchor, IsIt&& is_it) {
    const std::size_t mask = slots_.size() - 1;
    if (anchor != kNoNode) {
      std::size_t i = (std::size_t(anchor) * 2 + hash % kNeighbours) & mask;
      for (int tries = 0; tries < kNeighbours; ++tries, i = (i + 1) & mask) {
        if (slots_[i] == kNoNode || is_it(slots_[i])) return slots_[i];
      }
    }
    // In steps of its own, because neighbours fill long runs without a gap.
    std::size_t i = (hash >> 8) & mask;
    const std::size_t step = (hash >> 40) | 1;
    while (slots_[i] != kNoNode && !is_it(slots_[i])) i = (i + step) & mask;
    return slots_[i];
  }

  std::size_t bytes() const { return slots_.capacity() * sizeof(NodeId); }

 private:
  static constexpr int kNeighbours = 8;
  std::vector<NodeId> slots_;  // size a power of two, at most half full
};

}  // namespace dyntape
