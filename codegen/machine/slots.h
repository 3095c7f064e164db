// SPDX-License-Identifier: BSD-3-Clause
//
// Places of the work array, single or several side by side, that serve again.
//
//   Slots slots;
//   const std::uint32_t one = slots.take(), pair = slots.take_block(2, 2);
//   slots.leave(pair), slots.leave(pair + 1);        free again together
//   slots.free_what_was_left();                      not before: an instruction may still read them
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace dyntape::codegen {

class Slots {
 public:
  std::uint32_t count() const { return count_; }  // that were ever taken

  std::uint32_t take() {
    if (free_.empty()) return count_++;
    const std::uint32_t slot = free_.back();
    free_.pop_back();
    return slot;
  }

  // The first of `length`, of which `in_use` will be left one by one.
  std::uint32_t take_block(std::uint32_t length, std::uint32_t in_use) {
    std::vector<std::uint32_t>& free = free_blocks_[length];
    std::uint32_t first = count_;
    if (free.empty())
      count_ += length;
    else
      first = free.back(), free.pop_back();
    if (in_use == 0)
      left_blocks_.emplace_back(length, first);
    else
      blocks_[first] = {length, in_use};
    return first;
  }

  void leave(std::uint32_t slot) {
    auto block = blocks_.upper_bound(slot);
    if (block == blocks_.begin() || slot - (--block)->first >= block->second.length)
      return left_.push_back(slot);
    if (--block->second.in_use) return;
    left_blocks_.emplace_back(block->second.length, block->first);
    blocks_.erase(block);
  }

  void free_what_was_left() {
    free_.insert(free_.end(), left_.begin(), left_.end());
    left_.clear();
    for (const auto& [length, first] : left_blocks_) free_blocks_[length].push_back(first);
    left_blocks_.clear();
  }

 private:
  struct Block {
    std::uint32_t length, in_use;
  };
  std::uint32_t count_ = 0;
  std::vector<std::uint32_t> free_, left_;
  std::map<std::uint32_t, Block> blocks_;                            // in use, by their first slots
  std::map<std::uint32_t, std::vector<std::uint32_t>> free_blocks_;  // by length
  std::vector<std::pair<std::uint32_t, std::uint32_t>> left_blocks_;
};

}  // namespace dyntape::codegen
