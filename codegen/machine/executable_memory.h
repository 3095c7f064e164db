// SPDX-License-Identifier: BSD-3-Clause
//
// Instructions in memory that may be run and no longer written: pages of their own between two that may not be touched.
//
//   const ExecutableMemory memory(code);            // written, then made executable; Unavailable where the system forbids it
//   reinterpret_cast<int (*)()>(memory.code().data())();
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace dyntape::codegen {

class ExecutableMemory {
 public:
  explicit ExecutableMemory(std::span<const std::uint8_t> code);
  ~ExecutableMemory();
  ExecutableMemory(const ExecutableMemory&) = delete;
  ExecutableMemory& operator=(const ExecutableMemory&) = delete;

  std::span<const std::uint8_t> code() const { return code_; }

 private:
  void* pages_ = nullptr;  // with those that guard it
  std::size_t bytes_ = 0;
  std::span<const std::uint8_t> code_;
};

}  // namespace dyntape::codegen
