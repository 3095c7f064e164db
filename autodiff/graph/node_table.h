// SPDX-License-Identifier: BSD-3-Clause
//
// Finds existing nodes of a graph (hash-consing).
//
//   for (NodeId id = table.first_user(newest); id != kNoNode; id = table.next_user(id)) if (nodes[id] == node) return
//   id; table.add_user(newest), nodes.push_back(node);
//
// A new node usually has a new argument, and few nodes share one.  So nodes with the same newest argument form a
// list at this argument.  A look-up visits one or two cached nodes, without a hash.  If the list is full, as for an
// input with a million users, and for nodes without arguments, a hash table is used.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace dyntape {

using NodeId = std::uint32_t;
inline constexpr NodeId kNoNode = 0xffffffffu;
inline constexpr std::size_t kMostNodes = 0x7fffffffu;  // of a graph

namespace detail {
[[noreturn]] void refuse_more_nodes();

// Appends one element per node; growth is out of line.
template <class T>
[[gnu::noinline, gnu::cold]] void make_room(std::vector<T>& elements) {
  const std::size_t size = elements.size();
  if (size >= kMostNodes) refuse_more_nodes();
  elements.reserve(std::min(kMostNodes, std::max<std::size_t>(64, 2 * size)));
}
template <class T>
[[gnu::always_inline]] inline T& add_one(std::vector<T>& elements) {
  if (elements.size() == elements.capacity()) make_room(elements);
  if (elements.size() == elements.capacity()) __builtin_unreachable();
  return elements.emplace_back();
}
}  // namespace detail

// The common part of the hash tables below: a power of two of slots, at most half full.
template <class Slot>
class Slots {
 public:
  void clear() {
    std::fill(slots_.begin(), slots_.end(), Slot{});
    used_ = 0;
  }
  std::size_t bytes() const { return slots_.capacity() * sizeof(Slot); }

 protected:
  std::vector<Slot> slots_;
  std::size_t used_ = 0;
};

struct KeySlot {
  std::uint32_t tag = 0;
  NodeId id = kNoNode;
};
struct ConstantSlot {
  std::uint64_t bits = 0;
  NodeId id = kNoNode;
};

// Open addressing.  Slots are small, and keys that differ only in their last three bits are contiguous: a table of a
// million nodes exceeds the caches, and nodes that are looked up together should be close.
class KeyTable : public Slots<KeySlot> {
 public:
  // Returns the node with this key for which is_it returns true; else adds and returns `next`.
  template <class IsIt>
  NodeId find_or_add(std::uint64_t key, NodeId next, IsIt&& is_it) {
    if (used_ * 2 >= slots_.size()) grow();
    const std::uint32_t tag = tag_of(key);
    std::size_t i = tag & (slots_.size() - 1);
    for (; slots_[i].id != kNoNode; i = (i + 1) & (slots_.size() - 1)) {
      if (slots_[i].tag == tag && is_it(slots_[i].id)) return slots_[i].id;
    }
    ++used_;
    slots_[i] = {tag, next};
    return next;
  }

 private:
  using Slot = KeySlot;

  static std::uint32_t tag_of(std::uint64_t key) {
    const std::uint64_t rest = key >> 3;
    return static_cast<std::uint32_t>((rest ^ rest >> 32) * 0x9e3779b97f4a7c15u >> 32) << 3 | (key & 7);
  }
  // A slot's new index is its old one, or that plus a multiple of the old size, so memory is accessed in order.
  void grow() {
    std::vector<Slot> old(std::max<std::size_t>(64, slots_.size() * 4));
    old.swap(slots_);
    for (const Slot& slot : old) {
      if (slot.id == kNoNode) continue;
      std::size_t i = slot.tag & (slots_.size() - 1);
      while (slots_[i].id != kNoNode) i = (i + 1) & (slots_.size() - 1);
      slots_[i] = slot;
    }
  }
};

// The same for constants, by their bits.
class ConstantTable : public Slots<ConstantSlot> {
 public:
  // The node of the constant with these bits, or kNoNode.
  NodeId find(std::uint64_t bits) const { return slots_.empty() ? kNoNode : slots_[place_of(bits)].id; }
  void add(std::uint64_t bits, NodeId id) {
    if (++used_ * 2 >= slots_.size()) grow();
    slots_[place_of(bits)] = {bits, id};
  }

 private:
  using Slot = ConstantSlot;

  // The slot of these bits, or where it would be.
  std::size_t place_of(std::uint64_t bits) const {
    const std::size_t last = slots_.size() - 1;
    std::size_t i = ((bits ^ bits >> 32) * 0x9e3779b97f4a7c15u >> 32) & last;
    while (slots_[i].id != kNoNode && slots_[i].bits != bits) i = (i + 1) & last;
    return i;
  }
  void grow() {
    std::vector<Slot> old(std::max<std::size_t>(64, slots_.size() * 4));
    old.swap(slots_);
    for (const Slot& slot : old) {
      if (slot.id != kNoNode) slots_[place_of(slot.bits)] = slot;
    }
  }
};

class NodeTable {
 public:
  // Number of nodes; also the next id.
  std::size_t size() const { return links_.size(); }

  // The list of the nodes with this newest argument, last added first.
  NodeId first_user(NodeId node) const { return links_[node].first; }
  NodeId next_user(NodeId user) const { return links_[user].next; }
  // Adds the next node, to the list of its newest argument unless that already has kListed.
  static constexpr int kListed = 8;
  bool is_full(NodeId node) const {
    int users = 0;
    for (NodeId id = first_user(node); id != kNoNode && users < kListed; id = next_user(id)) ++users;
    return users == kListed;
  }
  [[gnu::always_inline]] NodeId add_user(NodeId newest_argument) {
    const NodeId id = next(), first = links_[newest_argument].first;
    detail::add_one(links_).next = first;
    links_[newest_argument].first = id;
    return id;
  }

  // Returns the node with this key for which is_it returns true; else adds and returns the number of the next node.
  template <class IsIt>
  NodeId find_or_add_keyed(std::uint64_t key, IsIt&& is_it) {
    return known(keyed_.find_or_add(key, next(), is_it));
  }
  // Returns the constant with these bits, or kNoNode and adds the next node for it.
  NodeId find_constant(std::uint64_t bits) const { return constants_.find(bits); }
  NodeId add_constant(std::uint64_t bits) {
    constants_.add(bits, next());
    return known(next());
  }

  void reserve(std::size_t nodes) { links_.reserve(nodes); }
  // Forgets all nodes and keeps the memory.
  void clear() {
    links_.clear();
    keyed_.clear();
    constants_.clear();
  }
  std::size_t bytes() const { return links_.capacity() * sizeof(Link) + keyed_.bytes() + constants_.bytes(); }

 private:
  struct Link {
    NodeId first = kNoNode;  // of the list of this node: the last added
    NodeId next = kNoNode;   // in the list that contains this node
  };

  NodeId next() const { return static_cast<NodeId>(links_.size()); }
  NodeId known(NodeId id) {
    if (id == links_.size()) detail::add_one(links_);
    return id;
  }

  std::vector<Link> links_;  // one per node
  KeyTable keyed_;
  ConstantTable constants_;
};

}  // namespace dyntape
