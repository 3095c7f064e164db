// SPDX-License-Identifier: BSD-3-Clause
//
// Finds existing nodes of a graph (hash-consing).
//
//   if (table.add_new(id, newest, bit)) nodes[id] = node;      // the next node; no other is read
//   else ... table.find(newest, is_it), table.find_or_add_keyed(key, id, is_it);
//
// A new node usually has a new argument, and few nodes share one.  So nodes with the same newest argument form a
// list at this argument.  There each of them sets one of 32 bits, which depends on its operator and its arguments.
// A node whose bit is not set is new: no list is walked, and the processor predicts the branch.  A node that shares
// the bit of another one and differs from it is in a hash table.  So are all nodes of an argument all of whose bits
// are set, as of an input with a million users, and nodes without arguments.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace dyntape {

using NodeId = std::uint32_t;
inline constexpr NodeId kNoNode = 0xffffffffu;
inline constexpr std::size_t kMostNodes = 0x7fffffffu;  // of a graph

namespace detail {
[[noreturn]] void refuse_more_nodes();

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
  NodeTable() = default;
  // A copy is empty: most copies of a graph are only read.
  NodeTable(const NodeTable&) {}
  NodeTable(NodeTable&& other) noexcept { swap(other); }
  NodeTable& operator=(NodeTable other) noexcept { return swap(other), *this; }
  ~NodeTable() = default;

  // The number of nodes that have a place; 0: the table knows no node.
  std::size_t room() const { return room_; }
  void make_room(std::size_t nodes) {
    links_.resize(nodes);
    room_ = nodes;
  }

  // The bit of a node, from a number in which nodes with the same newest argument differ.
  static std::uint32_t bit_of(std::uint32_t number) { return 1u << (number * 0x9e3779b9u >> 27); }
  // Adds node `id`, unless there is no room or another node may be equal.
  [[gnu::always_inline]] bool add_new(std::size_t id, NodeId newest_argument, std::uint32_t bit) {
    if (id >= room_) return false;
    Link& argument = links_[newest_argument];
    if (argument.users & bit) return false;
    links_[id] = {0, kNoNode, argument.first};
    argument.users |= bit;
    argument.first = static_cast<NodeId>(id);
    return true;
  }
  // The node in the list of this argument for which is_it returns true, or kNoNode.
  template <class IsIt>
  NodeId find(NodeId newest_argument, IsIt&& is_it) const {
    NodeId id = links_[newest_argument].first;
    while (id != kNoNode && !is_it(id)) id = links_[id].next;
    return id;
  }
  // If all bits of this argument are set: moves its list into the hash table.
  template <class KeyOf>
  void move_full_list(NodeId newest_argument, KeyOf&& key_of) {
    if (links_[newest_argument].users != 0xffffffffu) return;
    NodeId id = std::exchange(links_[newest_argument].first, kNoNode);
    for (; id != kNoNode; id = links_[id].next)
      keyed_.find_or_add(key_of(id), id, [](NodeId) { return false; });
  }

  // Returns the node with this key for which is_it returns true; else adds and returns `next`.
  template <class IsIt>
  NodeId find_or_add_keyed(std::uint64_t key, NodeId next, IsIt&& is_it) {
    const NodeId id = keyed_.find_or_add(key, next, is_it);
    if (id == next) add_to_no_list(next);
    return id;
  }
  // Returns the constant with these bits, or kNoNode.
  NodeId find_constant(std::uint64_t bits) const { return constants_.find(bits); }
  void add_constant(std::uint64_t bits, NodeId next) {
    constants_.add(bits, next);
    add_to_no_list(next);
  }

  // Forgets all nodes and keeps the memory.
  void clear() {
    keyed_.clear();
    constants_.clear();
  }
  std::size_t bytes() const { return links_.capacity() * sizeof(Link) + keyed_.bytes() + constants_.bytes(); }

 private:
  struct Link {
    std::uint32_t users = 0;  // the bits of nodes with this newest argument
    NodeId first = kNoNode;   // of the list of this node: the last added
    NodeId next = kNoNode;    // in the list that contains this node
  };

  void swap(NodeTable& other) noexcept {
    links_.swap(other.links_);
    std::swap(room_, other.room_);
    std::swap(keyed_, other.keyed_);
    std::swap(constants_, other.constants_);
  }
  void add_to_no_list(NodeId id) { links_[id] = {}; }

  std::vector<Link> links_;  // one per node, and more
  std::size_t room_ = 0;     // the number of links
  KeyTable keyed_;
  ConstantTable constants_;
};

}  // namespace dyntape
