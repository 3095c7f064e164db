// SPDX-License-Identifier: BSD-3-Clause
//
// Instructions in memory that may be run and no longer written: pages of their own between two that may not be touched.
//
//   const ExecutableMemory memory({first, second});    // written, then made executable; Unavailable where the system forbids it
//   reinterpret_cast<int (*)()>(memory.code(1).data())();
//
// A process has some 65 000 mappings, of which one object of this kind takes three.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace dyntape::codegen {

class ExecutableMemory {
 public:
  explicit ExecutableMemory(const std::vector<std::span<const std::uint8_t>>& codes);
  ~ExecutableMemory();
  ExecutableMemory(const ExecutableMemory&) = delete;
  ExecutableMemory& operator=(const ExecutableMemory&) = delete;

  std::span<const std::uint8_t> code(std::size_t k) const { return codes_[k]; }

 private:
  void* pages_ = nullptr;  // with the guard pages around it
  std::size_t bytes_ = 0;
  std::vector<std::span<const std::uint8_t>> codes_;
};

}  // namespace dyntape::codegen
